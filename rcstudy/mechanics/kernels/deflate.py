"""Deflate (RFC 1951) with the fixed codes and runs of equal bytes only (`rcstudy/deflate.py`)."""

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
    """One final block that holds the bytes `data`; the number of bytes written to `out`.

    `words`: the same bytes, eight a word, as far as they fill words. `literal` [256], `run` [259]: codes of a byte
    and of so many (3..258) repetitions of the last one, least bit first, with their numbers of bits. `out` has room
    for 9 bits a byte and 8 bytes more.
    """
    n = data.shape[0]
    bits, count, at = 3, 3, 0  # the last block, fixed codes
    i = 0
    while i < n:
        value = data[i]
        end = i + 1
        if value == 0:  # mostly long: eight at a time where they can be
            while end < n and data[end] == 0:
                if end % 8 == 0 and end // 8 < words.shape[0] and words[end // 8] == 0:
                    end += 8
                else:
                    end += 1
        else:
            while end < n and data[end] == value:
                end += 1
        bits |= literal[value] << count
        count += literal_bits[value]
        i += 1
        while i < end:
            if count >= 32:
                for k in range(4):
                    out[at + k] = (bits >> (8 * k)) & 255
                at += 4
                bits >>= 32
                count -= 32
            length = min(end - i, 258)
            if length >= 3:
                bits |= run[length] << count
                count += run_bits[length]
                i += length
            else:
                bits |= literal[value] << count
                count += literal_bits[value]
                i += 1
        if count >= 32:
            for k in range(4):
                out[at + k] = (bits >> (8 * k)) & 255
            at += 4
            bits >>= 32
            count -= 32
    count += 7  # the end of the block is seven zeros
    while count > 0:
        out[at] = bits & 255
        at += 1
        bits >>= 8
        count -= 8
    return at
