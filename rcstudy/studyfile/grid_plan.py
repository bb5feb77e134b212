"""A validated grid: its axes, the settings that all its cases share, and those of each case."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from rcstudy.mechanics.scene import Scene
from rcstudy.studyfile.build import Parts, build, with_part


@dataclass(frozen=True)
class AxisPlan:
    """An axis of a grid: the `path` of the setting it varies, the dim's `name`, and each value with its label.

    Values are validated settings (float, int, str, pairs, Quantity, dicts of these, tuples of layers); of the axis
    "case" of an explicit list they are whole Parts.
    """

    path: str
    name: str
    labels: tuple[str, ...]
    values: tuple[Any, ...]


@dataclass(frozen=True)
class GridPlan:
    """A validated grid: product of `axes` over the settings `base`."""

    name: str
    description: str
    axes: tuple[AxisPlan, ...]
    base: Parts

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of values of each axis."""
        return tuple(len(axis.values) for axis in self.axes)

    @property
    def size(self) -> int:
        """Number of cases."""
        return math.prod(self.shape)

    def indices(self) -> Iterator[tuple[int, ...]]:
        """Index of every case, the last axis fastest."""
        return itertools.product(*(range(n) for n in self.shape))

    def has(self, index: tuple[int, ...]) -> bool:
        """Whether there is a case at `index`."""
        return len(index) == len(self.shape) and all(0 <= i < n for i, n in zip(index, self.shape, strict=True))

    def parts(self, index: tuple[int, ...]) -> Parts:
        """The settings of the case at `index`."""
        parts = self.base
        for axis, i in zip(self.axes, index, strict=True):
            value = axis.values[i]
            parts = value if axis.path == "case" else with_part(parts, axis.path, value)
        return parts

    def scene(self, index: tuple[int, ...]) -> Scene:
        """The scene of the case at `index`."""
        return build(self.parts(index))
