"""One sweep at a time on one output: a lock that the kernel frees when its owner dies, however it dies.

The lock is `flock` on a file, exclusive for a whole sweep, shared among the shards of one, each of which holds its own
file as well. The file also says who holds it, for people, and for two cases that `flock` alone does not settle: file
systems without it, and those on which it does not reach other machines. No clock times are compared: a process is
identified by its machine, the machine's start (boot id) and its own start counted from there.
"""

from __future__ import annotations

import contextlib
import errno
import fcntl
import itertools
import json
import os
import re
import socket
import stat
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

from rcstudy.errors import UserError
from rcstudy.storage.publish import make_durably, namespace

NAME = "lock"
_TRIES = 1000  # to open the lock in a folder that other processes make and remove meanwhile
_GLANCES = (0.02, 0.02, 0.05, 0.1)  # seconds between tries, should :func:`holders` be looking whether a lock is free
_ONE_MACHINE = ("btrfs", "ext2", "ext3", "ext4", "f2fs", "overlay", "ramfs", "tmpfs", "xfs", "zfs")
UNSUPPORTED = (errno.ENOSYS, errno.ENOTSUP, errno.EOPNOTSUPP, errno.ENOLCK, errno.EINVAL)


@dataclass(frozen=True)
class Owner:
    """A process: machine, the machine's boot id, number, start in ticks since boot, and namespace of the number.

    "" and 0 stand for what is not known.
    """

    host: str
    boot: str
    pid: int
    started: int
    space: str = ""

    @staticmethod
    def here() -> Owner:
        """This process."""
        return Owner(socket.gethostname(), _boot_id(), os.getpid(), _started(os.getpid()), namespace())

    @property
    def is_known_here(self) -> bool:
        """Whether this process can find out if that one runs: it is of this machine, since its start, and container."""
        return self.boot == _boot_id() and self.space in ("", namespace())

    def runs_here(self) -> bool:
        """Whether this very process runs on this machine now, as far as can be known."""
        return self.is_known_here and 0 < self.started == _started(self.pid)

    def __str__(self) -> str:
        return f"process {self.pid} on {self.host}"


@contextlib.contextmanager
def locked(folder: Path, shard: tuple[int, int] | None = None, *, take_over: bool = False) -> Iterator[bool]:
    """Hold the lock of `folder`, which is made if it is not there; with `shard` (i, n), that of one shard of it.

    Gives whether it is certain that no other process is at work, be it in another container or on another machine. A
    folder that is empty at the end is removed. `take_over`: do not refuse a lock that another machine left behind.
    Raises UserError when another process holds it or there is a file in place of the folder, OSError when it cannot be
    made.
    """
    descriptors = []
    try:
        descriptors.append(_take(folder, NAME, shared=shard is not None, take_over=take_over))
        if shard is not None:
            descriptors.append(_take(folder, f"{NAME}-{shard[0]}-of-{shard[1]}", shared=False, take_over=take_over))
        # a lock that is held may be asked for once more: this tells it from one that is not supported
        alone = shard is None and _is_on_one_machine(descriptors[0]) and _flocked(descriptors[0], fcntl.LOCK_EX) is True
        if alone:  # shards that were killed have left theirs, which would keep the folder
            for path in folder.glob(f"{NAME}-*-of-*"):
                path.unlink(missing_ok=True)
        yield alone
    finally:
        # an empty record means that its owner ended in good order; the last owner removes the file
        names = [NAME] if shard is None else [NAME, f"{NAME}-{shard[0]}-of-{shard[1]}"]
        for name, descriptor in reversed(list(zip(names, descriptors, strict=False))):
            with contextlib.suppress(OSError):
                if shard is None or name != NAME or _flocked(descriptor, fcntl.LOCK_EX):
                    os.ftruncate(descriptor, 0)
                    if _same_file(descriptor, folder / name):  # else another process's, in a folder made since
                        (folder / name).unlink()
            with contextlib.suppress(OSError):  # it was forced to the disk; another error, or none, is to be told
                os.close(descriptor)
        with contextlib.suppress(OSError):
            folder.rmdir()


def holders(folder: Path) -> list[str]:
    """Who holds locks of `folder` now, as far as can be known."""
    found, paths = [], []
    with contextlib.suppress(FileNotFoundError):  # there is none, or the last owner is just leaving
        paths = sorted(folder.glob(f"{NAME}*"))
    for path in paths:
        owner = _read(path)
        if owner is None or not _is_at_work(owner, path):
            continue
        part = path.name.removeprefix(NAME).strip("-").replace("-", " ")
        found.append(f"{owner}" + (f" (shard {part})" if part else ""))
    return found


