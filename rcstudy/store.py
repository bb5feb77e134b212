"""The store: a folder beside a cube that keeps results as they are solved, until the cube is published from them.

The folder of `paper.nc` is `paper.nc.units`. It holds units, files of results (:mod:`rcstudy.storage.units`). A unit is
written as soon as results for a thousand cases or some megabytes are pending, and at the latest after five seconds
(sooner for the first units). Small units are merged now and then, so that slow studies do not end with one file per
case. Once the cube is written, the units are removed, and later runs take the solved cases from the cube.
"""

from __future__ import annotations

import contextlib
import errno
import os
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from rcstudy.errors import UserError, cannot_be_read
from rcstudy.progress import counted
from rcstudy.result import Status
from rcstudy.storage.earlier import EarlierCube, is_replaced, refuse_foreign, refuse_other_study, state_of
from rcstudy.storage.index import Index
from rcstudy.storage.lock import locked, refuse_file
from rcstudy.storage.publish import remove_leftovers, sync, write_whole
from rcstudy.storage.record import Keep, Packed, Record, parse
from rcstudy.storage.steady import interrupts_held
from rcstudy.storage.units import (
    BadUnit,
    Unit,
    number_of,
    paths_set_aside,
    read_unit,
    set_aside,
    unit_paths,
    write_unit,
)

if TYPE_CHECKING:
    from rcstudy.cases import Case

UNIT_CASES = 1024
UNIT_BYTES = 8 * 2**20
UNIT_SECONDS = (0.5, 1.0, 2.0, 5.0)  # longest wait of results for the first unit, the second, the third, all others
_MOST_PENDING = 2  # most results in memory, in units
_PUT_TOGETHER = 8  # so many small units of one level are merged into one of the next
_FRESH = "fresh"
DISK_FULL = errno.ENOSPC, errno.EDQUOT

Tell = Callable[[str], None]


def units_folder(output: Path) -> Path:
    """The folder of the units of the cube `output`."""
    real = Path(os.path.realpath(output))
    return real.with_name(f"{real.name}.units")


