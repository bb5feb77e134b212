"""Tolerances of a comparison, by variable and by case; from a file or options.

A file of tolerances::

    default: 1.0e-6            # of the scale of a field or number in its case
    variables: {traction_x: 1.0e-5, moment_z: 1.0e-4}
    state_flips: 2             # cells per case that may stick in one cube and slip in the other
    state_bound: 1.0e-6        # how near mu p, relatively, the traction of such a cell must be where it sticks
    cases:                     # where several entries match a case, the last one wins
      - match: figure_5/*creepage=e        # a grid and the label of a case, * and ? as in file names
        variables: {traction_x: 1.0e-4}
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Annotated

from pydantic import BeforeValidator, Field, PlainValidator

from rcstudy.errors import UserError
from rcstudy.result import VARIABLES
from rcstudy.studyfile.quantities import Passing, Whole, Words, between
from rcstudy.studyfile.spec import Spec, validate
from rcstudy.studyfile.yamlfile import parse, read_text
from rcstudy.studyfile.yamltree import Problems, find, suggest

_Rtol = Annotated[float, PlainValidator(between(0, 1))]
_FLIPS = Whole(0, 1000)
_Flips = Annotated[int, PlainValidator(_FLIPS)]
_Pattern = Annotated[
    str, PlainValidator(Words("a pattern of grid/label, such as 'figure_5/*'", lambda v: bool(v.strip()), 500))
]


_Named = Annotated[
    dict[str, _Rtol],
    BeforeValidator(
        Passing("a mapping of names of variables to numbers from 0 to 1", lambda value: isinstance(value, dict))
    ),
]
_OWN_WORK = "status", "state", "iterations_", "residual_", "proof_", "products_", "operator_products", "coarse_products"
TOLERABLE = tuple(
    name
    for name, variable in VARIABLES.items()
    if not (variable.kind == "text" or variable.timing or name.startswith(_OWN_WORK) or name.endswith("_error"))
)
"""The fields and numbers that are compared within a tolerance; of solver diagnostics only whether they are there."""


class Rule(Spec):
    """An entry of `cases:`: tolerances of the cases whose ``grid/label`` matches; None: not set by this entry."""

    match: _Pattern
    default: _Rtol | None = None
    variables: _Named = Field(default_factory=dict)
    state_flips: _Flips | None = None
    state_bound: _Rtol | None = None

    def matches(self, case: str) -> bool:
        """Whether `case`, as ``grid/label``, matches; brackets stand for themselves, as labels have some."""
        return fnmatchcase(case, self.match.replace("[", "[[]"))


class Tolerances(Spec):
    """The whole file: `default`, and `variables` by name; each is overridden by the same key of the `cases` that match.

    The default of a case therefore holds for variables that have no tolerance of their own in `variables` either.
    """

    default: _Rtol = 1e-6
    variables: _Named = Field(default_factory=dict)
    state_flips: _Flips = 2
    state_bound: _Rtol = 1e-6
    cases: Annotated[
        list[Rule],
        BeforeValidator(
            Passing("a list of mappings with match and any of the other keys", lambda value: isinstance(value, list))
        ),
    ] = Field(default_factory=list)

    def of_case(self, grid: str, label: str) -> Tolerances:
        """Tolerances of one case, without rules."""
        found = self.model_copy(update={"cases": []})
        for rule in self.cases:
            if rule.matches(f"{grid}/{label}"):
                given = rule.model_dump(exclude={"match"}, exclude_none=True)
                found = found.model_copy(update=given | {"variables": found.variables | rule.variables})
        return found

    def rtol(self, variable: str) -> float:
        """Relative tolerance of a variable."""
        return self.variables.get(variable, self.default)

    def with_options(self, variables: Mapping[str, float], state_flips: int | None = None) -> Tolerances:
        """These tolerances, with those of some variables (and `state_flips`) replaced, in the rules too."""
        flips = {} if state_flips is None else {"state_flips": state_flips}
        as_elsewhere = dict.fromkeys(flips)
        cases = [
            rule.model_copy(update={"variables": {**rule.variables, **variables}, **as_elsewhere})
            for rule in self.cases
        ]
        return self.model_copy(update={"variables": {**self.variables, **variables}, "cases": cases, **flips})

    def unmatched(self, cases: Collection[str]) -> list[str]:
        """The patterns that match none of `cases`, each ``grid/label``."""
        return [rule.match for rule in self.cases if not any(map(rule.matches, cases))]

    def named(self) -> set[str]:
        """All variables that a tolerance is given for."""
        return set(self.variables).union(*(rule.variables for rule in self.cases))


def load_tolerances(path: Path | str) -> Tolerances:
    """Read a file of tolerances; UserError says where and what is wrong."""
    problems = Problems(str(path))
    root = parse(read_text(path), problems, "a mapping of tolerances, {} for the default")
    found = validate(Tolerances, root, problems)
    rules = find(root, ("cases",)).value if root.is_mapping else []
    for node in (root, *(rules if isinstance(rules, list) else ())):
        named = find(node, ("variables",))
        for name, value in named.value.items() if named is not node and named.is_mapping else ():
            if name not in TOLERABLE:
                problems.add(value.at_key(), suggest(name, TOLERABLE), value="no variable with a tolerance")
    problems.check()
    assert found is not None  # or there are problems
    return found


def _plain(text: str) -> str:
    """The `text` of a number; ValueError if it has what Python alone takes: digits of other scripts, underscores."""
    if not text.isascii() or "_" in text:
        raise ValueError(text)
    return text


def parse_option(text: str) -> tuple[str, float]:
    """A variable and its tolerance from ``VARIABLE=VALUE``; UserError otherwise."""
    name, equals, value = text.partition("=")
    try:
        number = float(_plain(value))
    except ValueError:
        number = -1.0
    if not equals or not name.strip() or not 0.0 <= number <= 1.0:
        raise UserError(f"--rtol: {text}: VARIABLE=VALUE with a number from 0 to 1")
    return name.strip(), number


def parse_options(texts: Iterable[str]) -> dict[str, float]:
    """Tolerances by variable from some options; UserError where one is wrong, or of a variable that has one already."""
    found: dict[str, float] = {}
    for text in texts:
        name, value = parse_option(text)
        if name in found:
            raise UserError(f"--rtol: {text}: {name} has a tolerance already, {found[name]:g}: one is allowed")
        found[name] = value
    return found


def parse_flips(text: str) -> int:
    """The number of cells per case that an option allows to differ, bounded as in a file; UserError otherwise."""
    try:
        return _FLIPS(int(_plain(text)))
    except ValueError:
        raise UserError(f"--state-flips: {text[:40]}: {_FLIPS.allowed}") from None
