"""Scenes of configs/hard.yaml on small meshes, through a sweep; and that the file covers what it is meant to."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from studies import CONFIGS
from synthetic import made_up_result, several, synthetic_tree

from rcstudy import sweep
from rcstudy.cube import case_table, open_cube
from rcstudy.mechanics.scene import Creepage, Scene
from rcstudy.report.solver import PROOFS
from rcstudy.result import VARIABLES, Status
from rcstudy.storage.layout import case_label
from rcstudy.study import Study, load_study
from rcstudy.studyfile.build import scene_hertz, with_part
from rcstudy.studyfile.grid_plan import AxisPlan, GridPlan
from rcstudy.tables import make_tables

pytestmark = pytest.mark.heavy  # windows are fitted when the file is read

PUBLISHED = CONFIGS.parent / "results" / "hard"
CELLS = 24  # at most, along each side
MOST_PRODUCTS = 10.0  # over the median
EDGE = "the contact reaches the edge of the"

SOLVED = {
    "moduli_and_thicknesses": [
        "modulus=0.0001 Es, thickness=0.001 a",
        "modulus=0.0001 Es, thickness=10 a",
        "modulus=1000 Es, thickness=0.001 a",
        "modulus=1000 Es, thickness=10 a",
    ],
    "nearly_incompressible_layers": [
        "modulus=0.001 Es, thickness=0.02 a, layer_nu=0.4999",
        "modulus=0.1 Es, thickness=0.2 a, layer_nu=0.5",
    ],
    "substrate_nu": ["nu=0.5, friction=0.1"],
    "stacks": ["layer_count=6, thickness=0.2 a, modulus=0.3 Es", "layer_count=3, thickness=0.02 a, modulus=3 Es"],
    "sandwiches": ["soft core, soft substrate", "alternating, soft on top"],
    "hard_coatings": ["E=600, thickness=0.01 a"],
    "rubber": ["substrate under full coupling", "lining of 0.1 mm"],
    "counterbodies": ["layers=stiff, counterbody=rubber"],
    "creepages": [
        "counterbody=rigid, friction=1, creepage=none",
        "counterbody=alike, friction=0.1, creepage=braking and turning",
        "counterbody=rigid, friction=0.1, creepage=very large spin",
        "counterbody=alike, friction=1, creepage=spin pole off both axes",
    ],
    "frictions": ["friction=0.01, layers=soft", "friction=2, layers=stiff"],
    "full_coupling": ["friction=1, layers=soft, creepage=spin"],
    "loads": ["load=0.001, counterbody=alike", "load=1000000, counterbody=rigid"],
    "ellipses": ["radius=2000 x 50, layers=soft, creepage=spin", "radius=50 x 2000, layers=bare, creepage=combined"],
    "wide_windows": ["one cell"],
    "tolerances": ["tolerance=1e-12, layers=soft, coupling=one-way"],
    "skins": ["layers=600 Es, friction=1, cells=64 x 64"],
    "skins_on_ellipses": [
        "friction=0.001, coupling=full, discretisation=kalker",
        "friction=0.0001, coupling=one-way, discretisation=aligned",
    ],
    "lifted": ["discretisation=aligned"],
    "pressure_only": ["cells=8 x 8, layers=stiff film"],
    "aligned": [
        "cells=13 x 13, layers=stiff film, creepage=combined",
        "cells=12 x 128, layers=bare, creepage=spin pole off both axes",
    ],
    "aligned_full_coupling": ["friction=2, layers=soft"],
    "window_edge": ["fits an ellipse"],
}
REFUSED = {
    "window_edge": ["refused", "refused on rubber", "refused on a stack", "refused without tractions"],
}


@pytest.fixture(scope="module")
def study() -> Study:
    return load_study(CONFIGS / "hard.yaml")


@pytest.fixture(scope="module")
def scenes(study: Study) -> list[Scene]:
    return [grid.scene(index) for grid in study.grids for index in grid.indices()]


def chosen(study: Study) -> GridPlan:
    """The chosen cases in one list, named by grid and label, on at most CELLS cells along each side."""
    found = {}
    for grid in study.grids:
        wanted = SOLVED.get(grid.name, []) + REFUSED.get(grid.name, [])
        for index in grid.indices():
            label = case_label(grid, index)
            if label in wanted:
                parts = grid.parts(index)
                cells = tuple(min(n, CELLS) for n in parts["mesh"]["cells"])
                found[f"{grid.name}: {label}"] = with_part(parts, "mesh.cells", cells)
    return GridPlan("chosen", "", (AxisPlan("case", "case", tuple(found), tuple(found.values())),), {})


@pytest.fixture(scope="module")
def cube(study: Study, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The chosen cases, swept."""
    path = tmp_path_factory.mktemp("hard") / "hard.nc"
    sweep.run(replace(study, grids=(chosen(study),)), path, workers=1)
    return path


