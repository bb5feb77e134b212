"""What a comparison lets pass, by variable and by case; from a file or options.

A file of tolerances::

    default: 1.0e-6            # of the scale of a field (in its case) or scalar (in its grid)
    variables: {traction_x: 1.0e-5, moment_z: 1.0e-4}
    state_flips: 2             # cells a case that may stick in one cube and slip in the other
    state_bound: 1.0e-6        # how near mu p, relatively, the traction of such a cell must be where it sticks
    cases:                     # where several entries match a case, the later one holds
      - match: figure_5/*creepage=e        # a grid and the label of a case, * and ? as in file names
        variables: {traction_x: 1.0e-4}
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field, PlainValidator

from rcstudy.errors import UserError
from rcstudy.quantities import Real, Whole, Words, refusal
from rcstudy.spec import Spec, validate
from rcstudy.yamltree import Problems, parse, read_text

DEFAULT_RTOL = 1e-6
DEFAULT_FLIPS = 2
DEFAULT_BOUND = 1e-6


@dataclass(frozen=True)
class Rule:
    """Tolerances of the cases whose ``grid/label`` matches `pattern`; None: as elsewhere."""

    pattern: str
    default: float | None = None
    variables: Mapping[str, float] = field(default_factory=dict)
    state_flips: int | None = None
    state_bound: float | None = None

    def matches(self, grid: str, label: str) -> bool:
        """Whether the rule is for this case."""
        return fnmatchcase(f"{grid}/{label}", self.pattern)


@dataclass(frozen=True)
class Tolerances:
    """Relative tolerances: `default`, `variables` by name, both overridden by the `rules` that match a case."""

    default: float = DEFAULT_RTOL
    variables: Mapping[str, float] = field(default_factory=dict)
    state_flips: int = DEFAULT_FLIPS
    state_bound: float = DEFAULT_BOUND
    rules: tuple[Rule, ...] = ()

    def of_case(self, grid: str, label: str) -> Tolerances:
        """Tolerances of one case, without rules."""
        found = Tolerances(self.default, dict(self.variables), self.state_flips, self.state_bound)
        for rule in self.rules:
            if not rule.matches(grid, label):
                continue
            found = Tolerances(
                found.default if rule.default is None else rule.default,
                {**found.variables, **rule.variables},
                found.state_flips if rule.state_flips is None else rule.state_flips,
                found.state_bound if rule.state_bound is None else rule.state_bound,
            )
        return found

    def rtol(self, variable: str) -> float:
        """Relative tolerance of a variable."""
        return self.variables.get(variable, self.default)

    def with_options(self, variables: Mapping[str, float], state_flips: int | None = None) -> Tolerances:
        """These tolerances, with those of some variables (and the cells let pass) replaced, in the rules too."""
        rules = tuple(
            replace(
                rule,
                variables={**rule.variables, **variables},
                state_flips=rule.state_flips if state_flips is None else None,
            )
            for rule in self.rules
        )
        return replace(
            self,
            variables={**self.variables, **variables},
            state_flips=self.state_flips if state_flips is None else state_flips,
            rules=rules,
        )

    def named(self) -> set[str]:
        """All variables that a tolerance is given for."""
        return set(self.variables).union(*(rule.variables for rule in self.rules))


_Rtol = Annotated[float, PlainValidator(Real("a number from 0 to 1", lambda v: 0.0 <= v <= 1.0))]
_Flips = Annotated[int, PlainValidator(Whole("a whole number from 0 to 1000", 0, 1000))]
_Pattern = Annotated[
    str, PlainValidator(Words("a pattern of grid/label, such as 'figure_5/*'", lambda v: bool(v.strip()), 500))
]


class _Variables:
    """A mapping of variables to tolerances."""

    allowed = "a mapping of names of variables to numbers from 0 to 1"

    def __call__(self, value: Any) -> dict[str, float]:
        if not isinstance(value, dict):
            raise refusal(self.allowed)
        real = Real(self.allowed, lambda v: 0.0 <= v <= 1.0)
        return {str(name): real(number) for name, number in value.items()}


_Named = Annotated[dict[str, float], PlainValidator(_Variables())]


class RuleSpec(Spec):
    """An entry of `cases:`."""

    match: _Pattern
    default: _Rtol | None = None
    variables: _Named = Field(default_factory=dict)
    state_flips: _Flips | None = None
    state_bound: _Rtol | None = None


class TolerancesSpec(Spec):
    """The whole file."""

    default: _Rtol = DEFAULT_RTOL
    variables: _Named = Field(default_factory=dict)
    state_flips: _Flips = DEFAULT_FLIPS
    state_bound: _Rtol = DEFAULT_BOUND
    cases: list[RuleSpec] = Field(default_factory=list)


def load_tolerances(path: Path | str) -> Tolerances:
    """Read a file of tolerances; UserError says where and what is wrong."""
    problems = Problems(str(path))
    spec = validate(TolerancesSpec, parse(read_text(path), problems), problems)
    problems.check()
    if spec is None:
        raise AssertionError("unreachable: a file without model has problems")
    rules = tuple(Rule(r.match, r.default, r.variables, r.state_flips, r.state_bound) for r in spec.cases)
    return Tolerances(spec.default, spec.variables, spec.state_flips, spec.state_bound, rules)


def parse_option(text: str) -> tuple[str, float]:
    """A variable and its tolerance from ``VARIABLE=VALUE``; UserError otherwise."""
    name, equals, value = text.partition("=")
    try:
        number = float(value)
    except ValueError:
        number = -1.0
    if not equals or not name.strip() or not 0.0 <= number <= 1.0:
        raise UserError(f"--rtol: {text}: VARIABLE=VALUE with a number from 0 to 1")
    return name.strip(), number
