"""Imports put off: libraries load large parts of others just to see whether they are there."""

from __future__ import annotations

import contextlib
import importlib
import sys
from collections.abc import Iterator
from types import ModuleType
from typing import Any


@contextlib.contextmanager
def put_off(name: str) -> Iterator[None]:
    """Let `import name` inside the block load nothing: the module is loaded at the first use of anything in it.

    Nothing happens if it is loaded already. After the block, importing `name` means the real one again.
    """
    if name in sys.modules:
        yield
        return
    stand_in = ModuleType(name)

    def leave() -> None:
        if sys.modules.get(name) is stand_in:
            del sys.modules[name]

    def load(attribute: str) -> Any:
        leave()
        return getattr(importlib.import_module(name), attribute)

    stand_in.__dict__["__getattr__"] = load  # PEP 562
    sys.modules[name] = stand_in
    try:
        yield
    finally:
        leave()
