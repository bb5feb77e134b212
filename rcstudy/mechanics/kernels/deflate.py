"""A zlib stream (RFC 1950, 1951) with the fixed codes and runs of equal bytes only (`rcstudy/deflate.py`)."""

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
