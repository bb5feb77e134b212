"""Tests marked `heavy` are skipped when the JIT is off: interpreted kernels take some 200 times as long."""

from __future__ import annotations

import gc
import signal
from collections.abc import Iterator, Sequence
from pathlib import Path

import numba
import pytest


@pytest.fixture(autouse=True, scope="session")
def nothing_is_late() -> Iterator[None]:
    """No step is announced for being slow, which all may be on a busy machine: tests take what is printed literally."""
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr("rcstudy.progress.LATE_SECONDS", 600.0)
        yield


@pytest.fixture
def undrawn(monkeypatch: pytest.MonkeyPatch) -> None:
    """Figures are made, but empty files are written: for tests of what is chosen or written beside them.

    To lay out and draw one takes a second; what is drawn has tests of its own.
    """

    def save(figure: object, out: Path, stem: str, formats: Sequence[str]) -> list[Path]:
        paths = [out / f"{stem}.{kind}" for kind in formats]
        for path in paths:
            path.touch()
        return paths

    for module in ("accuracy", "figures"):
        monkeypatch.setattr(f"rcstudy.{module}.save", save)


@pytest.fixture
def whole_bars(monkeypatch: pytest.MonkeyPatch) -> None:
    """Error bars stay the sums of their parts, for tests of these parts.

    They are not narrowed by the kind of contact, nor widened where there is one coarser mesh or a narrow zone of stick.
    """
    monkeypatch.setattr("rcstudy.bars.coverage.factors", lambda **_: {})
    monkeypatch.setattr("rcstudy.bars.few.LEAST", {"kalker": {}, "aligned": {}})
    monkeypatch.setattr("rcstudy.bars.narrow._AT_WIDER_BORDER", 0.0)
    monkeypatch.setattr("rcstudy.bars.narrow._OF_STICK", 0.0)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Skip `heavy` tests without the JIT."""
    if not numba.config.DISABLE_JIT:
        return
    skip = pytest.mark.skip(reason="heavy: the JIT is off")
    for item in items:
        if item.get_closest_marker("heavy") is not None:
            item.add_marker(skip)


def pytest_collection_finish() -> None:
    """What is loaded stays: to look through it for garbage again and again takes a tenth of the time of all tests."""
    gc.collect()
    gc.freeze()
    gc.set_threshold(50_000, 20, 50)


def pytest_configure(config: pytest.Config) -> None:
    """Take interrupts as a terminal's foreground does: a shell has its background jobs ignore them, and all they start.

    Handlers are not inherited, so that processes which tests start have the default again.
    """
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
