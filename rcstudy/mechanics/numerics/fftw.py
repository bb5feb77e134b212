"""pyFFTW without `pyfftw.interfaces`, its replacements for the FFTs of scipy and dask, which are not used here.

Importing these loads scipy, dask, xarray and pandas where installed, which adds a second to every start.
"""

from __future__ import annotations

from rcstudy.mechanics.numerics.later import deferred_import

with deferred_import("pyfftw.interfaces"):
    import pyfftw

__all__ = ["pyfftw"]
