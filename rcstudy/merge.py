"""One cube from the units that several shards of a sweep have left; nothing is solved."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from pathlib import Path

from rcstudy import provenance
from rcstudy.assemble import Assembly
from rcstudy.cases import expand
from rcstudy.errors import UserError, cannot_be_read
from rcstudy.progress import counted
from rcstudy.storage.index import Index
from rcstudy.storage.layout import case_label
from rcstudy.storage.record import DamagedRecord, parse
from rcstudy.storage.units import BadUnit, Unit, read_unit, unit_paths
from rcstudy.store import opened, units_folder
from rcstudy.study import Study
from rcstudy.sweep import Summary, failures, keep_of

_SHOWN = 5


def merge(
    study: Study,
    output: Path,
    folders: Sequence[Path] = (),
    *,
    tell: Callable[[str], None] = lambda text: None,
    take_over: bool = False,
) -> Summary:
    """Write the cube `output` of `study` from the units beside it and those in `folders`, which stay as they are.

    Cases of an earlier cube at `output` count as well. Raises UserError, before anything is written, when cases are
    missing, when `folders` hold units that are damaged or of another study, or when two results of a case differ; and
    when another process is at work on the output.
    """
    started = time.monotonic()
    expansion = expand(study)
    with opened(output, study.name, expansion.cases, keep_of(study.outputs), tell=tell, take_over=take_over) as store:
        if damaged := store.index.check_cube():  # first: results in units are compared with these
            tell(f"{output}: {counted(damaged, 'case')} not taken from it: damaged")
        for path in unit_paths(store.folder):
            _check_duplicates(store.index, *_read(path))
        for folder in folders:
            _take_folder(store.index, folder)
        missing = [case for case in expansion.cases if store.index.status(case.key) is None]
        if missing:
            grids = {grid.name: grid for grid in expansion.grids}
            names = [f"{case.grid}: {case_label(grids[case.grid], case.index)}" for case in missing[:_SHOWN]]
            more = f"\n  and {len(missing) - _SHOWN} more" if len(missing) > _SHOWN else ""
            raise UserError(
                f"{output}: {len(missing)} of {len(expansion.cases)} cases are missing; rcstudy sweep solves them:\n  "
                + "\n  ".join(names)
                + more
            )
        store.tell_losses(output, tell)
        with Assembly(output, study, expansion, store) as cube:
            cube.finish(provenance.collect(), started)
        failed = failures(expansion, expansion.cases, store.index)
        store.clear()
    count = len(expansion.cases)
    return Summary(output, count, time.monotonic() - started, failed, kept=count - len(failed))


def _take_folder(index: Index, folder: Path) -> None:
    """Note all units of a folder, or of the folder that belongs to a cube of that name."""
    found = unit_paths(folder) or unit_paths(units_folder(folder))
    if not found and not folder.exists():
        raise UserError(f"{folder}: does not exist, nor does {folder}.units")
    if not found:
        raise UserError(f"{folder}: no units in it")
    for path in found:
        unit, data = _read(path)
        _check_duplicates(index, unit, data)
        try:
            foreign = index.take_unit(unit, data, thoroughly=True)
        except BadUnit as error:
            raise UserError(f"{path}: {error}") from error
        if foreign:
            raise UserError(f"{path}: {foreign} of its {len(unit.entries)} cases are not of this study")


def _read(path: Path) -> tuple[Unit, bytes]:
    try:
        return read_unit(path)
    except BadUnit as error:
        raise UserError(f"{path}: {error}") from error
    except OSError as error:
        raise cannot_be_read(path, error) from error


def _check_duplicates(index: Index, unit: Unit, data: bytes) -> None:
    """UserError when a case of the unit is solved elsewhere as well, with other numbers."""
    for key, offset, length in unit.entries:
        if index.is_at(key, unit.path, offset) or index.status(key) is None:
            continue
        try:
            here, there = parse(data[offset : offset + length], unit.form), index.record(key)
            differ = here.contradicts(there)
        except DamagedRecord as error:
            raise UserError(f"{unit.path}: case {key[:12]}: {error}") from error
        if differ:
            raise UserError(
                f"{unit.path}: case {key[:12]} has another result in {index.where(key)} ({differ} differs): "
                "remove one of them"
            )
