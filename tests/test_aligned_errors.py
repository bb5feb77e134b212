"""The script that tells how far off aligned cells are, on the small study."""

import runpy
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]


@pytest.mark.heavy
def test_errors_over_several_meshes(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    """A row a scalar for each mesh; twice as many cells are closer to many more."""
    study = str(ROOT / "configs" / "small.yaml")
    options = ["--cells", "16", "32", "--reference", "96", "--places", "1", "--study", study]
    monkeypatch.setattr(sys, "argv", ["aligned_errors.py", *options])
    runpy.run_path(str(ROOT / "scripts" / "aligned_errors.py"), run_name="__main__")
    head, coarse, fine = capsys.readouterr().out.split("\n## ")
    assert head.startswith("9 cases, against 96 cells")
    tables = []
    for text, cells in ((coarse, 16), (fine, 32)):
        assert text.startswith(f"{cells} cells, 1 meshes")
        rows = [[word.strip() for word in line.split("|")[1:-1]] for line in text.splitlines() if line.startswith("| ")]
        tables.append({row[0]: row[2:] for row in rows[2:]})
    assert list(tables[0]) == list(tables[1]) and "slip_area" in tables[0]
    for name, row in tables[0].items():
        (rms, *beyond), (finer, *fewer) = map(float, row), map(float, tables[1][name])
        assert 0.0 < finer < rms < 30.0, name
        assert 0.0 <= sum(fewer) < sum(beyond) < 19.0, name


@pytest.mark.heavy
def test_errors_over_scales_are_smaller(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    """Those of forces, moments, slip areas, largest tractions and power, as scales are larger; all else the same."""
    study = str(ROOT / "configs" / "small.yaml")
    worst = []
    for over in ("itself", "scales"):
        options = ["--cells", "16", "--reference", "48", "--study", study, "--over", over]
        monkeypatch.setattr(sys, "argv", ["aligned_errors.py", *options])
        runpy.run_path(str(ROOT / "scripts" / "aligned_errors.py"), run_name="__main__")
        rows = [line.split("|")[1:3] for line in capsys.readouterr().out.splitlines() if line.startswith("| ")]
        worst.append({name.strip(): float(errors.split("/")[2]) for name, errors in rows[2:]})
    smaller = {name for name in worst[0] if worst[1][name] < worst[0][name]}
    assert smaller == {"force_x", "force_y", "moment_z", "slip_area", "traction_max", "friction_power"}
    assert all(worst[1][name] == worst[0][name] for name in worst[0].keys() - smaller)
