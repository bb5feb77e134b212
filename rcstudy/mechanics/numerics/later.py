"""Deferred imports: some libraries import large parts of others merely to find out whether these are installed."""

from __future__ import annotations

import contextlib
import importlib
import sys
from collections.abc import Iterator
from types import ModuleType
from typing import Any


@contextlib.contextmanager
def deferred_import(name: str) -> Iterator[None]:
    """Context in which `import name` loads nothing: the module is loaded when one of its attributes is first used.

    A module that is loaded already is left alone. After the block, `import name` imports the real module again.
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
