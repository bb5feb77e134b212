"""Comparison: what is the same passes, whatever is different does not."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest
import synthetic
import xarray as xr
from studies import BASE, load_text
from workers import made_up

from rcstudy.cases import Case
from rcstudy.compare import TABLE, Comparison, Difference, _same_words, compare
from rcstudy.cube import open_cube
from rcstudy.errors import UserError
from rcstudy.mechanics.scene import Scene
from rcstudy.result import CellState, Result, Status
from rcstudy.scales import natural_scales, shared_scales
from rcstudy.storage.layout import MISSING
from rcstudy.structure import _common, _matches, settings_that_differ
from rcstudy.studyfile.build import scene_hertz
from rcstudy.sweep import run
from rcstudy.tolerances import Rule, Tolerances, load_tolerances, parse_flips, parse_option

Change = Callable[[Case, Result], Result]


@pytest.fixture(scope="module")
def reference(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A cube of one grid: 2 moduli x 3 creepages."""
    return synthetic.write(tmp_path_factory.mktemp("reference") / "reference.nc", synthetic.small())


@pytest.fixture(scope="module")
def several(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A cube of three grids with a table of all cases."""
    return synthetic.write(tmp_path_factory.mktemp("several") / "several.nc", synthetic.several())


def changed(path: Path, change: Change, made: synthetic.Synthetic | None = None) -> Path:
    """The reference's cube with `change` done to the result of case (1, 2), the last one of `small`."""
    made = made or synthetic.small()
    results = [(case, change(case, result) if case is made.results[-1][0] else result) for case, result in made.results]
    return synthetic.write(path, replace(made, results=results))


def with_fields(**changes: Callable[[np.ndarray], np.ndarray]) -> Change:
    """A change of fields: a function of each."""

    def change(case: Case, result: Result) -> Result:
        fields = {name: changes.get(name, np.copy)(values) for name, values in result.fields.items()}
        return replace(result, fields=fields)

    return change


def with_scalars(**changes: float) -> Change:
    """A change of scalars: a factor for each."""

    def change(case: Case, result: Result) -> Result:
        scalars = {name: value * changes.get(name, 1.0) for name, value in result.scalars.items()}
        return replace(result, scalars=scalars)

    return change


def outcome(cube: Path, reference: Path, tolerances: Tolerances | None = None, **options: bool) -> Comparison:
    with open_cube(cube) as ours, open_cube(reference) as theirs:
        return compare(ours, theirs, tolerances, **options)


def edited(reference: Path, path: Path, edit: Callable[[h5py.File], None]) -> Path:
    """A copy of a cube, edited in place."""
    path.write_bytes(reference.read_bytes())
    with h5py.File(path, "r+") as file:
        edit(file)
    return path


@pytest.mark.parametrize("which", ["reference", "several"])
def test_a_cube_agrees_with_itself(which: str, request: pytest.FixtureRequest) -> None:
    path = request.getfixturevalue(which)
    found = outcome(path, path)
    assert found.same, found.text()
    assert found.cases == {"reference": 6, "several": 9}[which]
    assert found.text().startswith("same: ")


def test_what_a_solver_tells_of_its_own_work_is_not_compared(tmp_path: Path, reference: Path) -> None:
    other = changed(
        tmp_path / "c.nc",
        with_scalars(
            solve_seconds=7.0, iterations_tangential=2, operator_products=3, residual_normal=0.5, proof_gap=0.1
        ),
    )
    found = outcome(other, reference)
    assert found.same, found.text()
    assert "solve_seconds" not in found.worst
    assert "residual_normal" not in found.worst


def test_a_traction_off_by_one_per_cent(tmp_path: Path, reference: Path) -> None:
    found = outcome(changed(tmp_path / "c.nc", with_fields(traction_x=lambda q: q * 1.01)), reference)
    assert not found.same
    assert {(d.variable, d.label) for d in found.bad} == {("traction_x", "modulus=2 Es, creepage=f")}
    assert found.bad[0].value == pytest.approx(0.01)
    assert "traction_x: 1.00e-02" in found.text()
    assert "tiny: modulus=2 Es, creepage=f" in found.text()


def test_a_traction_off_in_one_cell(tmp_path: Path, reference: Path) -> None:
    def one_cell(q: np.ndarray) -> np.ndarray:
        out = q.copy()
        out[15, 12] += 2e-6 * np.abs(q).max()
        return out

    found = outcome(changed(tmp_path / "c.nc", with_fields(traction_y=one_cell)), reference)
    assert [d.variable for d in found.bad] == ["traction_y"]
    assert "in 1 of 768 cells" in found.text()


def test_differences_within_the_tolerance(tmp_path: Path, reference: Path) -> None:
    other = changed(tmp_path / "c.nc", with_fields(traction_x=lambda q: q * (1 + 5e-7)))
    found = outcome(other, reference)
    assert found.same, found.text()
    assert found.worst["traction_x"].value == pytest.approx(5e-7, rel=1e-3)
    assert "within their tolerance" in found.text()


def test_of_differences_within_the_tolerance_the_largest_are_shown(tmp_path: Path, reference: Path) -> None:
    """In the order of what they are of their tolerance, whichever variable comes first."""
    parts = {"pressure": 2e-7, "traction_x": 5e-7, "traction_y": 3e-7}
    changes = {name: lambda values, part=part: values * (1 + part) for name, part in parts.items()}
    found = outcome(changed(tmp_path / "c.nc", with_fields(**changes)), reference)
    assert found.same, found.text()
    for limit, shown in ((20, ["traction_x", "traction_y", "pressure"]), (1, ["traction_x"])):
        lines = found.text(limit).partition("largest differences within their tolerance:\n")[2].splitlines()
        assert [line.split(":")[0].strip() for line in lines[: len(parts)] if line.startswith("  ")] == shown


def test_a_shifted_mask(tmp_path: Path, reference: Path) -> None:
    found = outcome(changed(tmp_path / "c.nc", with_fields(state=lambda s: np.roll(s, 1, axis=0))), reference)
    assert {d.variable for d in found.bad} == {"state"}
    assert "differs in" in found.text()


@pytest.mark.parametrize("name", ["pressure", "traction_x", "slip_y", "state"])
def test_a_field_shifted_by_a_cell(tmp_path: Path, reference: Path, name: str) -> None:
    shift = with_fields(**{name: lambda f: np.roll(f, 1, axis=1)})
    found = outcome(changed(tmp_path / "c.nc", shift), reference)
    assert {d.variable for d in found.bad} == {name}


def square(path: Path, change: Change | None = None) -> Path:
    """A cube on a square mesh, so that swapped axes do not show in the shapes."""
    grid = synthetic.make_grid("square", synthetic.creepage_axis({k: synthetic.CREEPAGES[k] for k in "af"}))
    scene = replace(synthetic.SCENE, mesh=synthetic.Mesh((2.0, 2.0), (24, 24)))
    made = synthetic.assemble(synthetic.make_study(), (grid, synthetic.grid_cases(grid, scene)))
    return changed(path, change or (lambda _, result: result), made)


def test_swapped_axes_of_the_fields(tmp_path: Path) -> None:
    def swap(case: Case, result: Result) -> Result:
        return replace(result, fields={name: values.T.copy() for name, values in result.fields.items()})

    reference = square(tmp_path / "reference.nc")
    assert outcome(square(tmp_path / "same.nc"), reference).same
    found = outcome(square(tmp_path / "c.nc", swap), reference)
    assert {d.variable for d in found.bad} == {"traction_x", "traction_y", "slip_x", "slip_y"}


def test_swapped_axes_of_the_grid(tmp_path: Path, reference: Path) -> None:
    made = synthetic.small()
    grid = made.expansion.grids[0]
    turned = replace(grid, axes=grid.axes[::-1], shape=grid.shape[::-1])
    results = [(replace(case, index=case.index[::-1]), result) for case, result in made.results]
    expansion = replace(made.expansion, grids=(turned,), cases=tuple(case for case, _ in results))
    found = outcome(synthetic.write(tmp_path / "c.nc", synthetic.Synthetic(made.study, expansion, results)), reference)
    assert not found.same
    words = "dimensions are (creepage, modulus), in the reference (modulus, creepage): the same in another order"
    assert words in found.text()


def test_the_same_cases_by_axes_in_another_order(tmp_path: Path) -> None:
    """They were said to be in one cube only."""
    axes = ["load: [10, 20]", "friction: [0.3, 0.5]"]
    for name, order in (("a", axes), ("b", axes[::-1])):
        folder = tmp_path / name
        folder.mkdir()
        run(
            load_text(folder, f"{BASE}  g: {{axes: {{{', '.join(order)}}}}}\n"),
            folder / "c.nc",
            workers=1,
            solve=made_up,
        )
    found = outcome(tmp_path / "a" / "c.nc", tmp_path / "b" / "c.nc")
    assert not found.same
    assert found.structure[1:] == ["cases cannot be matched: nothing was compared"]


def test_values_of_an_axis_in_another_order(tmp_path: Path, reference: Path) -> None:
    """Cases are matched by their coordinates: the numbers agree, the order is still a difference."""
    found = outcome(synthetic.write(tmp_path / "c.nc", some("fca")), reference)
    assert not found.same
    assert not found.bad
    assert found.cases == 6
    assert "creepage: in another order" in found.text()


def some(creepages: str) -> synthetic.Synthetic:
    """`small` with other creepages."""
    grid = synthetic.make_grid(
        "tiny",
        synthetic.modulus_axis(),
        synthetic.creepage_axis({k: synthetic.CREEPAGES[k] for k in creepages}),
        description="tiny grid",
    )
    cases = synthetic.grid_cases(grid, synthetic.SCENE, layer_count=1, thickness=0.5 * synthetic.RADIUS)
    return synthetic.assemble(synthetic.make_study(), (grid, cases))


def test_a_dropped_case(tmp_path: Path, reference: Path) -> None:
    found = outcome(synthetic.write(tmp_path / "c.nc", some("af")), reference)
    assert not found.same
    assert found.cases == 4
    assert not found.bad, "the cases that are left are the same"
    assert "tiny: creepage c: missing in the cube" in found.text()


def test_a_case_too_many(tmp_path: Path, reference: Path) -> None:
    found = outcome(synthetic.write(tmp_path / "c.nc", some("acdf")), reference)
    assert not found.same
    assert "tiny: creepage d: not in the reference" in found.text()


def test_no_case_in_common(tmp_path: Path, reference: Path, several: Path) -> None:
    found = outcome(synthetic.write(tmp_path / "c.nc", some("bd")), reference)
    assert found.cases == 0
    assert not found.same
    assert "no case is in both cubes: nothing was compared" in found.text()
    found = outcome(several, reference)
    assert found.cases == 0
    assert not found.same
    assert "tiny: missing in the cube" in found.text()
    assert "product: not in the reference" in found.text()


@pytest.mark.parametrize("size", ["[2, 2]", "auto"])
def test_cropped_and_whole_fields(tmp_path: Path, size: str) -> None:
    """All cases were said to be in one cube only. What both hold is compared, and the difference of a cell found."""
    grid = "  g: {axes: {load: [50, 100], friction: [0.3, 0.4]}}\n"
    for name, crop in (("whole", "none"), ("part", "contact")):
        text = BASE.replace("size: [2, 2]", f"size: {size}").replace("grids:", f"outputs: {{crop: {crop}}}\ngrids:")
        run(load_text(tmp_path, text + grid), tmp_path / f"{name}.nc", workers=1)
    whole, part = tmp_path / "whole.nc", tmp_path / "part.nc"
    with open_cube(part) as tree:
        cells = f"{tree.sizes['x']} x {tree.sizes['y']}"
    assert cells != "32 x 32"
    how = "cropped in another way (outputs: crop), or to other contacts"
    first = f"g: x, y: fields on {cells} cells, a part of the reference's, 32 x 32: {how}"
    found = outcome(part, whole)
    assert (found.structure, found.bad, found.cases, found.same) == ([first], [], 4, False)
    first = f"g: x, y: fields on 32 x 32 cells, of which the reference's are a part, {cells}: {how}"
    found = outcome(whole, part)
    assert (found.structure, found.bad, found.cases, found.same) == ([first], [], 4, False)
    with h5py.File(part, "r+") as file:
        file["pressure"][0, 1, 5, 5] += 3.0
    (bad,) = outcome(part, whole).bad
    assert (bad.variable, bad.label, bad.note.startswith("in 1 of ")) == ("pressure", "load=50, friction=0.4", True)


def test_settings_that_cubes_have_no_number_of(tmp_path: Path) -> None:
    """Where numbers differ, what the studies differ in comes first; not what cases set, nor where numbers agree."""
    grid = "  g: {axes: {load: [50, 100]}}\n  h: {axes: {counterbody: [rigid, {E: 70000, nu: 0.3}]}}\n"
    texts = {"rigid": BASE, "same": BASE + "# as it was\n"}
    texts["steel"] = BASE.replace("grids:", "  counterbody: {E: 210000, nu: 0.3}\n  discretisation: aligned\ngrids:")
    for name, text in texts.items():
        study = text.replace("grids:\n", f"grids:\n{grid}")
        run(load_text(tmp_path, study), tmp_path / f"{name}.nc", workers=1)
    found = outcome(tmp_path / "steel.nc", tmp_path / "rigid.nc")
    assert found.settings == [
        "g: the studies differ in counterbody, discretisation",
        "h: the studies differ in discretisation",
    ]
    assert found.text().splitlines()[:2] == found.settings
    with open_cube(tmp_path / "steel.nc") as ours, open_cube(tmp_path / "rigid.nc") as theirs:
        assert settings_that_differ(ours, theirs, ["h"] * 7) == [
            "h, h, h, h, h and 2 more: the studies differ in discretisation"
        ]
    same = outcome(tmp_path / "same.nc", tmp_path / "rigid.nc")
    assert (same.same, same.settings) == (True, [])


def test_windows_of_other_sizes(tmp_path: Path) -> None:
    """Fields were said to be cropped in another way where none is; the cells that both have are compared as before."""
    for name, size, cells in (("small", "[1, 1]", "[16, 16]"), ("large", "[2, 2]", "[32, 32]")):
        text = BASE.replace("[2, 2]", size).replace("[32, 32]", cells) + "  g: {axes: {load: [50, 100]}}\n"
        run(load_text(tmp_path, text), tmp_path / f"{name}.nc", workers=1, solve=made_up)
    small, large = tmp_path / "small.nc", tmp_path / "large.nc"
    reason = "the windows differ (mesh: size, margin), neither is cropped"
    (first, *_) = outcome(small, large).structure
    assert first == f"g: x, y: fields on 16 x 16 cells, a part of the reference's, 32 x 32: {reason}"
    with h5py.File(small, "r+") as file:  # what the study says is not known: it may be cropped
        file.attrs["study_text"] = "\t"
    (first, *_) = outcome(small, large).structure
    assert first.endswith("cropped in another way (outputs: crop), or to other contacts")


@pytest.mark.parametrize(
    "meshes",
    ["[[16, 16], [32, 32], [64, 64]]", "[[16, 16], [20, 20]]", "[[16, 16], [16, 24]]", "[[16, 16], [24, 16]]"],
)
def test_cropped_and_whole_fields_of_several_meshes(tmp_path: Path, meshes: str) -> None:
    """No case could be matched, of which cropping was not named as the reason."""
    grid = f"  g: {{axes: {{mesh.cells: {meshes}}}}}\n"
    for name, crop in (("whole", "none"), ("part", "contact")):
        text = BASE.replace("grids:", f"outputs: {{crop: {crop}}}\ngrids:")
        run(load_text(tmp_path, text + grid), tmp_path / f"{name}.nc", workers=1)
    for pair in (("part", "whole"), ("whole", "part")):
        found = outcome(*(tmp_path / f"{name}.nc" for name in pair))
        (cropped,) = found.structure
        assert "cropped in another way (outputs: crop)" in cropped and cropped.endswith("fields are not compared")
        assert (found.bad, found.cases, found.same) == ([], meshes.count("[") - 1, False)


SOFT = "coupling: full, friction: 1, layers: [{E: 0.05 Es, nu: 0.3, thickness: 0.3 a}]"


@pytest.mark.parametrize(
    ("ours", "theirs", "words"),
    [
        # rolled either way under friction: 9 x 10 cells of both, those of one a cell ahead of the other's
        (
            f"{SOFT}, creepage: {{longitudinal: 0.5}}",
            f"{SOFT}, creepage: {{longitudinal: -0.5}}",
            "8 x 10 of them among",
        ),
        ("radius: [300, 30]", "radius: [30, 300]", "6 x 6 of them among"),
    ],
)
def test_fields_cropped_to_other_contacts(tmp_path: Path, ours: str, theirs: str, words: str) -> None:
    """The case in both was compared cell by cell with cells elsewhere, or not at all."""
    base = BASE.replace("cells: [32, 32]", "cells: [20, 20]").replace("grids:", "outputs: {crop: contact}\ngrids:")
    alike = "creepage: {longitudinal: 0}, load: 30, " + SOFT if "coupling" in ours else "friction: 1"
    for name, other in (("ours", ours), ("theirs", theirs)):
        grid = f"  g: {{cases: [{{label: both, {alike}}}, {{label: {name}, {other}}}]}}\n"
        run(load_text(tmp_path, base + grid), tmp_path / f"{name}.nc", workers=1)
    cubes = tmp_path / "ours.nc", tmp_path / "theirs.nc"
    found = outcome(*cubes)
    assert found.structure[:2] == ["g: case theirs: missing in the cube", "g: case ours: not in the reference"]
    cropped = found.structure[2]
    assert words in cropped and cropped.endswith("cropped in another way (outputs: crop), or to other contacts")
    assert (found.bad, found.cases, [s for s in found.structure[3:] if "coordinate" not in s]) == ([], 1, [])
    with h5py.File(cubes[0], "r+") as file:
        (i,), (j,) = (np.flatnonzero(np.isclose(file[dim], 0.05)) for dim in "xy")
        file["pressure"][0, i, j] *= 1.01
    (bad,) = outcome(*cubes).bad
    assert (bad.variable, bad.label, bad.note.startswith("in 1 of ")) == ("pressure", "both", True)


def test_cells_in_both_grids() -> None:
    centres = np.arange(10.0)[None] * 0.1
    assert _common(centres[:, :8], centres[:, 2:]) == (slice(2, 8), slice(0, 6), True)
    assert _common(centres[:, 2:], centres[:, :8]) == (slice(0, 6), slice(2, 8), True)
    assert _common(centres[:, 2:4], centres) == (slice(0, 2), slice(2, 4), True)
    assert _common(centres[:, 4:5], centres) == (slice(0, 1), slice(4, 5), True)
    apart = _common(centres[:, :3], centres[:, 5:])
    assert apart is not None and not apart.alike
    assert _common(centres, centres + 0.03) is None  # between the others
    assert _common(centres, 1.5 * centres) is None  # of another size
    assert _common(centres, np.full((1, 4), np.nan)) is None
    assert _common(centres, np.empty((1, 0))) is None
    padded = np.array([[0.1, 0.2, 0.3, np.nan], [0.2, 0.3, np.nan, np.nan]])
    whole = np.array([[0.0, 0.1, 0.2, 0.3, 0.4], [0.1, 0.2, 0.3, np.nan, np.nan]])
    found = _common(padded, whole)
    assert found is not None and not found.alike  # one cell behind those in common is of the first case alone


@pytest.mark.parametrize("whole", ["ours", "theirs"])
def test_scalars_of_a_cube_without_fields(tmp_path: Path, reference: Path, whole: str) -> None:
    """No case could be matched, it said."""
    single = synthetic.write(tmp_path / "scalars.nc", synthetic.small(fields=False))
    found = outcome(*((reference, single) if whole == "ours" else (single, reference)))
    words = "not in the reference" if whole == "ours" else "missing, in the reference"
    assert [words in s and s.endswith("fields are not compared") for s in found.structure] == [True, True]
    assert (found.bad, found.cases, found.same) == ([], 6, False)
    worse = changed(tmp_path / "c.nc", with_scalars(force_x=1.01))
    (bad,) = outcome(*((worse, single) if whole == "ours" else (single, worse))).bad
    assert bad.variable == "force_x"


@pytest.mark.parametrize(
    ("ours", "theirs", "words", "cases"),
    [
        ("[0.1 a, 0.2 a]", "[0.1 a, 0.2]", ["0.2 mm: missing in the cube", "0.2 a: not in the reference"], 2),
        ("[0.1 a, 0.02]", "[0.02, 0.1 a]", ["in another order than in the reference"], 4),
        ("[0.1 a]", "[0.1]", ["0.1 mm: missing in the cube", "0.1 a: not in the reference"], 0),
    ],
)
def test_relative_values_in_one_cube_alone(
    tmp_path: Path, ours: str, theirs: str, words: list[str], cases: int
) -> None:
    """They were missing beside absolute ones, which make words of numbers, and those of a were taken for mm."""
    for name, values in (("ours", ours), ("theirs", theirs)):
        grid = f"  g: {{coating: {{modulus: 1000}}, axes: {{load: [50, 100], thickness: {values}}}}}\n"
        run(load_text(tmp_path, BASE + grid), tmp_path / f"{name}.nc", workers=1, solve=made_up)
    found = outcome(tmp_path / "ours.nc", tmp_path / "theirs.nc")
    told = [s.removeprefix("g: thickness ").removeprefix("g: thickness: ") for s in found.structure]
    assert told[: len(words)] == words
    assert (found.bad, found.cases) == ([], cases)


def test_other_windows_that_fit_are_not_taken_for_crops(tmp_path: Path) -> None:
    """Those of one case are moved by 0.1 um here."""
    text = BASE.replace("size: [2, 2]", "size: auto") + "  g: {axes: {load: [50, 100]}}\n"
    run(load_text(tmp_path, text), tmp_path / "whole.nc", workers=1)
    run(
        load_text(tmp_path, text.replace("grids:", "outputs: {crop: contact}\ngrids:")), tmp_path / "part.nc", workers=1
    )
    with h5py.File(tmp_path / "whole.nc", "r+") as file:
        file["x_centre"][1] += 1e-4
    found = outcome(tmp_path / "part.nc", tmp_path / "whole.nc")
    assert found.structure[0].startswith("g: dimension x: ") and found.cases == 0


@pytest.mark.parametrize("mesh", ["size: [3, 3], cells: [16, 16]", "size: [2, 2], cells: [16, 16]"])
def test_other_meshes_are_not_taken_for_crops(tmp_path: Path, mesh: str) -> None:
    grid = "  g: {axes: {load: [50, 100]}}\n"
    for name, text in (("one", BASE), ("other", BASE.replace("size: [2, 2], cells: [32, 32]", mesh))):
        run(load_text(tmp_path, text + grid), tmp_path / f"{name}.nc", workers=1)
    first, *_, last = outcome(tmp_path / "one.nc", tmp_path / "other.nc").structure
    assert first == "g: dimension x: 32, in the reference 16"
    assert last == "cases cannot be matched: nothing was compared"


def test_a_dropped_grid_and_table(tmp_path: Path, several: Path) -> None:
    def drop(file: h5py.File) -> None:
        del file["listed"]

    found = outcome(edited(several, tmp_path / "c.nc", drop), several)
    assert not found.same
    assert "listed: missing in the cube" in found.text()


@pytest.mark.parametrize("name", ["traction_x", "iterations_normal", "status", "solve_seconds", "layer_nu"])
def test_a_renamed_variable(tmp_path: Path, reference: Path, name: str) -> None:
    found = outcome(edited(reference, tmp_path / "c.nc", lambda f: f.move(name, f"{name}_2")), reference)
    assert not found.same
    assert f"variable {name}: missing in the cube" in found.text()
    assert f"variable {name}_2: not in the reference" in found.text()


def test_renamed_in_the_table_only(tmp_path: Path, several: Path) -> None:
    found = outcome(edited(several, tmp_path / "c.nc", lambda f: f.move("force_x", "force")), several)
    assert not found.same
    assert "table of all cases: variable force_x: missing" in found.text()


def test_a_number_changed_in_the_table_only(tmp_path: Path, several: Path) -> None:
    def edit(file: h5py.File) -> None:
        file["force_x"][0] = 2 * file["force_x"][0]

    found = outcome(edited(several, tmp_path / "c.nc", edit), several)
    assert not found.same
    assert [(d.grid, d.variable) for d in found.bad] == [("table of all cases", "force_x")]


@pytest.mark.parametrize("status", [Status.NOT_CONVERGED, Status.PROOF_FAILED])
def test_a_changed_status(tmp_path: Path, reference: Path, status: Status) -> None:
    other = changed(tmp_path / "c.nc", lambda _, result: replace(result, status=status))
    for one, two in ((other, reference), (reference, other)):
        found = outcome(one, two)
        assert [d.variable for d in found.bad] == ["status"]
        assert status.words in found.text()
        assert not outcome(one, two, allow_unsolved=True).same


def test_unsolved_in_both(tmp_path: Path) -> None:
    path = changed(tmp_path / "c.nc", lambda _, result: replace(result, status=Status.NOT_CONVERGED))
    found = outcome(path, path)
    assert not found.same
    assert "is not converged in both cubes" in found.text()
    assert "1 case with the same failure in both cubes: --allow-unsolved accepts it" in found.text()
    assert "--allow-unsolved" not in outcome(path, path, allow_unsolved=True).text()
    assert outcome(path, path, allow_unsolved=True).same


@pytest.mark.parametrize("name", ["pressure", "traction_x", "slip_x"])
def test_a_missing_value_in_a_field(tmp_path: Path, reference: Path, name: str) -> None:
    def hole(values: np.ndarray) -> np.ndarray:
        out = values.copy()
        out[0, 0] = np.nan
        return out

    other = changed(tmp_path / "c.nc", with_fields(**{name: hole}))
    for one, two, where in ((other, reference, "the cube"), (reference, other, "the reference")):
        found = outcome(one, two)
        assert [d.variable for d in found.bad] == [name]
        assert f"1 values missing in {where}" in found.text()
    assert outcome(other, other).same


def test_a_missing_or_infinite_scalar(tmp_path: Path, reference: Path) -> None:
    def without(case: Case, result: Result) -> Result:
        return replace(result, scalars={k: v for k, v in result.scalars.items() if k != "force_x"})

    assert [d.variable for d in outcome(changed(tmp_path / "a.nc", without), reference).bad] == ["force_x"]

    def edit(file: h5py.File) -> None:
        file["force_x"][1, 2] = np.inf

    infinite = edited(reference, tmp_path / "b.nc", edit)
    other_way = edited(infinite, tmp_path / "c.nc", lambda f: f["force_x"].__setitem__((1, 2), -np.inf))
    for found in (outcome(infinite, reference), outcome(infinite, other_way)):
        assert [d.variable for d in found.bad] == ["force_x"]


@pytest.mark.parametrize(
    "name", ["force_x_error", "proof_stick", "residual_normal", "operator_products", "solve_seconds"]
)
def test_of_a_solvers_own_work_there_must_be_numbers(tmp_path: Path, reference: Path, name: str) -> None:
    """In either cube, where the other one has them (made-up results have no estimates of errors)."""

    def edit(file: h5py.File) -> None:
        missing = np.nan if file[name].dtype.kind == "f" else MISSING
        file[name][1, 2] = 1.0 if name.endswith("_error") else missing

    without = edited(reference, tmp_path / "b.nc", edit)
    for found in (outcome(without, reference), outcome(reference, without)):
        assert [(d.variable, "missing" in d.note) for d in found.bad] == [(name, True)]


def test_other_numbers_for_the_same_words(tmp_path: Path, reference: Path) -> None:
    def edit(file: h5py.File) -> None:
        file["status"].attrs["flag_values"] = file["status"].attrs["flag_values"][::-1]

    found = outcome(edited(reference, tmp_path / "b.nc", edit), reference)
    assert not found.same
    assert "variable status: flag_values" in found.text()


@pytest.mark.parametrize("name", ["proof_gap", "force_x_error", "solve_seconds", "status", "state", "friction"])
def test_a_tolerance_for_what_is_not_compared_within_one(reference: Path, name: str) -> None:
    with pytest.raises(UserError, match=f"a tolerance is given for {name}; only these have one: pressure, "):
        outcome(reference, reference, Tolerances(variables={name: 0.1}))


@pytest.mark.parametrize("name", ["force_x", "moment_z", "pressure_max", "slip_area", "friction_power", "approach"])
def test_a_scalar_that_is_off(tmp_path: Path, reference: Path, name: str) -> None:
    found = outcome(changed(tmp_path / "c.nc", with_scalars(**{name: 1.01})), reference)
    assert [d.variable for d in found.bad] == [name]


def test_vanishing_components_are_not_measured_against_themselves(tmp_path: Path) -> None:
    """With a longitudinal creepage alone the lateral force is rounding: any other rounding will do."""
    made = some("a")
    reference = synthetic.write(tmp_path / "reference.nc", made)

    def noise(size: float) -> Change:
        def change(case: Case, result: Result) -> Result:
            fields = dict(result.fields)
            fields["traction_y"] = fields["traction_y"] + size * np.abs(fields["traction_x"]).max()
            return replace(result, fields=fields, scalars={**result.scalars, "force_y": size * 1e5})

        return change

    assert not np.any(made.results[0][1].fields["traction_y"])
    same = outcome(changed(tmp_path / "small.nc", noise(1e-14), made), reference)
    assert same.same, same.text()
    hertz = scene_hertz(made.results[0][0].scene)
    natural = made.results[0][0].scene.friction * hertz.p0
    assert same.worst["traction_y"].scale == pytest.approx(1e-6 * natural, rel=1e-9)  # a millionth, as documented
    found = outcome(changed(tmp_path / "large.nc", noise(1e-9), made), reference)
    assert {d.variable for d in found.bad} == {"traction_y", "force_y"}


def test_slip_that_is_rounding_is_not_measured_against_itself(tmp_path: Path) -> None:
    """Without creepage, where all sticks, slip and friction power are what rounding leaves: any other will do."""
    study = load_text(tmp_path, BASE + "  g:\n    scene: {creepage: {}}\n    cases: [{label: free}]\n")

    def cube(name: str, slip: float, power: float) -> Path:
        def solve(scenes: Sequence[Scene]) -> Iterator[Result]:
            for result in made_up(scenes):
                fields = dict(result.fields)
                fields |= {name: np.full_like(fields[name], slip) for name in ("slip_x", "slip_y")}
                scalars = {**result.scalars, "friction_power": power, "approach": 1e-3}
                yield replace(result, fields=fields, scalars=scalars)

        run(study, tmp_path / name, workers=1, solve=solve)
        return tmp_path / name

    reference = cube("reference.nc", 1e-15, 1e-16)
    found = outcome(cube("rounding.nc", -2e-15, -2e-16), reference)
    assert found.same, found.text()
    found = outcome(cube("slip.nc", 1e-9, 1e-9), reference)
    assert {d.variable for d in found.bad} == {"slip_x", "slip_y", "friction_power"}


def test_no_case_hides_behind_a_larger_one(tmp_path: Path) -> None:
    """A number is measured against those of its own case, whatever others are in the grid."""
    names = ("force_x", "force_y", "moment_z", "contact_area", "approach", "pressure_max", "friction_power")
    good = changed(tmp_path / "good.nc", with_scalars(**dict.fromkeys(names, 1e-5)))
    off = changed(tmp_path / "off.nc", with_scalars(**dict.fromkeys(names, 1.001e-5)))
    assert outcome(good, good).same
    assert {d.variable for d in outcome(off, good).bad} == set(names)


def test_coordinates_settings_units_and_types(tmp_path: Path, reference: Path) -> None:
    def scale(name: str, factor: float) -> Callable[[h5py.File], None]:
        def edit(file: h5py.File) -> None:
            file[name][...] = file[name][...] * factor

        return edit

    def units(file: h5py.File) -> None:
        file["pressure"].attrs["units"] = "Pa"

    def say(edit: Callable[[h5py.File], None]) -> str:
        found = outcome(edited(reference, tmp_path / "c.nc", edit), reference)
        assert not found.same
        return found.text()

    assert "coordinate x: its values differ" in say(scale("x", 1 + 1e-7))
    assert "coordinate lateral: its values differ" in say(scale("lateral", 1 + 1e-7))
    assert "modulus 105000.0, 420000.0: missing in the cube" in say(scale("modulus", 1 + 1e-7))
    assert "friction:" in say(scale("friction", 1 + 1e-7))
    assert "layer_thickness:" in say(scale("layer_thickness", 1 + 1e-7))
    assert "units 'Pa', in the reference 'MPa'" in say(units)
    tiny = outcome(edited(reference, tmp_path / "c.nc", scale("modulus", 1 + 1e-12)), reference)
    assert tiny.same, tiny.text()
    single = synthetic.write(tmp_path / "scalars.nc", synthetic.small(fields=False))
    found = outcome(single, reference)
    assert not found.same
    assert "dimension x: missing" in found.text()


def test_words_and_coordinates_that_differ_are_told(reference: Path) -> None:
    """Labels, coordinates in one cube alone and their units, and what holds numbers of another kind."""
    with open_cube(reference) as tree:
        cube = tree.to_dataset()
        labels = cube.label.copy(data=[["a"] * 3, cube.label.values[1]])
        other = cube.assign(label=labels, iterations_normal=cube.iterations_normal.astype(float))
        lateral = cube.lateral.assign_attrs(units="%")
        found = compare(xr.DataTree(other.assign_coords(lateral=lateral, more=("creepage", [1, 2, 3]))), tree)
    assert found.structure == [
        "tiny: coordinate lateral: units '%', in the reference '1'",
        "tiny: coordinate more: not in the reference",
        "tiny: variable iterations_normal: holds numbers, in the reference whole numbers",
    ]
    assert [(d.variable, d.note[:7]) for d in found.bad] == [("label", "is 'a',")] * 3


# cells that stick in one cube and slip in the other


def flip(count: int, *, at_bound: bool = True, to_exterior: bool = False) -> tuple[Change, Change]:
    """Changes for the reference and the cube: `count` slip cells of the one stick in the other, tractions the same."""

    def cells(result: Result) -> tuple[np.ndarray, np.ndarray]:
        slip = np.argwhere(result.fields["state"] == CellState.SLIP)
        return tuple(slip[:count].T)

    def lower(case: Case, result: Result) -> Result:
        if at_bound:
            return result
        where = cells(result)
        fields = {name: values.copy() for name, values in result.fields.items()}
        for name in ("traction_x", "traction_y"):
            fields[name][where] *= 1 - 1e-3
        return replace(result, fields=fields)

    def change(case: Case, result: Result) -> Result:
        where = cells(result)
        result = lower(case, result)
        fields = {name: values.copy() for name, values in result.fields.items()}
        fields["state"][where] = CellState.EXTERIOR if to_exterior else CellState.STICK
        dx, dy = case.scene.mesh.spacing
        area = result.scalars["slip_area"] - count * dx * dy
        return replace(result, fields=fields, scalars={**result.scalars, "slip_area": area})

    return lower, change


@pytest.mark.parametrize("stick_in_reference", [False, True])
def test_cells_at_the_bound_may_stick_here_and_slip_there(tmp_path: Path, stick_in_reference: bool) -> None:
    lower, change = flip(2)
    pair = [changed(tmp_path / "slip.nc", lower), changed(tmp_path / "stick.nc", change)]
    if stick_in_reference:
        pair.reverse()
    found = outcome(pair[1], pair[0])
    assert found.same, found.text()
    assert found.flips == 2
    assert "2 cells at the bound" in found.text()
    assert not outcome(pair[1], pair[0], Tolerances(state_flips=1)).same


def test_three_are_too_many(tmp_path: Path) -> None:
    lower, change = flip(3)
    pair = changed(tmp_path / "stick.nc", change), changed(tmp_path / "slip.nc", lower)
    found = outcome(*pair)
    assert {d.variable for d in found.bad} == {"state", "slip_area"}
    assert "3 at the bound (allowed 2)" in found.text()
    assert outcome(*pair, Tolerances(state_flips=3)).same
    for match, same in (("*modulus=2 Es, creepage=f", True), ("*creepage=b", False)):
        rule = Rule(match=match, state_flips=3)
        assert outcome(*pair, Tolerances(cases=[rule])).same == same


def test_cells_below_the_bound_may_not(tmp_path: Path) -> None:
    lower, change = flip(1, at_bound=False)
    found = outcome(changed(tmp_path / "stick.nc", change), changed(tmp_path / "slip.nc", lower))
    assert "state" in {d.variable for d in found.bad}
    assert "0 at the bound" in found.text()


def test_cells_below_the_bound_may_not_where_they_stick(tmp_path: Path) -> None:
    """Whatever they are where they slip, and however far apart tractions may be."""
    _, change = flip(1, at_bound=False)
    tolerances = Tolerances(variables={"traction_x": 0.01, "traction_y": 0.01})
    stick, slip = changed(tmp_path / "stick.nc", change), synthetic.write(tmp_path / "slip.nc", synthetic.small())
    for pair in ((stick, slip), (slip, stick)):
        assert "state" in {d.variable for d in outcome(*pair, tolerances).bad}


def test_contact_and_exterior_may_not_change_places(tmp_path: Path) -> None:
    """Nor beside a cell at the bound that sticks in one cube and slips in the other."""
    lower, change = flip(1, to_exterior=True)

    def also_stick(case: Case, result: Result) -> Result:
        result = change(case, result)
        state = result.fields["state"]
        state[tuple(np.argwhere(state == CellState.SLIP)[0])] = CellState.STICK
        return result

    found = outcome(changed(tmp_path / "out.nc", also_stick), changed(tmp_path / "slip.nc", lower))
    assert "state" in {d.variable for d in found.bad}


def test_the_table_follows_the_cells_let_pass(tmp_path: Path) -> None:
    lower, change = flip(2)
    made = synthetic.several()
    found = outcome(changed(tmp_path / "a.nc", change, made), changed(tmp_path / "b.nc", lower, made))
    assert found.same, found.text()
    assert found.flips == 2


# tolerances


def test_tolerances_by_variable_and_case(tmp_path: Path, reference: Path) -> None:
    other = changed(tmp_path / "c.nc", with_fields(traction_x=lambda q: q * 1.01))
    assert outcome(other, reference, Tolerances(variables={"traction_x": 0.02})).same
    assert not outcome(other, reference, Tolerances(variables={"traction_y": 0.02})).same
    assert outcome(other, reference, Tolerances(default=0.02)).same
    for pattern, same in (("tiny/*creepage=f", True), ("*", True), ("tiny/*creepage=c", False), ("other/*", False)):
        rule = Rule(match=pattern, variables={"traction_x": 0.02})
        assert outcome(other, reference, Tolerances(cases=[rule])).same == same, pattern


def test_brackets_of_labels_stand_for_themselves() -> None:
    """They were sets of characters, so that no case with a label of that kind could be named."""
    rules = [Rule(match="g/a[1]", default=0.5), Rule(match="g/[b*", default=0.25)]
    tolerances = Tolerances(default=0.0, cases=rules)
    found = {label: tolerances.of_case("g", label).default for label in ("a[1]", "a1", "[b]", "b")}
    assert found == {"a[1]": 0.5, "a1": 0.0, "[b]": 0.25, "b": 0.0}
    assert tolerances.unmatched(["g/a1", "g/[b]"]) == ["g/a[1]"]


def test_patterns_that_match_no_case_are_told(reference: Path) -> None:
    rules = [Rule(match=pattern) for pattern in ("tiny/*creepage=f", "tiny/creepage=f", "*")]
    found = outcome(reference, reference, Tolerances(cases=rules))
    assert found.same
    assert found.text().startswith("no case matches tiny/creepage=f: its tolerances are not used\nsame: ")


def test_a_tolerance_for_what_is_not_there(reference: Path) -> None:
    with pytest.raises(UserError, match=r"traction_z, .*: did you mean traction_y\? allowed: pressure, traction_x, "):
        outcome(reference, reference, Tolerances(variables={"traction_z": 0.1}))


def test_tolerances_from_a_file(tmp_path: Path) -> None:
    path = tmp_path / "t.yaml"
    path.write_text(
        "default: 1e-7\n"
        "variables: {force_x: 1e-5}\n"
        "state_flips: 4\n"
        "cases:\n"
        "  - match: figure_5/*\n"
        "    default: 1e-3\n"
        "  - match: '*creepage=e'\n"
        "    variables: {force_x: 0.5}\n"
        "    state_flips: 0\n"
    )
    found = load_tolerances(path)
    assert found.rtol("pressure") == 1e-7
    assert found.of_case("figure_6", "creepage=a").rtol("force_x") == 1e-5
    five = found.of_case("figure_5", "thickness=1 a, creepage=e")
    assert five.rtol("pressure") == 1e-3
    assert five.rtol("force_x") == 0.5
    assert five.state_flips == 0
    assert found.of_case("figure_5", "creepage=a").rtol("force_x") == 1e-5
    assert found.of_case("figure_5", "creepage=a").state_flips == 4
    options = found.with_options({"force_x": 0.25}, state_flips=1).of_case("figure_5", "creepage=e")
    assert (options.rtol("force_x"), options.state_flips) == (0.25, 1)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("default: 2\n", "t.yaml:1:10: default: 2: a number from 0 to 1"),
        ("defualt: 1e-6\n", "did you mean default"),
        ("cases: {match: x}\n", "t.yaml:1:8: cases: {match: x}: a list of mappings with match and"),
        ("cases: [1]\n", "t.yaml:1:9: cases[0]: 1: a mapping with keys match, default,"),
        ("variables: {force_x: tight}\n", "t.yaml:1:22: variables.force_x: tight: a number from 0 to 1"),
        ("variables: {force_x: 1, load: 2}\n", "t.yaml:1:31: variables.load: 2: a number from 0 to 1"),
        ("variables: [force_x]\n", "t.yaml:1:12: variables: [force_x]: a mapping of names of variables to numbers"),
        ("variables: {force: 1}\n", "t.yaml:1:13: variables.force: no variable with a tolerance: did you mean force_"),
        (
            "cases: [{match: x}, {match: y, variables: {q: 1}}]\n",
            "t.yaml:1:44: cases[1].variables.q: no variable with a tolerance: allowed: pressure, ",
        ),
        ("# nothing\n", "t.yaml:1:1: the file is empty: a mapping of tolerances, {} for the default"),
        ("state_flips: 1.5\n", "a whole number"),
        ("cases: [{variables: {force_x: 1}}]\n", "match"),
        ("default: 1e-6\ndefault: 1e-5\n", "t.yaml:2:1"),
    ],
)
def test_files_of_tolerances_that_are_wrong(tmp_path: Path, text: str, words: str) -> None:
    path = tmp_path / "t.yaml"
    path.write_text(text)
    with pytest.raises(UserError) as error:
        load_tolerances(path)
    assert words in str(error.value)