def _take(folder: Path, name: str, *, shared: bool, take_over: bool) -> int:
    """The descriptor of the locked file `name`."""
    path = folder / name
    for tried in itertools.count(1):
        try:
            make_durably(folder)
            descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o666)
        except (FileNotFoundError, FileExistsError):
            # its last owner has just removed the folder, between the two calls
            refuse_file(folder)
            if tried == _TRIES:
                raise
            continue
        try:
            free = _flocked_soon(descriptor, fcntl.LOCK_SH if shared else fcntl.LOCK_EX)
            if free is False:
                raise UserError(_refusal(folder, *holders(folder)))
            if not _same_file(descriptor, path):  # its last owner has just removed it
                os.close(descriptor)
                continue
            owner = _read(path)
            if owner is not None and not take_over and _may_live(owner, flocks=free is True):
                raise UserError(
                    _refusal(folder, str(owner))
                    + f"\nif that process is certainly dead, add --unlock (or remove {path})"
                )
            if shared:
                os.ftruncate(descriptor, 0)  # whatever a dead owner left
            else:
                _write(descriptor)
            return descriptor
        except BaseException:
            with contextlib.suppress(OSError):
                os.close(descriptor)
            raise
    raise AssertionError  # the loop has no end but those in it


def refuse_file(folder: Path) -> None:
    """Raise UserError if there is something at `folder` that is no folder."""
    with contextlib.suppress(OSError):
        if not stat.S_ISDIR(folder.stat().st_mode):
            raise UserError(f"{folder}: is a file, not a folder")


def _refusal(folder: Path, *at_work: str) -> str:
    who = " and ".join(at_work) or "another process"
    are, have = ("are", "they have") if len(at_work) > 1 else ("is", "it has")
    return f"{folder}: {who} {are} at work on this output: wait until {have} finished, or choose another --output"


def _may_live(owner: Owner, *, flocks: bool) -> bool:
    """Whether the owner of a record may still be at work; `flocks`: this process could lock the file."""
    if owner.boot and owner.boot == _boot_id():
        # one kernel: a lock that it grants is free
        return not flocks and (owner.runs_here() or not owner.is_known_here)
    # an owner from before a restart of this machine is dead; locks of another machine may not reach here
    return owner.host != socket.gethostname()


def _is_at_work(owner: Owner, path: Path) -> bool:
    """Whether the owner of the record in the lock `path` may be at work; another process may start there meanwhile.

    The lock of a process that cannot be looked up here is held for an instant, shared, if it is free: /proc/locks does
    not show those of other containers.
    """
    if owner.is_known_here:
        return owner.runs_here()
    try:
        descriptor = os.open(path, os.O_RDONLY | os.O_CLOEXEC)
    except FileNotFoundError:
        return False
    except OSError:
        return True
    try:
        free = _flocked(descriptor, fcntl.LOCK_SH)
    finally:
        os.close(descriptor)
    return free is False or _may_live(owner, flocks=free is True)


def _is_on_one_machine(descriptor: int) -> bool:
    """Whether the file is on a file system of one machine, whose kernel knows all locks; not if that is unknown.

    A network file system may be mounted without locks that reach other machines, and does not tell.
    """
    with contextlib.suppress(OSError):
        mount = re.search(r"^mnt_id:\s*(\d+)$", Path(f"/proc/self/fdinfo/{descriptor}").read_text(), re.MULTILINE)
        for line in Path("/proc/self/mountinfo").read_text(errors="replace").splitlines():
            if mount is not None and line.split()[0] == mount[1]:
                return line.partition(" - ")[2].split()[0] in _ONE_MACHINE
    return False


def _flocked_soon(descriptor: int, kind: int) -> bool | None:
    """As :func:`_flocked`, but a lock that is held only for an instant counts as free."""
    for seconds in _GLANCES:
        free = _flocked(descriptor, kind)
        if free is not False:
            return free
        time.sleep(seconds)
    return _flocked(descriptor, kind)


def _flocked(descriptor: int, kind: int) -> bool | None:
    """Whether the file could be locked; None where that is not supported."""
    try:
        fcntl.flock(descriptor, kind | fcntl.LOCK_NB)
    except OSError as error:
        if error.errno in UNSUPPORTED:
            return None
        if error.errno in (errno.EWOULDBLOCK, errno.EACCES):
            return False
        raise
    return True


def _same_file(descriptor: int, path: Path) -> bool:
    try:
        there = path.stat()
    except FileNotFoundError:
        return False
    ours = os.fstat(descriptor)
    return (ours.st_dev, ours.st_ino) == (there.st_dev, there.st_ino)


def _write(descriptor: int) -> None:
    text = json.dumps(asdict(Owner.here())).encode()
    os.ftruncate(descriptor, 0)
    os.pwrite(descriptor, text, 0)
    os.fsync(descriptor)


def _read(path: Path) -> Owner | None:
    """Who wrote the record; None if it is empty or no record (its writer died before it was done)."""
    try:
        found = json.loads(path.read_bytes())
        known = (str(found["host"]), str(found["boot"]), int(found["pid"]), int(found["started"]))
        return Owner(*known, str(found.get("space", "")))
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return None


def _boot_id() -> str:
    """Identifier of this run of the machine's kernel; "" where it is not known."""
    try:
        return Path("/proc/sys/kernel/random/boot_id").read_text().strip()
    except OSError:
        return ""


def _started(pid: int) -> int:
    """When a process of this machine started, in ticks since boot; 0 if it does not run or that is not known."""
    try:
        text = Path(f"/proc/{pid}/stat").read_text(errors="replace")  # a name is cut at 15 bytes, even within a letter
    except OSError:
        return 0
    fields = text.rpartition(")")[2].split()  # the name before it may hold anything
    return 0 if fields[0] in ("Z", "X") else int(fields[19])
