"""Numbers of a study, plain or relative such as `0.25 a` and `2 Es`, and the validators of all kinds of values.

Each kind is a callable used as a pydantic validator. Its `allowed` describes in words the values it accepts; any other
value raises a PydanticCustomError of type "allowed" with these words as message. bool and text are never accepted as
numbers. Words and test come from the same bounds; pydantic's own constraints would need separate words, as its messages
do not suit a study. Only choices between words (Literal) and true or false (StrictBool) are validated by pydantic.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from pydantic_core import PydanticCustomError

from rcstudy.settings import unit_of
from rcstudy.studyfile.yamltree import OutOfRange, is_out_of_range

_NUMBER = r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?"  # no digits of other scripts, as in YAML
_RELATIVE = re.compile(rf"\s*({_NUMBER})?\s*(a|Es)\s*")
_FRACTION = re.compile(r"\s*([+-]?[0-9]{1,9})/([1-9][0-9]{0,8})\s*")
_BARE = re.compile(rf"\s*{_NUMBER}\s*")
_WITH_UNIT = re.compile(rf"\s*{_NUMBER}\s*[^\W\d].*")
_COMMENTED = re.compile(rf"\s*{_NUMBER}(\s*(a|Es))?#.*")
_SEPARATED = re.compile(r"\s*[+-]?[0-9]+[_,][0-9].*")
_UNITS = (
    f"numbers are written without units: lengths in {unit_of('thickness')}, forces in {unit_of('load')}, "
    f"moduli in {unit_of('modulus')}, spin in {unit_of('spin')}"
)


@dataclass(frozen=True)
class Quantity:
    """A length or modulus: `value` in mm or MPa, or, if `scale` is "a" or "Es", in multiples of that scale.

    "a" is the Hertz radius of the uncoated pair (geometric mean of the semi-axes), "Es" the substrate's modulus.
    """

    value: float
    scale: str = ""

    def resolve(self, scale: float) -> float:
        """The value in mm or MPa; `scale` is the size of a (mm) or Es (MPa)."""
        return self.value * scale if self.scale else self.value

    def __str__(self) -> str:
        return f"{number_text(self.value)} {self.scale}".rstrip()


def number_text(value: float) -> str:
    """Text of a number, with at most 12 digits: `0.25`, `210000`, `1e-07`."""
    return format(value, ".12g")


def refusal(allowed: str) -> PydanticCustomError:
    """The error with the words `allowed` as its message."""
    return PydanticCustomError("allowed", "{words}", {"words": allowed})


def as_number(value: Any) -> float | None:
    """`value` as a finite float if it is a number (not bool, not text), else None."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    try:
        number = float(value)
    except OverflowError:
        return None
    return number + 0.0 if math.isfinite(number) else None  # + 0.0: no negative zero


def as_fraction(value: Any) -> float | None:
    """`value` as a finite float if it is a number or the text of a fraction of whole numbers, `1/6`, else None."""
    match = _FRACTION.fullmatch(value) if isinstance(value, str) else None
    return int(match[1]) / int(match[2]) if match else as_number(value)


def as_quantity(value: Any) -> Quantity | None:
    """`value` as a Quantity if it is a finite number, plain or relative, else None."""
    match = _RELATIVE.fullmatch(value) if isinstance(value, str) else None
    if match:
        number = as_number(_factor(match))
        return None if number is None else Quantity(number, match[2])
    number = as_number(value)
    return None if number is None else Quantity(number)


def _factor(match: re.Match[str]) -> float:
    """The factor of a relative quantity, 1 where none is written."""
    factor = float(match[1] or 1.0)
    return OutOfRange(factor) if match[1] and is_out_of_range(match[1], factor) else factor


def _is_out_of_range(value: Any) -> bool:
    """Whether `value` is a number, plain or relative, that floating point has not."""
    if match := _RELATIVE.fullmatch(value) if isinstance(value, str) else None:
        value = _factor(match)
    large = isinstance(value, int) and not isinstance(value, bool) and as_number(value) is None
    return large or isinstance(value, OutOfRange)


def with_hint(allowed: str, value: Any) -> str:
    """The words `allowed`, with a hint if `value` is a number out of range, or one with what is no part of it.

    That is a separator or a unit, quotes, or a comment without a space before it.
    """
    if _is_out_of_range(value):
        return f"beyond the range of floating-point numbers: {allowed}"
    if isinstance(value, str) and _BARE.fullmatch(value):
        return f"{allowed}; numbers are written without quotes"
    if isinstance(value, str) and _SEPARATED.fullmatch(value):
        return f"{allowed}; numbers have a decimal point and no thousands separators"
    if isinstance(value, str) and _COMMENTED.fullmatch(value):
        return f"{allowed}; a comment has a space before its #"
    if isinstance(value, str) and _WITH_UNIT.fullmatch(value) and not _RELATIVE.fullmatch(value):
        return f"{allowed}; {_UNITS}"
    return allowed


@dataclass(frozen=True)
class Real:
    """A finite number that passes `test`; with `fractions` also one written as `1/6`."""

    allowed: str
    test: Callable[[float], bool]
    fractions: bool = False

    def __call__(self, value: Any) -> float:
        number = as_fraction(value) if self.fractions else as_number(value)
        if number is None or not self.test(number):
            raise refusal(with_hint(self.allowed, value))
        return number


def positive(words: str = "", *, below: float = math.inf) -> Real:
    """A number above 0 and below `below`; `words` are appended to the description."""
    bounds = "above 0" + (f" and below {below:g}" if below < math.inf else "")
    return Real(f"a number {bounds}{words}", lambda number: 0.0 < number < below)


def between(low: float, high: float, words: str = "", *, fractions: bool = False) -> Real:
    """A number from `low` to `high`, both included; `words` are appended to the description."""
    return Real(f"a number from {low:g} to {high:g}{words}", lambda number: low <= number <= high, fractions)


@dataclass(frozen=True)
class Whole:
    """A whole number from `low` to `high`."""

    low: int
    high: int

    @property
    def allowed(self) -> str:
        """What is allowed, in words."""
        return f"a whole number from {self.low} to {self.high}"

    def __call__(self, value: Any) -> int:
        if isinstance(value, bool) or not isinstance(value, int) or not self.low <= value <= self.high:
            raise refusal(with_hint(self.allowed, value))
        return value


@dataclass(frozen=True)
class Relative:
    """A :class:`Quantity` above 0: absolute, or in multiples of `scale` ("a" or "Es")."""

    allowed: str
    scale: str

    def __call__(self, value: Any) -> Quantity:
        quantity = as_quantity(value)
        if quantity is None or quantity.scale not in ("", self.scale) or not quantity.value > 0.0:
            raise refusal(with_hint(self.allowed, value))
        return quantity


@dataclass(frozen=True)
class Words:
    """Text that passes `test`, of at most `longest` characters."""

    allowed: str
    test: Callable[[str], bool]
    longest: int

    def __call__(self, value: Any) -> str:
        if as_number(value) is not None:
            raise refusal(f"{self.allowed}; a number in quotes")
        if not isinstance(value, str) or len(value) > self.longest or not self.test(value):
            raise refusal(self.allowed)
        return value


@dataclass(frozen=True)
class Passing:
    """Any value that passes `test`, unchanged."""

    allowed: str
    test: Callable[[Any], bool]

    def __call__(self, value: Any) -> Any:
        if not self.test(value):
            raise refusal(self.allowed)
        return value
