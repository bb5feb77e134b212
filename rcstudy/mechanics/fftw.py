"""pyFFTW, without the half of the scientific world that it would load along with itself.

`import pyfftw` loads `pyfftw.interfaces`, stand-ins for the FFTs of scipy and dask, and with them scipy, dask, xarray
and pandas if they are there: a second, for nothing that is used here. So that part is put off until someone asks for
it.
"""

from __future__ import annotations

import importlib
import sys
from types import ModuleType
from typing import Any

_INTERFACES = "pyfftw.interfaces"


def _put_off() -> ModuleType:
    """A module in place of the interfaces, which loads them at the first use of anything in it."""

    def load(name: str) -> Any:
        return getattr(importlib.import_module(_INTERFACES), name)

    module = ModuleType(_INTERFACES)
    module.__dict__["__getattr__"] = load  # PEP 562
    return module


if "pyfftw" in sys.modules:
    import pyfftw
else:
    sys.modules[_INTERFACES] = _put_off()
    try:
        import pyfftw
    finally:
        # the name is free again: importing it means the real ones
        del sys.modules[_INTERFACES]

__all__ = ["pyfftw"]