def test_options() -> None:
    assert parse_option("force_x=1e-4") == ("force_x", 1e-4)
    for text in (
        "force_x",
        "force_x=",
        "=1",
        "force_x=2",
        "force_x=nan",
        "force_x=-1",
        "force_x=\u0661",
        "force_x=0_1",
    ):
        with pytest.raises(UserError, match="VARIABLE=VALUE"):
            parse_option(text)
    assert parse_flips("12") == 12
    for text in ("\u0661", "1_0", "-1", ""):
        with pytest.raises(UserError, match="a whole number from 0 to 1000"):
            parse_flips(text)


def test_small_coordinates_beside_large_ones_are_not_taken_for_each_other() -> None:
    ours, theirs = (xr.Dataset(coords={"load": [load, 1e6]}) for load in (2e-6, 1e-6))
    assert _matches(ours, theirs, "load") == ([1], [1])
    assert _matches(ours, ours, "load") == ([0, 1], [0, 1])


def test_the_slip_area_moves_with_the_cells_let_pass_and_no_farther(tmp_path: Path) -> None:
    lower, change = flip(1)

    def farther(case: Case, result: Result) -> Result:
        result = change(case, result)
        dx, dy = case.scene.mesh.spacing
        return replace(result, scalars={**result.scalars, "slip_area": result.scalars["slip_area"] - dx * dy})

    found = outcome(changed(tmp_path / "stick.nc", farther), changed(tmp_path / "slip.nc", lower))
    assert [d.variable for d in found.bad] == ["slip_area"]


