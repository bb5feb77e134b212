"""Processors and memory that a process may use, on the machine and in a container."""

from __future__ import annotations

import math
import os
import threading
import time
from pathlib import Path

import pytest

from rcstudy import threads


@pytest.fixture
def group(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Where the limits of a container stand; there are none yet. The process is bound to eight processors."""
    monkeypatch.setattr(threads, "_GROUP", tmp_path)
    monkeypatch.setattr(threads, "_MEMBERSHIP", tmp_path / "membership")
    monkeypatch.setattr(os, "sched_getaffinity", lambda pid: set(range(8)), raising=False)
    return tmp_path


@pytest.mark.parametrize(
    ("limit", "cores"),
    [
        (None, 8),
        ("max 100000", 8),
        ("200000 100000", 2),
        ("150000 100000", 2),
        ("5000 100000", 1),
        ("6400000 100000", 8),
        ("", 8),
    ],
)
def test_processors_are_counted_with_the_share_of_a_container(group: Path, limit: str | None, cores: int) -> None:
    if limit is not None:
        (group / "cpu.max").write_text(limit + "\n")
    assert threads.available_cores() == cores


def test_processors_of_a_machine_that_binds_no_process(group: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delattr(os, "sched_getaffinity", raising=False)
    monkeypatch.setattr(os, "cpu_count", lambda: 6)
    assert threads.available_cores() == 6
    monkeypatch.setattr(os, "cpu_count", lambda: None)
    assert threads.available_cores() == 1


def limit(folder: Path, **limits: str) -> None:
    """Write limits of a group; "__" stands for the dot in the name of a file."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in limits.items():
        (folder / name.replace("__", ".")).write_text(text + "\n")


def test_a_group_and_those_it_is_in_have_limits(group: Path) -> None:
    """The smallest counts, at whatever level; groups beside them do not."""
    (group / "membership").write_text("0::/slice/job\n")
    limit(group / "slice", cpu__max="600000 100000", memory__max="6000")
    limit(group / "slice" / "job", cpu__max="max 100000", memory__max="max")
    limit(group / "slice" / "other", cpu__max="100000 100000", memory__max="1000")
    assert (threads.available_cores(), threads.available_memory()) == (6, 6000.0)
    limit(group / "slice" / "job", cpu__max="150000 100000", memory__max="5000")
    assert (threads.available_cores(), threads.available_memory()) == (2, 5000.0)
    limit(group, cpu__max="100000 100000", memory__max="4000")
    assert (threads.available_cores(), threads.available_memory()) == (1, 4000.0)


@pytest.mark.parametrize("root", ["cpu,cpuacct", "cpu"])
def test_groups_of_version_1(group: Path, root: str) -> None:
    (group / "membership").write_text("9:name=systemd:/init\n4:memory:/slice/job\n3:cpu,cpuacct:/job\n")
    limit(group / root, cpu__cfs_quota_us="-1", cpu__cfs_period_us="100000")
    limit(group / root / "job", cpu__cfs_quota_us="250000", cpu__cfs_period_us="100000")
    limit(group / "memory", memory__limit_in_bytes=f"{2**63 - 4096}")
    limit(group / "memory" / "slice", memory__limit_in_bytes="6000")
    limit(group / "memory" / "slice" / "job", memory__limit_in_bytes="7000")
    assert (threads.available_cores(), threads.available_memory()) == (3, 6000.0)


def test_a_container_of_version_1_sees_its_group_as_the_root(group: Path) -> None:
    (group / "membership").write_text("4:memory:/outside/f00\n3:cpu:/outside/f00\n")
    limit(group / "cpu", cpu__cfs_quota_us="200000", cpu__cfs_period_us="100000")
    limit(group / "memory", memory__limit_in_bytes="6000")
    assert (threads.available_cores(), threads.available_memory()) == (2, 6000.0)


def test_version_1_without_limits(group: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delattr(os, "sysconf", raising=False)
    (group / "membership").write_text("4:memory:/\n3:cpu:/\n")
    limit(group / "cpu", cpu__cfs_quota_us="-1", cpu__cfs_period_us="100000")
    limit(group / "memory", memory__limit_in_bytes=f"{2**63 - 4096}")
    assert (threads.available_cores(), threads.available_memory()) == (8, math.inf)


@pytest.mark.parametrize("membership", ["", "nonsense", "0::", "0::/../beside", "0::/gone", "\0"])
@pytest.mark.parametrize(
    ("cpu", "memory"), [("0 100000", "0"), ("1 0", "-1"), ("1", ""), ("1 1 1", "1 1"), ("nan inf", "nan")]
)
def test_odd_limits_are_none(
    group: Path, monkeypatch: pytest.MonkeyPatch, membership: str, cpu: str, memory: str
) -> None:
    monkeypatch.setattr(threads, "_GROUP", group / "root")
    monkeypatch.delattr(os, "sysconf", raising=False)
    (group / "membership").write_text(membership)
    limit(group / "root", cpu__max=cpu, memory__max=memory)
    limit(group / "beside", cpu__max="100000 100000", memory__max="1000")
    assert (threads.available_cores(), threads.available_memory()) == (8, math.inf)


def test_memory_is_that_of_the_machine_or_of_a_container(group: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "sysconf", {"SC_PHYS_PAGES": 1000, "SC_PAGE_SIZE": 4096}.__getitem__, raising=False)
    assert threads.available_memory() == 4.096e6
    for limit, memory in (("max", 4.096e6), ("3000000", 3e6), ("5000000", 4.096e6)):
        (group / "memory.max").write_text(limit + "\n")
        assert threads.available_memory() == memory
    (group / "memory.max").unlink()
    monkeypatch.setattr(os, "sysconf", {"SC_PHYS_PAGES": -1, "SC_PAGE_SIZE": 4096}.__getitem__)
    assert threads.available_memory() == math.inf
    monkeypatch.delattr(os, "sysconf")
    assert threads.available_memory() == math.inf


def test_threads_that_limit_at_once_leave_the_variables_as_they_were(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in threads.THREAD_VARIABLES:
        monkeypatch.setenv(name, "3")
    inside, seen = threading.Barrier(2), []

    def limit_at_once(first: float, then: float) -> None:
        inside.wait()
        time.sleep(first)
        with threads.limited_threads():
            seen.append([os.environ[name] for name in threads.THREAD_VARIABLES])
            time.sleep(then)

    both = [threading.Thread(target=limit_at_once, args=times) for times in ((0.0, 0.1), (0.05, 0.1))]
    for thread in both:
        thread.start()
    for thread in both:
        thread.join()
    assert seen == [["1"] * 4] * 2
    assert [os.environ[name] for name in threads.THREAD_VARIABLES] == ["3"] * 4
