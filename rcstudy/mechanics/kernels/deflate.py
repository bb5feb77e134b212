"""Zlib streams (RFC 1950, 1951) of what fields are made of: runs of equal bytes or words (`rcstudy/deflate.py`)."""

from __future__ import annotations

import numpy as np

from rcstudy.mechanics.jit import jit


@jit
def deflate_runs(
    data: np.ndarray,
    words: np.ndarray,
    literal: np.ndarray,
    literal_bits: np.ndarray,
    run: np.ndarray,
    run_bits: np.ndarray,
    out: np.ndarray,
) -> int:
    """The zlib stream of the bytes `data`, in one block; the number of bytes written to `out`.

    `words`: the same bytes, eight a word, as far as they fill words. `literal` [256], `run` [259]: codes of a byte
    and of so many (3..258) repetitions of the last one, least bit first, with their numbers of bits. `out` has room
    for 9 bits a byte and 16 bytes more.
    """
    n = data.shape[0]
    out[0], out[1], at = 0x78, 0x01, 2
    bits, count = 3, 3  # the last block, fixed codes
    low, high = 1, 0  # Adler's sums, without their modulus until they get large
    i = 0
    while i < n:
        value = int(data[i])
        end = i + 1
        if value == 0:  # mostly long: eight at a time between its ends
            while end < n and end % 8 != 0 and data[end] == 0:
                end += 1
            if end % 8 == 0:
                k = end // 8
                while k < words.shape[0] and words[k] == 0:
                    k += 1
                end = 8 * k
                while end < n and data[end] == 0:
                    end += 1
            high += low * (end - i)
        else:
            low += value
            high += low
            while end < n and data[end] == value:
                end += 1
                low += value
                high += low
        if high > 1 << 48:
            low %= 65521
            high %= 65521
        bits |= literal[value] << count
        count += literal_bits[value]
        i += 1
        while i < end:
            length = min(end - i, 258)
            if length < 3:
                length = 1
                bits |= literal[value] << count
                count += literal_bits[value]
            else:
                bits |= run[length] << count
                count += run_bits[length]
            i += length
            while count >= 8:
                out[at] = bits & 255
                at += 1
                bits >>= 8
                count -= 8
        if count >= 32:
            out[at] = bits & 255
            out[at + 1] = (bits >> 8) & 255
            out[at + 2] = (bits >> 16) & 255
            out[at + 3] = (bits >> 24) & 255
            at += 4
            bits >>= 32
            count -= 32
    count += 7  # the end of the block is seven zeros
    while count > 0:
        out[at] = bits & 255
        at += 1
        bits >>= 8
        count -= 8
    adler = (high % 65521) * 65536 + low % 65521
    for k in range(4):
        out[at + k] = (adler >> (24 - 8 * k)) & 255
    return at + 4


@jit
def deflate_words(data: np.ndarray, words: np.ndarray, run: np.ndarray, run_bits: np.ndarray, out: np.ndarray) -> int:
    """The zlib stream of the bytes `data`, where only runs of equal words are made small; bytes written to `out`.

    `words`: the same bytes, eight a word, as far as they fill words. What lies between runs is stored as it is, so that
    it costs no more than copying. `run` [259], `run_bits`: as in `deflate_runs`. `out` has room for an eighth more than
    `data` and 24 bytes.
    """
    n = words.shape[0]
    out[0], out[1], at = 0x78, 0x01, 2
    bits, count = 0, 0  # not in `out` yet, and how many they are
    low, high = 1, 0  # Adler's sums
    i = 0
    while i < n:
        begin = i  # of a run of at least four: a shorter one costs more than it saves
        while begin < n:
            if begin + 3 >= n:
                begin = n
            elif words[begin + 2] != words[begin + 3]:
                begin += 3
            elif words[begin + 1] != words[begin + 2]:
                begin += 2
            elif words[begin] != words[begin + 1]:
                begin += 1
            else:
                break
        zeros = begin < n and words[begin] == 0
        first = begin if zeros or begin == n else begin + 1  # a run repeats a zero byte, or the word before
        low, high = adler(data, 8 * i, 8 * first, low, high)
        i *= 8
        while i < 8 * first:
            size = min(8 * first - i, 65528)
            # a stored block: three zeros, the rest of the byte, its length and the complement of that
            if count > 0:
                out[at] = bits
                at += 1
            if count == 0 or count > 5:
                out[at] = 0
                at += 1
            bits, count = 0, 0
            out[at], out[at + 1], out[at + 2], out[at + 3] = size & 255, size >> 8, ~size & 255, (~size >> 8) & 255
            at += 4
            out[at : at + size] = data[i : i + size]
            at += size
            i += size
        i = first
        if begin == n:
            break
        word, end = words[begin], begin + 4
        while end + 4 <= n:  # four at a time
            if (words[end] ^ word) | (words[end + 1] ^ word) | (words[end + 2] ^ word) | (words[end + 3] ^ word) != 0:
                break
            end += 4
        while end < n and words[end] == word:
            end += 1
        # a block of fixed codes
        bits |= 2 << count
        count += 3
        rest = 8 * (end - first)
        if zeros:
            high += low * rest
            bits |= 12 << count  # the code of a zero
            count += 8
            rest -= 1
        else:
            low, high = adler(data, 8 * first, 8 * end, low, high)
        while rest > 0:
            length = rest if rest <= 258 else min(rest - 3, 258)  # nothing shorter than three may be left
            rest -= length
            bits |= run[length] << count
            count += run_bits[length]
            if not zeros:  # a distance of eight, its code 5 and one extra bit, instead of one
                bits |= 52 << (count - 5)
                count += 1
            while count >= 8:
                out[at] = bits & 255
                at += 1
                bits >>= 8
                count -= 8
        count += 7  # the end of the block is seven zeros
        while count >= 8:
            out[at] = bits & 255
            at += 1
            bits >>= 8
            count -= 8
        i = end
    # the last block, stored, holds what does not fill a word
    bits |= 1 << count
    out[at] = bits & 255
    at += 1
    if count > 5:
        out[at] = bits >> 8
        at += 1
    size = data.shape[0] - 8 * n
    low, high = adler(data, 8 * n, 8 * n + size, low, high)
    out[at], out[at + 1], out[at + 2], out[at + 3] = size, 0, 255 - size, 255
    at += 4
    out[at : at + size] = data[8 * n :]
    at += size
    checksum = (high % 65521) * 65536 + low % 65521
    for k in range(4):
        out[at + k] = (checksum >> (24 - 8 * k)) & 255
    return at + 4


@jit
def adler(data: np.ndarray, start: int, stop: int, low: int, high: int) -> tuple[int, int]:
    """Adler's sums `low` and `high` with the bytes `start` to `stop` of `data`."""
    while start < stop:
        size = min(stop - start, 65536)
        total = moment = 0
        for k in range(size):
            value = int(data[start + k])
            total += value
            moment += (size - k) * value
        high = (high + low * size + moment) % 65521
        low = (low + total) % 65521
        start += size
    return low, high
