"""The one place that states the Numba flags.

``fastmath`` and ``parallel`` stay off: they change last bits, and active sets amplify them. ``cache`` keeps the
machine code between processes; all kernels live in a package whose files do not call each other, so an edited callee
can never leave a stale caller behind.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

from rcstudy.mechanics.later import put_off

# no kernel calls BLAS; numba looks for scipy's, which takes a tenth of a second to load, when it loads the first kernel
with put_off("scipy.linalg.cython_blas"):
    import numba
    import numba.np.arraymath

F = TypeVar("F", bound=Callable[..., Any])


def jit(function: F) -> F:
    """Compile `function` in nopython mode, cached on disk, with strict IEEE arithmetic, releasing the GIL."""
    return cast(F, numba.njit(cache=True, nogil=True, fastmath=False, error_model="numpy")(function))
