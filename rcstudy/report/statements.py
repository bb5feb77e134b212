"""Judging what the paper says of its results by the cube's own numbers: comparisons, verdicts, their tables.

A :class:`Statement` quotes the paper, says in words how it is judged, and yields :class:`Comparison` s; the
verdict counts those that hold. A comparison decides nothing, and is counted apart, if a case of it was not
solved, if both its cases slip everywhere (then no ratio of slip can grow), or if discretisation errors are larger.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

from rcstudy.report.cells import Column, Table, Value
from rcstudy.report.listed import listed_settings, shared_settings
from rcstudy.report.measures import CELLS
from rcstudy.report.paper import PaperCase, words


@dataclass(frozen=True)
class Comparison:
    """Two numbers and whether they stand as the paper says; `holds` is None where they decide nothing.

    `bound`: the right number is a bound on the left one, not the value of another case. `by`: the factor of the left
    number that the right one has to exceed, or to stay below. `cases`: those that `what` describes, where it does.
    """

    what: str
    left: float
    right: float
    holds: bool | None
    undecided: str = ""
    bound: bool = False
    by: float = 1.0
    cases: tuple[PaperCase, ...] = ()


def _nothing(cases: Sequence[PaperCase]) -> Iterable[Comparison]:
    return ()


@dataclass(frozen=True)
class Statement:
    """A sentence of the paper: `where` it stands, `quote` word for word, how it is judged.

    `criterion` says in words what `judge` compares. `instead`, if given, judges a rival reading of the statement, which
    `instead_of` names; its verdict goes into the remark. `untestable` says why no cube can decide the statement.
    """

    where: str
    quote: str
    criterion: str
    judge: Callable[[Sequence[PaperCase]], Iterable[Comparison]] = _nothing
    instead: Callable[[Sequence[PaperCase]], Iterable[Comparison]] = _nothing
    instead_of: str = ""
    note: str = ""
    untestable: str = ""


def verdict(comparisons: Sequence[Comparison]) -> str:
    """`borne out in k of n cases`, or plain words for all and none, and how many comparisons decided nothing."""
    if not comparisons:
        return "no such cases in the cube"
    decided = [c for c in comparisons if c.holds is not None]
    held, n = sum(bool(c.holds) for c in decided), len(decided)
    left = len(comparisons) - n
    if not n:
        return f"undecided ({left} of {left})"
    if held == n:
        text = f"borne out ({n} of {n})"
    elif not held:
        text = f"not borne out (0 of {n})"
    else:
        text = f"borne out in {held} of {n} cases"
    return f"{text}; {left} undecided" if left else text


def numbers(comparisons: Sequence[Comparison]) -> str:
    """The decided numbers in short: all of them up to three, else the range of their changes, ratios or values.

    Ratios, however few they are, where numbers are compared by a factor: they say by how much it is exceeded.
    """
    decided = [c for c in comparisons if c.holds is not None]
    if not decided:
        return ""
    if decided[0].bound:
        values = [c.left for c in decided]
        if len(values) <= 3:
            return ", ".join(f"{v:.3g}" for v in values)
        return f"{min(values):.3g} to {max(values):.3g}"
    if any(c.by != 1.0 for c in decided):
        ratios = [c.right / c.left for c in decided if c.left]
        ends = dict.fromkeys(f"{end:.3g}" for end in (min(ratios), max(ratios))) if ratios else ()
        return f"ratio {' to '.join(ends)}" if ends else ""
    if len(decided) <= 3:
        return "; ".join(f"{c.left:.3g} → {c.right:.3g}" for c in decided)
    changes = [c.right - c.left for c in decided]
    return f"changes from {min(changes):+.3g} to {max(changes):+.3g}"


def remark(statement: Statement, cases: Sequence[PaperCase], found: Iterable[Comparison]) -> str:
    """The statement's own note, what its rival reading would give, and why comparisons `found` decided nothing."""
    parts = [statement.note] if statement.note else []
    rival = list(statement.instead(cases))
    if rival:
        parts.append(f"{statement.instead_of}: {verdict(rival)}.")
    reasons = Counter(c.undecided for c in found if c.undecided)
    if reasons:
        parts.append(f"Undecided: {'; '.join(f'{reason} ({n})' for reason, n in reasons.items())}.")
    return " ".join(parts)


Judged = Sequence[tuple[Statement, Sequence[Comparison]]]
"""Statements, each with the comparisons that judge it."""


def judged(statements: Iterable[Statement], cases: Sequence[PaperCase]) -> Judged:
    """The statements, judged by these cases."""
    return [(statement, list(statement.judge(cases))) for statement in statements]


def statements_table(statements: Judged, cases: Sequence[PaperCase]) -> Table:
    """Caption, columns and rows: one row a statement, judged by these cases, with its verdict."""
    columns = (
        Column("number", "No."),
        Column("where", "Section", wide=0.07),
        Column("statement", "The paper says", wide=0.23),
        Column("criterion", "Judged by", wide=0.17),
        Column("numbers", "Numbers", wide=0.13),
        Column("verdict", "Verdict", wide=0.17),
        Column("remark", "Remark", wide=0.17),
    )
    rows: list[dict[str, Value]] = []
    for number, (statement, found) in enumerate(statements, 1):
        rows.append(
            {
                "number": number,
                "where": statement.where,
                "statement": statement.quote,
                "criterion": statement.criterion,
                "numbers": numbers(found),
                "verdict": f"not tested: {statement.untestable}" if statement.untestable else verdict(found),
                "remark": remark(statement, cases, found),
            }
        )
    without, counted = "", f" (slip ratios whose areas are counted in cells: by less than {CELLS:g} cells in each)"
    if any(c.view.rolling and not c.view.mapped for c in cases):
        without, counted = "stored without the fields that are compared, ", ""
    _, settings = listed_settings([c.view for c in cases])
    caption = (
        "The paper's statements about its results (quoted), and whether the results in this cube bear them out. "
        "Pairs are neighbouring values of the parameter named (of spin, at x < 0, any two); the numbers are those of "
        f"the criterion. Undecided are pairs with a case that was not solved, {without}with slip everywhere in both "
        "cases, or with numbers that differ by less than their estimated errors, which are in the table of results"
        f"{counted}. {shared_settings(settings)}"
    ).rstrip()
    return caption, columns, rows


def comparisons_table(statements: Judged) -> Table:
    """Caption, columns and rows: one row a comparison, with the number of its statement."""
    columns = (
        Column("number", "No."),
        Column("cases", "Cases", wide=0.35, math="cases_math"),
        Column("left", "Left"),
        Column("right", "Right or bound"),
        Column("holds", "Holds", wide=0.2),
    )
    rows: list[dict[str, Value]] = []
    for number, (_, found) in enumerate(statements, 1):
        for c in found:
            holds = f"undecided: {c.undecided}" if c.holds is None else ("yes" if c.holds else "no")
            in_math = r" $\to$ ".join(words(case, math=True) for case in c.cases)
            rows.append(
                {
                    "number": number,
                    "cases": c.what,
                    "cases_math": in_math,
                    "left": c.left,
                    "right": c.right,
                    "holds": holds,
                }
            )
    return "Every comparison behind the verdicts on the paper's statements.", columns, rows
