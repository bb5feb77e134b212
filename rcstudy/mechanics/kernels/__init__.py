"""Every compiled kernel, and nothing else: plain loops over arrays, no I/O, no globals.

Real-space arrays are [ix, iy]; those of Fourier coefficients say so. A kernel calls none of another file: Numba's
cache does not notice a callee that changed elsewhere.
"""
