"""Caches of function results that are limited by the number of bytes they hold."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Hashable
from functools import wraps
from typing import Any, Protocol, TypeVar


class Sized(Protocol):
    """An object that reports how many bytes it holds."""

    @property
    def nbytes(self) -> int:
        """Bytes held."""


T = TypeVar("T", bound=Sized)


def keep_within(limit: int) -> Callable[[Callable[..., T]], Callable[..., T]]:
    """Decorator that caches the results of a function, as `functools.lru_cache` does, up to `limit` bytes in all.

    Beyond that the least recently used results are dropped; the newest one always stays.
    """

    def decorate(make: Callable[..., T]) -> Callable[..., T]:
        kept: OrderedDict[Hashable, T] = OrderedDict()

        @wraps(make)
        def made(*arguments: Hashable) -> T:
            if arguments in kept:
                kept.move_to_end(arguments)
                return kept[arguments]
            value = kept[arguments] = make(*arguments)
            while len(kept) > 1 and sum(one.nbytes for one in kept.values()) > limit:
                kept.popitem(last=False)
            return value

        as_any: Any = made
        as_any.cache_clear = kept.clear
        return made

    return decorate