@pytest.fixture(scope="module")
def table(cube: Path) -> pd.DataFrame:
    with open_cube(cube) as tree:
        return case_table(tree)


def labels(cases: dict[str, list[str]]) -> list[str]:
    return [f"{grid}: {label}" for grid, listed in cases.items() for label in listed]


def test_each_case_is_solved_or_refused_with_its_reason(table: pd.DataFrame) -> None:
    ended = table.set_index("label")
    assert set(ended.index) == {*labels(SOLVED), *labels(REFUSED)}
    unsolved = ended.loc[labels(SOLVED)].query("status != 0")
    assert unsolved.status_reason.to_dict() == {}
    refused = ended.loc[labels(REFUSED)]
    assert (refused.status == Status.REFUSED).all()
    assert refused.status_reason.str.startswith(EDGE).all()


def test_no_number_of_a_solved_case_is_missing(cube: Path, table: pd.DataFrame) -> None:
    solved = table[table.status == Status.SOLVED]
    rolling = solved[~solved.label.str.startswith("pressure_only")]
    for name, variable in VARIABLES.items():
        # an estimate of an error needs a coarser mesh, which a contact of a few cells has not
        if variable.kind == "scalar" and not name.endswith("_error"):
            values = (rolling if variable.tangential else solved)[name]
            assert np.isfinite(values).all() and (variable.dtype == "f8" or (values >= 0).all()), name
    with open_cube(cube) as tree:
        grid = tree.to_dataset().load()
    inside = grid.x_centre.notnull() & grid.y_centre.notnull()  # of a case's own mesh; padded beyond
    for name, variable in VARIABLES.items():
        if variable.kind == "field" and variable.dtype == "f8":
            index = (rolling if variable.tangential else solved).index
            there = np.isfinite(grid[name]) == inside.transpose(*grid[name].dims)
            assert bool(there.isel(case=index).all()), name


def test_no_case_needs_far_more_products_than_most(table: pd.DataFrame) -> None:
    solved = table[table.status == Status.SOLVED]
    for name in ("operator_products", "products_normal"):
        counts = solved[name][solved[name] > 0]
        assert counts.max() <= MOST_PRODUCTS * counts.median(), name


def test_table_of_the_solver_names_status_reason_and_work(cube: Path, tmp_path: Path, table: pd.DataFrame) -> None:
    with open_cube(cube) as tree:
        make_tables(tree, tmp_path)
    rows = pd.read_csv(tmp_path / "solver.csv")
    assert rows.case.to_list() == table.label.to_list()
    solved, refused = rows[rows.status == "solved"], rows[rows.status == "refused"]
    assert len(solved) + len(refused) == len(rows)
    assert solved[["iterations_normal", "products_normal", "solve_seconds"]].notna().all(axis=None)
    assert refused.reason.str.startswith(EDGE).all()
    assert refused[[*PROOFS, "operator_products"]].isna().all(axis=None)
    (total,) = pd.read_csv(tmp_path / "solver_summary.csv").itertuples()
    assert (total.cases, total.solved, total.refused) == (len(table), len(solved), len(refused))
    counts = table[table.status == Status.SOLVED].operator_products
    assert total.tangential_most == counts.max()
    assert total.tangential_median == counts[counts >= 0].median()