class Store:
    """Takes results, writes them as units and finds them again; made by :func:`opened`.

    `checked`: state of what was where the cube goes (:func:`rcstudy.storage.earlier.state_of`) when it was looked at.
    """

    def __init__(self, folder: Path, index: Index, study: str, checked: tuple[int, ...]) -> None:
        self.folder = folder
        self.index = index
        self.checked = checked
        self._study = study
        self._expected: set[str] = set()
        self._pending: list[tuple[str, Packed]] = []
        self._held: dict[str, bytes] = {}  # records of the pending results, by key
        self._bytes = 0
        self._since = 0.0
        self._units = 0  # number written by this store, merged ones not counted
        self._number = max([0, *map(number_of, unit_paths(folder))])
        self._small: list[tuple[int, Unit, tuple[Status, ...]]] = []  # level, unit, statuses of its cases
        self._error: OSError | None = None
        self._lock = threading.Lock()  # guards the attributes of the store and the index
        self._writing = threading.Lock()  # held while a unit is written; acquired before `_lock`
        self._wake = threading.Event()
        self._closing = False
        self._writer = threading.Thread(target=self._write_in_time, name="rcstudy units", daemon=True)
        self._writer.start()

    def expect(self, keys: Iterable[str]) -> None:
        """Announce the cases that are to be solved: results that they have are not final, see :meth:`is_final`."""
        self._expected.update(keys)

    def is_final(self, key: str) -> bool:
        """Whether the result of a case is here to stay: the case is not, or no longer, to be solved."""
        return key not in self._expected

    def record(self, key: str) -> Record:
        """The record of a case: as in :meth:`Index.record`."""
        with self._lock:  # else its unit might be merged with others, and removed, meanwhile
            body = self._held.get(key)
            return self.index.record(key) if body is None else parse(body)

    def add(self, key: str, result: Packed) -> None:
        """Take a result; it reaches the disk within some seconds. Raises UserError when units cannot be written."""
        with self._lock:
            if not self._pending:
                self._since = time.monotonic()
            self._pending.append((key, result))
            self._bytes += len(result.body)
            self._held[key] = result.body
            self._expected.discard(key)
        if self._waiting >= _MOST_PENDING or self._error is not None:
            self._write(1.0)
        elif self._waiting >= 1.0:
            self._wake.set()

    @property
    def _waiting(self) -> float:
        """How many units the pending results would fill."""
        return max(len(self._pending) / UNIT_CASES, self._bytes / UNIT_BYTES)

    def flush(self) -> None:
        """Write all pending results, as many as fit on a full disk. Raises UserError if any stay, or failed earlier."""
        self._write(0.0)
        while self._pending:  # half of them, or less, may have been written
            self._write(0.0)

    def try_again(self) -> None:
        """Write all pending results after an error that may have passed. Raises UserError if it has not."""
        self._error = None
        self.flush()

    def _write(self, least: float) -> None:
        """Write all pending results, if they still fill `least` units once a write in progress has ended."""
        with self._writing:
            try:
                if self._error is not None:
                    raise self._error
                if self._waiting < least:
                    return
                with interrupts_held():  # else a written unit might not be recorded, and its cases be written again
                    self._write_pending()
                    self._merge_small()
            except OSError as error:
                self._error = error
                raise UserError(f"{self.folder}: cannot be written: {error.strerror or error}") from error

    def tell_losses(self, output: Path, tell: Tell) -> None:
        """Report existing results that the new cube `output` will not contain."""
        if lost := self.index.losses():
            tell(f"{output}: the new cube will not contain {lost}; to keep them, choose another --output")

    @property
    def is_empty(self) -> bool:
        """Whether there are no units."""
        return not unit_paths(self.folder)

    def clear(self) -> None:
        """Remove all units, and the mark of a fresh start: the cube holds everything now."""
        mark = self.folder / _FRESH
        if mark.exists():  # goes first, and from the disk too: from now on the cube counts again
            mark.unlink()
            sync(self.folder)
        for path in unit_paths(self.folder):
            path.unlink(missing_ok=True)

    def close(self) -> None:
        """Write the pending results, as far as that is possible, and stop."""
        self._closing = True
        self._wake.set()
        self._writer.join()
        with contextlib.suppress(UserError):
            self.flush()
        self.index.close()

    def _write_in_time(self) -> None:
        """Write results that fill a unit or have waited long enough; runs in a thread of its own, so nobody waits."""
        while not self._closing:
            seconds = UNIT_SECONDS[min(self._units, len(UNIT_SECONDS) - 1)]
            waits = bool(self._pending) and self._error is None
            self._wake.wait(max(self._since + seconds - time.monotonic(), 0.0) if waits else seconds)
            self._wake.clear()
            due = bool(self._pending) and time.monotonic() - self._since >= seconds
            if due or self._waiting >= 1.0:
                with contextlib.suppress(UserError):  # kept, and raised by the next `add` or `flush`
                    self._write(0.0 if due else 1.0)

    def _write_pending(self) -> None:
        with self._lock:
            taken, now = list(self._pending), time.monotonic()
        if not taken:
            return
        while True:
            cases = [(key, result.body) for key, result in taken]
            statuses = tuple(Status(result.status) for _, result in taken)
            try:
                unit = self._written(cases, statuses)
                break
            except OSError as error:  # if the disk is full, half of the results may still fit
                if error.errno not in DISK_FULL or len(taken) < 2:
                    raise
                taken = taken[: len(taken) // 2]
        with self._lock:
            for key, _ in cases:
                self._held.pop(key, None)
            del self._pending[: len(taken)]  # only these: more may have been added meanwhile
            self._bytes -= sum(len(body) for _, body in cases)
            self._since = now  # those that came while the unit was written have waited since then, or less
        self._units += 1
        self._small.append((0, unit, statuses))

    def _written(self, cases: Sequence[tuple[str, bytes]], statuses: tuple[Status, ...]) -> Unit:
        self._number += 1
        unit = write_unit(self.folder, self._number, cases, self._study)
        with self._lock:
            self.index.take_written(unit, statuses)
        return unit

    def _merge_small(self) -> None:
        """Merge the last units while they are small and of one level; they are removed once the whole is there."""
        while len(self._small) >= _PUT_TOGETHER:
            parts = self._small[-_PUT_TOGETHER:]
            entries = [entry for _, unit, _ in parts for entry in unit.entries]
            if len({level for level, _, _ in parts}) > 1:
                return
            if len(entries) > UNIT_CASES or sum(unit.size for _, unit, _ in parts) > UNIT_BYTES:
                return
            cases = []
            for _, unit, _ in parts:
                data = unit.path.read_bytes()
                cases += [(key, data[offset : offset + length]) for key, offset, length in unit.entries]
            statuses = tuple(status for _, _, some in parts for status in some)
            whole = self._written(cases, statuses)
            for _, unit, _ in parts:
                with contextlib.suppress(OSError):  # what stays is there twice, and goes when the cube is complete
                    unit.path.unlink(missing_ok=True)
            self._small[-_PUT_TOGETHER:] = [(parts[0][0] + 1, whole, statuses)]


@contextlib.contextmanager
def opened(
    output: Path,
    study: str,
    cases: Sequence[Case],
    keep: Keep,
    *,
    tell: Tell,
    fresh: bool = False,
    shard: tuple[int, int] | None = None,
    take_over: bool = False,
) -> Iterator[Store]:
    """The store of the cube `output`; its index has all results of `cases` of `study` that exist already.

    No other sweep can open it at the same time, except other shards if this is one. Damaged units, which are set aside
    (by a shard left where they are: another version of the solver may be writing them), and a folder that had to be
    made are reported to `tell`. `fresh`: existing results are ignored. `take_over`: so is a lock that another machine
    left.

    Raises UserError when the output cannot be written to, when it or units beside it are of a study of another name and
    have none of these cases, when these cannot be read, or when another process is at work on it.
    """
    folder = units_folder(output)
    with contextlib.ExitStack() as stack:
        index = Index(cases, keep)
        try:
            checked = state_of(output)
            refuse_foreign(output)
            new = not output.parent.exists()
            _refuse_unreadable(folder)
            alone = stack.enter_context(locked(folder, shard, take_over=take_over))
            if new:
                tell(f"{output.parent}: a new folder, which is made for the cube")
            remove_leftovers(folder, alone=alone)
            if alone:  # cubes that were not finished, which would take the room of units
                real = Path(os.path.realpath(output))
                remove_leftovers(real.parent, real.name, alone=True)
            broken_off = _mark(folder) == _removing(study)
            if broken_off and shard is not None:
                raise UserError(
                    f"{folder}: a sweep that started over was killed while it removed these units: sweep once more "
                    "with --fresh, or remove the folder"
                )
            if fresh or broken_off:
                _start_over(folder, study)
            stack.callback(index.close)
            if not starts_over(folder, study):
                take_cube(index, output, study, tell)
                if index.is_empty:
                    refuse_other_study(output, study)
            for path in unit_paths(folder):
                _take_unit(index, path, study, tell, leave=shard is not None)
            store = Store(folder, index, study, checked)
        except OSError as error:
            raise UserError(f"{output}: cannot be written: {error.strerror or error}") from error
        stack.callback(store.close)
        yield store


def refusal(output: Path) -> str:
    """What a sweep says of what stands where the cube `output` goes, or its units, if it refuses it; "" if not."""
    try:
        refuse_foreign(output)
        refuse_file(units_folder(output))
    except UserError as error:
        return str(error)
    except OSError as error:
        return str(cannot_be_read(output, error))
    return ""


def _refuse_unreadable(folder: Path) -> None:
    """Raise UserError if a folder of units is there and cannot be read: it is not the output that is at fault."""
    try:
        with contextlib.suppress(FileNotFoundError, NotADirectoryError):
            os.scandir(folder).close()
    except PermissionError as error:
        raise cannot_be_read(folder, error) from error


def starts_over(folder: Path, study: str) -> bool:
    """Whether a sweep of `study` that started over has not finished: an existing cube is then ignored by its sweeps."""
    return _mark(folder) in (study.encode(), _removing(study))


def _mark(folder: Path) -> bytes:
    """The mark of a fresh start; empty if there is none."""
    with contextlib.suppress(OSError):
        return (folder / _FRESH).read_bytes()
    return b""


def _removing(study: str) -> bytes:
    """The mark of a fresh start of `study` whose old units are not all removed yet."""
    return f"{study}\nunits are being removed".encode()


def take_cube(index: Index, output: Path, study: str, tell: Tell) -> None:
    """Note the cases of an earlier cube at `output`, if there is one; `tell` gets the reason if it is of no use.

    `study` is the name of the study whose cube is to be written there.
    """
    if not output.exists():
        return
    try:
        cube = EarlierCube(output)
        for scalars, count in index.take_cube(cube).items():
            why = f"they have no {', '.join(scalars)}" if scalars else _lack_of_fields(cube, index.keep)
            tell(f"{output}: {counted(count, 'solved case')} in it cannot be taken: {why}")
    except ValueError as error:
        fate = "; it will be replaced: to keep it, choose another --output" if is_replaced(output, study) else ""
        tell(f"{output}: no cases are taken from it: {error}{fate}")


def _lack_of_fields(cube: EarlierCube, wanted: Keep) -> str:
    """Why solved cases of a cube cannot be taken, whose fields are not those `wanted`."""
    bare = any(not grid.keep.covers(wanted) and not grid.keep.fields for grid in cube.grids)
    lack = "it has none" if bare else "it has them in float32"
    return f"outputs asks for fields in {wanted.precision}, and {lack}"


def _take_unit(index: Index, path: Path, study: str, tell: Tell, *, leave: bool) -> None:
    """Note the results in a unit. Bad ones are set aside, or left to others at work on them with `leave`."""
    try:
        unit, data = read_unit(path)
        if index.take_unit(unit, data) == len(unit.entries) and unit.study != study:
            raise UserError(
                f"{path}: holds results of another study, {unit.study}, which would be deleted: choose another "
                f"--output, finish that study, or remove {path.parent} (rcstudy sweep --fresh deletes them)"
            )
    except FileNotFoundError:
        return  # another shard has merged it with others
    except OSError as error:
        raise cannot_be_read(path, error) from error
    except BadUnit as error:
        fate = "left where it is, as other shards may use it" if leave else f"set aside as {set_aside(path).name}"
        tell(f"{path}: {error}; {fate}, its cases have to be solved again")


def _start_over(folder: Path, study: str) -> None:
    """Leave a mark that the cube is ignored, then remove all units: in this order, lest a crash in between undo it.

    Those that were set aside go as well. Until all are gone, also from the disk, the mark says so, and whoever opens
    the store next removes the rest.
    """
    write_whole(folder / _FRESH, [_removing(study)])
    for path in unit_paths(folder) + paths_set_aside(folder):
        path.unlink()
    sync(folder)
    write_whole(folder / _FRESH, [study.encode()])
