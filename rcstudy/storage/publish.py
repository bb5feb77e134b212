"""Crash-safe writing: a file appears under its name whole, or not at all.

A process killed while an HDF5 file is open leaves a file that may open and be silently wrong, so nothing is ever
written under a final name. It is written beside it, closed, forced to the disk, and renamed.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import re
import socket
import stat
import threading
from collections.abc import Iterable, Iterator
from pathlib import Path

from rcstudy.errors import UserError

_MARK = ".tmp-"
_LONGEST_NAME = 255  # bytes of a file's name
_active: set[Path] = set()
_lock = threading.Lock()


@contextlib.contextmanager
def replacing(path: Path | str) -> Iterator[Path]:
    """Give a temporary path to write to; on leaving without an error it becomes `path`, atomically and durably.

    The file must be closed when the block ends. On an error or an interrupt the temporary file is removed and
    whatever was at `path` stays as it was. Leftovers of writers that were killed are removed first.

    Raises UserError when the folder cannot be written to or the disk is full.
    """
    target = Path(os.path.realpath(path))  # a symbolic link is kept, and the file that it points to is replaced
    if target.is_dir():
        raise UserError(f"{path}: is a folder, not a file")
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        remove_leftovers(target.parent, target.name)
        with _published(target) as temporary:
            yield temporary
    except OSError as error:
        raise UserError(f"{path}: cannot be written: {error.strerror or error}") from error


def make_folder(path: Path) -> None:
    """Make the folder `path` for what is to be written, with those it is in, if need be; UserError if it cannot be.

    Of a symbolic link the folder that it points to is made, as for files in it.
    """
    try:
        Path(os.path.realpath(path)).mkdir(parents=True, exist_ok=True)
    except FileExistsError:
        raise UserError(f"{path}: is a file, not a folder") from None
    except OSError as error:
        raise UserError(f"{path}: cannot be made: {error.strerror or error}") from error


def make_durably(folder: Path) -> None:
    """Make `folder`, with those it is in, and force their entries to the disk; nothing if it is there.

    Raises OSError when that fails.
    """
    missing = [path for path in (folder, *folder.parents) if not path.exists()]
    folder.mkdir(parents=True, exist_ok=True)
    for path in missing:
        with contextlib.suppress(PermissionError):  # one that may be written to but not read
            sync(path.parent)


def write_whole(path: Path, parts: Iterable[bytes]) -> None:
    """Write a new file `path` of these bytes, atomically and durably; its folder must be there.

    Raises OSError when that fails; nothing of the file is left then.
    """
    with _published(path) as temporary, temporary.open("wb") as file:
        file.writelines(parts)


@contextlib.contextmanager
def _published(target: Path) -> Iterator[Path]:
    """Give a temporary path beside `target`: a file written and closed there becomes `target` on leaving, or is gone.

    Raises OSError when that fails.
    """
    mark = f"{_MARK}{host()}-{os.getpid()}-{threading.get_ident():x}"
    temporary = target.with_name(_shortened(target.name, len(mark)) + mark)
    with _lock:
        _active.add(temporary)
    try:
        yield temporary
        with contextlib.suppress(OSError):  # who may read what is replaced may read what replaces it, and nobody else
            temporary.chmod(stat.S_IMODE(target.stat().st_mode))
        sync(temporary)
        temporary.replace(target)
        sync(target.parent)
    finally:
        with contextlib.suppress(OSError):
            temporary.unlink(missing_ok=True)
        with _lock:
            _active.discard(temporary)


def _shortened(name: str, more: int) -> str:
    """`name`, or as much of it, with its hash, as leaves room for `more` bytes in the name of a file."""
    data, room = os.fsencode(name), _LONGEST_NAME - more
    if len(data) <= room:
        return name
    digest = hashlib.sha256(data).hexdigest()[:16]
    return os.fsdecode(data[: room - len(digest)]) + digest


def remove_leftovers(folder: Path, name: str = "", *, alone: bool = False) -> list[Path]:
    """Remove temporary files of `name` (of all files if empty) in `folder` whose writers no longer run on this machine.

    Those of writers in other containers stay, as it is not known whether they run; but `alone` says that no process
    but this one can be writing any of these files. Returns what was removed.
    """
    removed = []
    for candidate, writer, pid in _temporary_files(folder, name):
        with _lock:
            ours = candidate in _active
        if not ours and (alone or (writer == host() and not _runs(pid))):
            with contextlib.suppress(OSError):  # somebody else's, perhaps: nothing depends on its removal
                candidate.unlink(missing_ok=True)
                removed.append(candidate)
    return removed


def temporary_files(folder: Path, name: str = "") -> list[Path]:
    """Temporary files of `name` (of all files if empty) in `folder`, of whatever writer; none if it cannot be read."""
    try:
        return sorted(path for path, _, _ in _temporary_files(folder, name))
    except OSError:
        return []


def _temporary_files(folder: Path, name: str) -> Iterator[tuple[Path, str, int]]:
    """Temporary files of `name` (of all files if empty) in `folder`, with the host and the number of their writers."""
    pattern = re.compile(r"(?P<name>.+)" + re.escape(_MARK) + r"(?P<host>.+)-(?P<pid>\d+)-[0-9a-f]+")
    for path in folder.iterdir():
        match = pattern.fullmatch(path.name)
        if match is None or (name and match["name"] != _shortened(name, len(path.name) - len(match["name"]))):
            continue
        yield path, match["host"], int(match["pid"])


def host() -> str:
    """Name of this machine, fit for the name of a file, and the namespace in which numbers of processes mean anything.

    Containers may share a machine's name, but do not see one another's processes.
    """
    name = re.sub(r"[^\w.]", "_", socket.gethostname(), flags=re.ASCII)[:64] or "localhost"
    space = namespace()
    return f"{name}-{space}" if space else name


def namespace() -> str:
    """Number of the namespace of this process's number; "" where it is not known."""
    try:
        return re.sub(r"\D", "", str(Path("/proc/self/ns/pid").readlink()))
    except OSError:
        return ""


def _runs(pid: int) -> bool:
    """Whether another process `pid` runs here; when that cannot be known, it is taken to run."""
    if pid == os.getpid():
        return False  # not among the active ones: an earlier process had the same number
    try:
        os.kill(pid, 0)
    except (ProcessLookupError, OverflowError):  # or no number that a process can have
        return False
    except OSError:
        return True
    return True


def sync(path: Path) -> None:
    """Force a file's content, or a folder's entries, to the disk."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
