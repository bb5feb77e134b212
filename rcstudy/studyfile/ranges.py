"""Axes given as ranges: a number of values from the first to the last, in equal steps or by equal factors."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Annotated, Any, Literal

from pydantic import PlainValidator

from rcstudy.studyfile.quantities import Quantity, Whole, as_quantity, refusal, with_hint
from rcstudy.studyfile.spec import Spec, validate
from rcstudy.studyfile.yamltree import REFUSED, Node, Problems, child_path

MAX_VALUES = 1000
_DIGITS = 6  # of the values in between, unless they are so close that they need more
_ROUNDING = 1e-12  # times the larger end: values in between below this are zero up to rounding


class _End:
    """Validator of a number: plain or, unless the axis takes plain ones only, relative."""

    def __init__(self, *, plain: bool = False) -> None:
        self.allowed = "a number" if plain else "a number, or one of the form '0.5 a' or '2 Es'"
        self._plain = plain

    def __call__(self, value: Any) -> Quantity:
        quantity = as_quantity(value)
        if quantity is None or (self._plain and quantity.scale):
            raise refusal(with_hint(self.allowed, value))
        return quantity


class RangeSpec(Spec):
    """`count` values from `first` to `last`; `spacing` log: the ratio of neighbouring values is constant."""

    first: Annotated[Quantity, PlainValidator(_End())]
    last: Annotated[Quantity, PlainValidator(_End())]
    count: Annotated[int, PlainValidator(Whole(2, MAX_VALUES))]
    spacing: Literal["linear", "log"] = "linear"

    def values(self) -> list[Quantity]:
        """The values; those between the ends are rounded to six digits if all stay in order, and near zero to zero."""
        one, other, steps = self.first.value, self.last.value, self.count - 1
        if self.spacing == "log":
            sign, logs = math.copysign(1.0, one), (math.log(abs(one)), math.log(abs(other)))
            between = [sign * math.exp(logs[0] + (logs[1] - logs[0]) * (k / steps)) for k in range(1, steps)]
        else:
            between = [one * (1.0 - k / steps) + other * (k / steps) for k in range(1, steps)]
            rounding = _ROUNDING * max(abs(one), abs(other))
            between = [0.0 if abs(value) <= rounding else value for value in between]
        rounded = [float(f"{value:.{_DIGITS}g}") for value in between]
        if [one, *rounded, other] == sorted({one, *rounded, other}, reverse=other < one):
            between = rounded
        return [Quantity(value, self.first.scale) for value in (one, *between, other)]


class _PlainRangeSpec(RangeSpec):
    """A range whose numbers cannot be relative."""

    first: Annotated[Quantity, PlainValidator(_End(plain=True))]
    last: Annotated[Quantity, PlainValidator(_End(plain=True))]


def spread(node: Node, problems: Problems, *, plain: bool) -> Node:
    """The list of values that the mapping `node` stands for, at its place; if it is wrong, of one REFUSED value.

    `plain`: relative numbers are not allowed.
    """
    spec = validate(_PlainRangeSpec if plain else RangeSpec, node, problems)
    entries = [Node(REFUSED, child_path(node.path, 0), "", node.line, node.column)]
    values = () if spec is None else (spec.first.value, spec.last.value)
    if spec is None:
        pass
    elif spec.first.scale != spec.last.scale:
        like = f"a multiple of {spec.first.scale}" if spec.first.scale else "a plain number"
        problems.add(node.value["last"], f"must be {like}, as first is")
    elif spec.first.value == spec.last.value:
        problems.add(node.value["last"], "must be different from first")
    elif spec.spacing == "log" and not min(values) > 0.0 and not max(values) < 0.0:
        problems.add(node.value["spacing"], "must be linear, unless first and last are both above 0, or both below")
    elif len(set(map(str, found := spec.values()))) < spec.count:
        problems.add(node.value["last"], f"must be farther from first: {spec.count} values between them look alike")
    else:
        entries = [_entry(node, k, value) for k, value in enumerate(found)]
    return replace(node, value=entries, size=1 + len(entries))


def _entry(node: Node, k: int, value: Quantity) -> Node:
    """Value number `k` of the axis at `node`, as if it had been written there."""
    text = str(value)
    exact = f"{value.value!r} {value.scale}" if value.scale else value.value
    return Node(exact, child_path(node.path, k), text, node.line, node.column)
