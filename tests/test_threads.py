"""Processors and memory that a process may use, on the machine and in a container."""

from __future__ import annotations

import math
import os
from pathlib import Path

import pytest

from rcstudy import threads


@pytest.fixture
def group(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Where the limits of a container stand; there are none yet. The process is bound to eight processors."""
    monkeypatch.setattr(threads, "_GROUP", tmp_path)
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