@pytest.mark.parametrize("block", [1, 2, 3, 4, 6, 32])
def test_fields_of_all_cases_are_compared_block_by_block(
    block: int, tmp_path: Path, reference: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of two times three cases; the last one, which differs, is told by its place."""
    monkeypatch.setattr(sys.modules["rcstudy.compare"], "_BLOCK", block)
    found = outcome(changed(tmp_path / "c.nc", with_fields(slip_x=lambda s: s * 1.01)), reference)
    assert [(d.variable, d.label) for d in found.bad] == [("slip_x", "modulus=2 Es, creepage=f")]


def test_natural_scales() -> None:
    """By friction 0.5, load 100 N, Hertz's radius 2 mm and pressure 30 MPa, and slip 0.013 within that radius."""
    settings = {"friction": 0.5, "load": 100.0, "hertz_radius": 2.0, "hertz_pressure": 30.0}
    settings |= {"longitudinal": 0.003, "lateral": -0.004, "spin": -0.006}
    grid = xr.Dataset({name: ("case", [value]) for name, value in settings.items()})
    expected = dict.fromkeys(("pressure", "pressure_max"), 30.0)
    expected |= dict.fromkeys(("traction_x", "traction_y", "traction_max"), 15.0)
    expected |= dict.fromkeys(("slip_x", "slip_y"), 0.013) | dict.fromkeys(("force_x", "force_y"), 50.0)
    expected |= {"moment_z": 100.0, "friction_power": 0.65}
    expected |= dict.fromkeys(("contact_area", "slip_area"), 4.0 * np.pi)
    found = {name: float(values[0]) for name, values in natural_scales(grid, ("case",)).items()}
    assert found == pytest.approx(expected, rel=1e-12)
    infinite = natural_scales(grid.assign(load=("case", [np.inf])), ("case",))  # no scale beside which nothing counts
    assert infinite["force_x"][0] == 0.0


def test_scales_of_numbers_that_may_vanish_beside_others() -> None:
    """Forces by the largest, moment over Hertz's radius among them; what slips by what touches; power by force."""
    numbers = {"friction": 0.5, "load": 100.0, "hertz_radius": 4.0, "hertz_pressure": 30.0, "spin": 0.0}
    numbers |= {"longitudinal": 0.003, "lateral": -0.004, "contact_area": 7.0}
    numbers |= {"force_x": -3.0, "force_y": 2.0, "moment_z": -20.0}
    grid = xr.Dataset({name: ("case", [value]) for name, value in numbers.items()})
    scales = shared_scales(grid, ("case",), natural_scales(grid, ("case",)))
    found = {name: float(values[0]) for name, values in scales.items() if values[0]}
    expected = {"force_x": 5.0, "force_y": 5.0, "moment_z": 20.0, "slip_area": 7.0, "friction_power": 5.0 * 0.005}
    assert found == pytest.approx(expected, rel=1e-12)


def test_numbers_that_differ_are_told_with_digits_that_differ(tmp_path: Path, reference: Path) -> None:
    def edit(file: h5py.File) -> None:
        file["load"][...] *= 1 + 3e-9

    (line, *_) = (
        line
        for line in outcome(edited(reference, tmp_path / "c.nc", edit), reference).text().splitlines()
        if "load:" in line
    )
    here, there = line.split("(allowed 1.0e-09) ")[1].split(" [")[0].split(", not ")
    assert here != there
    assert float(here) == pytest.approx(float(there) * (1 + 3e-9), rel=1e-14)


def test_worst_is_what_exceeds_its_own_tolerance_most() -> None:
    found = Comparison()
    for label, value, allowed in (("a", 0.1, 1.0), ("b", 0.01, 0.001), ("c", 0.02, 0.01)):
        found.add(Difference("grid", label, "force_x", value, allowed, 1.0))
    assert found.worst["force_x"].label == "b"
    assert [d.label for d in found.bad] == ["b", "c"]


def test_differences_are_told_once_where_there_is_a_table(tmp_path: Path, several: Path) -> None:
    other = changed(tmp_path / "c.nc", with_scalars(approach=1.01), synthetic.several())
    assert [(d.grid == TABLE, d.variable) for d in outcome(other, several).bad] == [(False, "approach")]
    rule = Rule(match="listed/*", variables={"approach": 0.02})  # in the table, too
    assert outcome(other, several, Tolerances(cases=[rule])).same


@pytest.mark.parametrize(
    ("before", "after", "variable"),
    [
        ("E: 1.0,", "E: 1.00001,", "layer_modulus"),
        ("thickness: 0.0001}", "thickness: 0.000100001}", "layer_thickness"),
        ("longitudinal: 1e-11,", "longitudinal: 1.1e-11,", "coordinate longitudinal"),
    ],
)
def test_a_setting_is_not_measured_against_a_larger_one(tmp_path: Path, before: str, after: str, variable: str) -> None:
    """A soft or thin layer over another one, a small creepage beside a larger one: 1e-9 of their own value counts."""
    layers = "[{E: 1.0, nu: 0.3, thickness: 0.0001}, {E: 2 Es, nu: 0.3, thickness: 5}]"
    creepages = "[{label: a, longitudinal: 0.01}, {label: b, longitudinal: 1e-11, spin: 0.1}]"
    text = f"{BASE}  g: {{scene: {{layers: {layers}}}, axes: {{creepage: {creepages}}}}}\n"
    assert before in text
    for name, words in (("one", text), ("two", text.replace(before, after))):
        run(load_text(tmp_path, words), tmp_path / f"{name}.nc", workers=1, solve=made_up)
    found = outcome(tmp_path / "two.nc", tmp_path / "one.nc", Tolerances(default=1.0))
    told = [d.variable for d in found.bad] + found.structure
    assert told in ([variable] * 2, [f"g: {variable}: its values differ"])


def test_labels_made_of_numbers_may_differ_as_these_may(tmp_path: Path) -> None:
    """They were compared as words, where numbers may differ by 1e-9 of their value."""
    for name, load in (("one", "100"), ("two", "100.00000005")):
        text = f"{BASE}  g: {{axes: {{load: [50, {load}], friction: [0.1, 0.3]}}}}\n"
        run(load_text(tmp_path, text), tmp_path / f"{name}.nc", workers=1, solve=made_up)
    found = outcome(tmp_path / "two.nc", tmp_path / "one.nc")
    assert found.bad == found.structure == []
    with open_cube(tmp_path / "two.nc") as tree:
        assert str(tree.to_dataset().label.values[1, 0]) == "load=100.00000005, friction=0.1"


@pytest.mark.parametrize(("kept", "compared"), [(("bare", "one"), 2), (("bare",), 1), (("one", "two"), 2)])
def test_cases_that_are_missing_may_have_had_the_most_layers(
    tmp_path: Path, kept: tuple[str, ...], compared: int
) -> None:
    """Their grid had another number of layers, and nothing of it was compared."""
    cases = {
        "bare": "{label: bare}",
        "one": "{label: one, layers: [{E: 1000, nu: 0.3, thickness: 0.02}]}",
        "two": "{label: two, coating: {layer_count: 2, thickness: 0.1, modulus: 3000}}",
    }
    paths = [tmp_path / name / "s.nc" for name in ("whole", "part")]
    for path, labels in zip(paths, (tuple(cases), kept), strict=True):
        path.parent.mkdir()
        text = f"{BASE}  g: {{cases: [{', '.join(cases[label] for label in labels)}]}}\n"
        run(load_text(path.parent, text), path, workers=1, solve=made_up)
    lost = ", ".join(label for label in cases if label not in kept)
    for ours, theirs, where in ((paths[1], paths[0], "missing in the cube"), (*paths, "not in the reference")):
        found = outcome(ours, theirs)
        assert found.structure == [f"g: case {lost}: {where}"]
        assert found.cases == compared and not found.bad


@pytest.mark.parametrize("lacking", ["pressure", "traction_y"])
def test_cells_may_not_stick_here_and_slip_there_where_nothing_tells_of_the_bound(tmp_path: Path, lacking: str) -> None:
    lower, change = flip(1)
    stick, slip = changed(tmp_path / "stick.nc", change), changed(tmp_path / "slip.nc", lower)
    with open_cube(stick) as ours, open_cube(slip) as theirs:
        found = compare(xr.DataTree(ours.to_dataset().drop_vars(lacking)), theirs)
    (note,) = [d.note for d in found.bad if d.variable == "state"]
    assert note.endswith("there, 0 at the bound (allowed 2)")


def test_what_exceeds_its_tolerance_most_is_told_first() -> None:
    found = Comparison()
    for label, value in (("a", 0.02), ("b", 0.03), ("c", 0.01)):
        found.add(Difference("grid", label, "force_x", value, 0.001, 1.0))
    lines = found.text(limit=2).splitlines()
    assert [line.split("grid: ")[-1] for line in lines[1:3]] == ["b]", "a]"]
    assert lines[3] == "  1 more"


def test_words_of_labels_are_compared_as_words() -> None:
    assert _same_words("load=50, a", "load=50.00000000001, a")
    assert not _same_words("load=50, a", "load=50, b")


def test_cells_in_both_grids_of_cases_with_padding() -> None:
    whole = np.array([[0.0, 0.1, 0.2, 0.3, 0.4], [0.0, 0.1, 0.2, 0.3, np.nan]])
    crop = np.array([[0.1, 0.2, 0.3, 0.4], [0.1, 0.2, 0.3, np.nan]])
    assert _common(whole, crop) == (slice(1, 5), slice(0, 4), True)  # behind them is padding in both
    assert _common(crop, whole) == (slice(0, 4), slice(1, 5), True)
    assert _common(whole, whole[:1]) is None  # the cells of the one vary from case to case


def test_what_each_cube_has_of_coordinates_is_compared(tmp_path: Path, reference: Path) -> None:
    with open_cube(reference) as tree:
        whole = tree.to_dataset()
        for ours, theirs, words in (
            (whole.drop_vars("lateral"), whole, "coordinate lateral: missing in the cube"),
            (whole, whole.drop_vars("lateral"), "coordinate lateral: not in the reference"),
            (whole, whole.assign(friction=whole.friction.mean("modulus")), "variable friction: dimensions are"),
        ):
            found = compare(xr.DataTree(ours), xr.DataTree(theirs))
            assert not found.same
            assert any(f"tiny: {words}" in one for one in found.structure), found.text()


def test_what_is_the_same_for_several_cases_is_not_one_value_a_case(reference: Path) -> None:
    with open_cube(reference) as tree:
        shared = xr.DataTree(tree.to_dataset().assign(force_x=lambda grid: grid.force_x.isel(modulus=0, drop=True)))
        found = compare(shared, shared)
    assert found.structure == ["tiny: variable force_x: dimensions are (creepage), not one value per case"]
