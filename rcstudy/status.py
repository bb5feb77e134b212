"""Progress of a sweep: solved, failed and missing cases from the files on disk, also while the sweep runs."""

from __future__ import annotations

import contextlib
import os
from collections import Counter
from pathlib import Path

from rcstudy.cases import Case, expand
from rcstudy.errors import UserError
from rcstudy.progress import counted, in_bytes
from rcstudy.result import Status
from rcstudy.storage.earlier import other_study
from rcstudy.storage.index import Index
from rcstudy.storage.lock import holders
from rcstudy.storage.publish import temporary_files
from rcstudy.storage.units import BadUnit, paths_set_aside, read_unit, unit_paths
from rcstudy.store import refusal, starts_over, take_cube, units_folder
from rcstudy.study import Study
from rcstudy.sweep import keep_of

_TRIES = 5
_WORDS = ("cases", "solved", "failed", "missing")
_TOTAL = "all grids"  # no grid can have a space in its name


def report(study: Study, output: Path) -> str:
    """Report as text: a table of the study's grids, the places of the results, and the sweeps at work. Read-only."""
    cases = expand(study).cases
    folder = units_folder(output)
    notes: list[str] = []
    index = Index(cases, keep_of(study.outputs))
    try:
        size, count, damaged = _take_units(index, folder)  # first: a sweep removes them once its cube is there
        unreadable, ignored = "", starts_over(folder, study.name)
        if not ignored:
            try:
                take_cube(index, output, study.name, notes.append)
            except UserError as error:
                unreadable = str(error)
        notes += damaged
        if refused := refusal(output) or unreadable:
            notes.append(f"a sweep will be refused: {refused}")
        rows = _rows([grid.name for grid in study.grids], cases, index)
        in_cube = sum(index.in_cube(case.key) for case in cases)
    finally:
        index.close()
    lines = [f"study {study.name}, cube {output}" + ("" if output.exists() else " (not there yet)"), "", *_table(rows)]
    if in_cube:
        lines += ["", f"{in_cube} of them are in the cube"]
    elif not (unreadable or ignored) and (name := other_study(output, study.name)) is not None:
        lines += ["", f"the cube is of another study, {name}: a sweep will not overwrite it"]
    if count:
        lines += ["", f"{in_bytes(size)} in {counted(count, 'unit')} in {folder}"]
    with contextlib.suppress(FileNotFoundError):  # removed by a sweep that starts over
        if aside := paths_set_aside(folder):
            size = sum(path.stat().st_size for path in aside)
            lines += ["", f"{in_bytes(size)} in {counted(len(aside), 'unit')} set aside, which sweep --fresh removes"]
    lines += ["", *notes] if notes else []
    temporary = _temporary_files(output, folder)  # first: a sweep that starts after the look at locks has new ones
    at_work = holders(folder)
    lines += ["", "at work: " + ", ".join(at_work) if at_work else "no sweep is at work"]
    if not at_work:
        lines += _left_over(temporary)
    return "\n".join(lines)


def _temporary_files(output: Path, folder: Path) -> list[Path]:
    """Temporary files of the cube and of its units."""
    real = Path(os.path.realpath(output))
    return temporary_files(real.parent, real.name) + temporary_files(folder)


def _left_over(files: list[Path]) -> list[str]:
    """Lines about those of `files` that are still there, now that no sweep is at work."""
    lines = []
    for path in files:
        with contextlib.suppress(FileNotFoundError):  # published or removed at a sweep's end
            lines.append(f"{in_bytes(path.stat().st_size)} left over by a sweep that was killed: {path}")
    return lines


def _take_units(index: Index, folder: Path) -> tuple[int, int, list[str]]:
    """Enter all units in `index`; returns bytes and number of the undamaged ones, and notes about the others.

    A running sweep may merge and remove units meanwhile; then all are read again. One that stays listed and cannot be
    found, as a link to nothing, is passed over, as by a sweep.
    """
    for tried in range(_TRIES):
        last = tried == _TRIES - 1
        size = count = 0
        damaged = []
        for path in unit_paths(folder):
            try:
                unit, data = read_unit(path)
                index.take_unit(unit, data)
            except BadUnit as error:
                damaged.append(f"{path}: {error}; a sweep will set it aside")
            except FileNotFoundError:
                if not last:
                    break
            else:
                size, count = size + unit.size, count + 1
        else:
            break
    return size, count, damaged


def _rows(names: list[str], cases: tuple[Case, ...], index: Index) -> list[tuple[str, int, int, int, int]]:
    """Numbers of all, solved, failed and missing cases of each grid and, if there are several, their total."""
    counts: dict[str, Counter[str]] = {name: Counter() for name in names}
    for case in cases:
        status = index.status(case.key)
        word = "missing" if status is None else "solved" if status == Status.SOLVED else "failed"
        counts[case.grid].update(("cases", word))
    found = list(counts.items())
    if len(names) > 1:
        found.append(("total" if "total" not in names else _TOTAL, sum(counts.values(), Counter())))
    return [(name, *(count[word] for word in _WORDS)) for name, count in found]  # type: ignore[misc]


def _table(rows: list[tuple[str, int, int, int, int]]) -> list[str]:
    width = max(len("grid"), *(len(row[0]) for row in rows))
    lines = [f"{'grid':{width}}" + "".join(f"{word:>10}" for word in _WORDS)]
    return lines + [f"{name:{width}}" + "".join(f"{number:10d}" for number in numbers) for name, *numbers in rows]
