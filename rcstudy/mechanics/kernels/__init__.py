"""Every compiled kernel, and nothing else: plain loops over arrays, no I/O, no globals.

Real-space arrays are [ix, iy]; arrays of Fourier coefficients carry the suffix ``_hat``. A kernel calls none of
another file: Numba's cache does not notice a callee that changed elsewhere.
"""
