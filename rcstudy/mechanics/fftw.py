"""pyFFTW without its interfaces, stand-ins for the FFTs of scipy and dask, which are not used here.

They load scipy, dask, xarray and pandas, where these are installed: a second of every start.
"""

from __future__ import annotations

from rcstudy.mechanics.later import put_off

with put_off("pyfftw.interfaces"):
    import pyfftw

__all__ = ["pyfftw"]