def test_the_file_covers_what_it_is_meant_to(study: Study, scenes: list[Scene]) -> None:
    assert len(scenes) == study.size >= 120
    layers = [(layer, scene) for scene in scenes for layer in scene.layers]
    _spans([layer.E / scene.substrate.E for layer, scene in layers], 1e-4, 1e3)
    _spans([layer.thickness / scene_hertz(scene).radius for layer, scene in layers], 1e-3, 10.0)
    _spans([scene.friction for scene in scenes], 0.01, 2.0)
    _spans([scene.load for scene in scenes], 1e-3, 1e6)
    _spans([scene_hertz(scene).a[0] / scene_hertz(scene).a[1] for scene in scenes], 0.1, 10.0)
    _spans([n for scene in scenes for n in scene.mesh.cells], 8, 256)
    _spans([scene.tolerance.tangential for scene in scenes], 1e-12, 1e-3)
    _spans([scene.tolerance.normal for scene in scenes], 1e-12, 1e-3)
    assert {0.0, 0.4999, 0.5} <= {layer.nu for layer, _ in layers}
    assert {0.0, 0.4999, 0.5} <= {scene.substrate.nu for scene in scenes}
    assert {0, 1, 2, 3, 4, 5, 6} <= {len(scene.layers) for scene in scenes}
    assert {"one-way", "full"} == {scene.coupling for scene in scenes}
    assert {"kalker", "aligned"} == {scene.discretisation for scene in scenes}
    assert len({scene.counterbody for scene in scenes}) >= 6
    creepages = [scene.creepage for scene in scenes]
    assert None in creepages and Creepage() in creepages
    spins = [abs(c.spin) for c in creepages if c is not None and c.longitudinal == c.lateral == 0.0]
    _spans([spin for spin in spins if spin > 0.0], 1e-3, 1e3)


def _spans(values: list[float], low: float, high: float) -> None:
    assert min(values) <= low * (1.0 + 1e-9) and max(values) >= high * (1.0 - 1e-9), (min(values), max(values))


def test_the_summary_has_a_row_a_grid_and_one_for_all(tmp_path: Path) -> None:
    made = several()
    case = made.results[0][0]
    made.results[0] = (case, made_up_result(case.scene, Status.NOT_CONVERGED))
    made.results[0][1].scalars["operator_products"] = 1000  # in vain
    made.results[-1][1].scalars["operator_products"] = 100
    with synthetic_tree(tmp_path, made) as tree:
        make_tables(tree, tmp_path)
    rows = pd.read_csv(tmp_path / "solver_summary.csv").set_index("grid")
    assert rows.cases.to_dict() == {"product": 4, "pressure_only": 3, "listed": 2, "all": 9}
    assert rows.not_converged.to_dict() == {"product": 1, "pressure_only": 0, "listed": 0, "all": 1}
    assert (rows.cases == rows.solved + rows.not_converged).all()
    assert np.isnan(rows.tangential_most["pressure_only"])
    assert rows.most_case["all"].startswith("listed: ")
    assert rows.tangential_most.drop("pressure_only").to_dict() == {"product": 61, "listed": 100, "all": 100}
    assert rows.seconds["all"] == pytest.approx(9 * made.results[-1][1].scalars["solve_seconds"])


def test_published_tables_are_of_these_cases(study: Study) -> None:
    """Every case in its order, and the README's counts those of the table."""
    rows = pd.read_csv(PUBLISHED / "solver.csv")
    expected = [(g.name, case_label(g, index)) for g in study.grids for index in g.indices()]
    assert list(zip(rows.grid, rows.case, strict=True)) == expected
    words = " ".join((PUBLISHED / "README.md").read_text(encoding="utf-8").split())
    counts = rows.status.value_counts()
    assert f"{len(rows)} cases: {', '.join(f'{n} {status}' for status, n in counts.items())}." in words
    solved = rows[rows.status == "solved"]
    products, normal = (solved[name][solved[name] > 0] for name in ("operator_products", "products_normal"))
    assert f"{products.median():g} products in the median and {products.max():g} at most" in words
    assert f"their pressures {normal.median():g} and {normal.max():g}" in words
    for counts in (products, normal):
        assert counts.max() <= MOST_PRODUCTS * counts.median()
