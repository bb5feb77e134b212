"""Speed against error: every case of a study over meshes, tolerances and methods is compared with a converged case.

Scenes that differ only in cells, tolerance, method, discretisation or spin point form one problem, also if few cells
make a window that is fitted to the contact wider. The reference of a problem is its solved Newton case on the finest
mesh with the tightest tolerances, in any grid of the study; if both discretisations have such a case, it is that of
`aligned`. Each case is given

- the error: its difference from the reference,
- the solver's error: its difference from the Newton case with the tightest tolerance on the same mesh and with the same
  discretisation, and
- the reference's own error, as far as it is known: the reference's difference from the next coarser mesh.

Fields are compared on the mesh of the case: the reference is averaged over each of its cells, weighted by area, and is
zero outside of its own window, which holds all of the contact. The mean is exact for stresses that are constant in each
cell, and neither meshes nor windows need to nest. With `aligned` tractions are
solved for on moved rows and stored after interpolation to the cell centres of the mesh. The stored values are compared,
so the interpolation error counts as an error of that discretisation.
"""

from __future__ import annotations

import contextlib
import math
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from rcstudy.cases import Case, expand
from rcstudy.cube import case_dims, grids, open_cube
from rcstudy.errors import UserError
from rcstudy.mechanics.scene import Mesh, Scene, Tolerance
from rcstudy.report.precision import ERRORS, REFERENCE, SOLVER, BothTolerances, Cells, Row, settings
from rcstudy.report.precision_figures import quantities_figure, tolerances_figure, work_precision
from rcstudy.report.precision_summary import FIGURES, errors_table, settings_table, summary_text
from rcstudy.report.style import check_formats, save, style
from rcstudy.report.writers import write_table
from rcstudy.result import Result, Status
from rcstudy.storage.cube_writer import write_datasets
from rcstudy.storage.earlier import refuse_cube, refuse_other_study
from rcstudy.storage.layout import CASE_KEY, LABEL, as_floats
from rcstudy.storage.publish import make_folder, replacing
from rcstudy.workers.batch import warm_up_scenes

if TYPE_CHECKING:
    from rcstudy.progress import Progress
    from rcstudy.study import Study

# axes that a problem's name in words leaves out, as they say how it is solved
_OF_SOLVING = ("coupling", "cells", "mesh", "tolerance", "normal", "tangential", "discretisation", "spin_point")
_ZERO = 1e-9  # of the largest possible value: a number below is zero up to rounding and has no relative error
_KEPT = (  # variables copied from the cube of solutions to the cube of errors
    "label",
    "status",
    "status_reason",
    "contact_radius",
    "force_x",
    "force_y",
    "moment_z",
    "pressure_max",
    "traction_max",
    "friction_power",
    "slip_area",
    "contact_area",
    "iterations_normal",
    "iterations_tangential",
    "products_normal",
    "operator_products",
    "coarse_products",
    "solve_seconds",
)
_NEEDED = (CASE_KEY, *_KEPT, "pressure", "traction_x", "traction_y")  # required in the cube of solutions
_ERRORS = "accuracy.nc"
_SECONDS, _REPEATS = 0.2, 9  # a case is solved repeatedly until one of these limits is reached
_IN_TURN = 16  # cases solved in turns


@dataclass
class Entry:
    """One case of a cube: `dataset` is its grid, `values` its scalars by name, `errors` its errors (NaN: undefined).

    `margin`: of its window if that is fitted to the contact, else None.
    """

    case: Case
    dataset: xr.Dataset
    values: dict[str, float]
    margin: float | None = None
    errors: dict[str, float] = field(default_factory=dict)
    reference: bool = False

    @property
    def scene(self) -> Scene:
        """The case's scene."""
        return self.case.scene

    @property
    def problem(self) -> Problem:
        """The problem that the case belongs to."""
        return problem(self.scene, self.margin)

    @property
    def status(self) -> Status:
        """How the case ended."""
        return Status(int(self.values["status"]))

    @property
    def cells(self) -> int:
        """Number of cells of the window."""
        return self.scene.mesh.cells[0] * self.scene.mesh.cells[1]

    @property
    def tolerance(self) -> BothTolerances:
        """Both tolerances; the looser ones are the greater."""
        return BothTolerances(self.scene.tolerance.normal, self.scene.tolerance.tangential)

    @property
    def products(self) -> float:
        """Products of the traction solver on all meshes."""
        coarse = self.values.get("coarse_products", 0.0)
        return self.values["operator_products"] + (coarse if np.isfinite(coarse) else 0.0)

    def at(self, name: str) -> Any:
        """Variable `name` of the cube at this case, without dimensions."""
        return self._case_of(self.dataset[name]).values[()]

    def _case_of(self, variable: xr.DataArray) -> xr.DataArray:
        return variable.isel(dict(zip(case_dims(self.dataset), self.case.index, strict=True)))

    def stress(self) -> np.ndarray:
        """Pressure and tractions x, y on the window, MPa: [3, nx, ny]."""
        nx, ny = self.scene.mesh.cells
        names = ("pressure", "traction_x", "traction_y")
        return np.stack([self._case_of(self.dataset[n]).transpose("x", "y").values[:nx, :ny] for n in names])


Problem = tuple[Scene, float | None]
"""What all cases with the same exact solution have in common: scene, and margin of a window fitted to the contact."""

_ANY_SIZE = (1.0, 1.0)  # placeholder for the size of a fitted window (mm)


def problem(scene: Scene, margin: float | None = None) -> Problem:
    """`scene` without the settings of its solution: equal for all cases that have the same exact solution.

    A window that is fitted to the contact, by `margin`, counts as what was asked for: few cells make it wider. The
    `margin` of other windows is None.
    """
    plain = Mesh(scene.mesh.size if margin is None else _ANY_SIZE, (1, 1))
    bare = replace(scene, mesh=plain, tolerance=Tolerance(), method="newton", discretisation="kalker", spin_point=0.0)
    return bare, margin


def margin_of(case: Case, study: Study) -> float | None:
    """The margin of the window of a case of `study` if it is fitted to the contact, else None."""
    plan = next(plan for plan in study.grids if plan.name == case.grid)
    mesh = plan.parts(case.index)["mesh"]  # the scene has no more than the size that came of it
    margin: float | None = mesh["margin"] if mesh["size"] is None else None
    return margin


def timed(scenes: Sequence[Scene]) -> Iterator[Result]:
    """Yield the result of each scene solved by itself; `solve_seconds` is the processor time of its fastest solve.

    Short solves are repeated, in turns with those of the scenes beside it: what slows a machine down lasts longer than
    such a solve, and repeats in a row would all be slow. Nothing is kept between solves except what depends on array
    lengths only: FFT plans and the kernels of the Hankel transforms, which take 3 to 5 ms in the first layered solve of
    a process. Every time is therefore that of a whole solve, influence coefficients and pressure included. It is
    processor time, in which waiting for other programs does not count.
    """
    from rcstudy.mechanics.contact import forget_influence
    from rcstudy.solve import solve_scene

    for first in range(0, len(scenes), _IN_TURN):
        turn = scenes[first : first + _IN_TURN]
        results = [Result(Status.ERROR)] * len(turn)
        seconds: list[list[float]] = [[] for _ in turn]  # of all solves of a scene
        # the first solution of its kind on a machine compiles some of the code: it is not the only one
        while again := [k for k, s in enumerate(seconds) if len(s) < 2 or (sum(s) < _SECONDS and len(s) < _REPEATS)]:
            for k in again:
                forget_influence()
                begun = time.process_time()
                results[k] = solve_scene(turn[k])
                seconds[k].append(time.process_time() - begun)
        for result, of_solves in zip(results, seconds, strict=True):
            result.scalars["solve_seconds"] = min(of_solves)
            yield result


def run(
    study: Study,
    out: Path,
    cube: xr.DataTree | None = None,
    progress: Progress | None = None,
    formats: Sequence[str] = ("png", "pdf"),
) -> list[Path]:
    """Solve `study`, or take its solutions from an opened `cube`; write errors, tables, figures, summary into `out`.

    Returns the files written: the cube of errors `accuracy.nc`, the solutions it was made from unless `cube` was given,
    tables `errors` and `settings`, figures `work_precision`, `quantities` and `tolerances` in `formats` as far as the
    study has cases for them, `summary.md`.
    UserError when the cube is not of this study, stores no fields, or no problem of it has a solved reference.
    """
    check_formats(formats)
    if not study.outputs.fields:
        study.refuse("outputs", "fields", allowed="errors of pressure and tractions need the fields: true")
    if study.outputs.crop != "none":
        study.refuse("outputs", "crop", allowed="errors of pressure and tractions need the whole window: none")
    rolling = {(c.scene, margin_of(c, study)) for c in expand(study).cases if c.scene.creepage is not None}
    problems = Counter(problem(*solved) for solved in rolling)
    if max(problems.values(), default=0) < 2:
        raise UserError(
            f"{study.path}: no problem of rolling (with creepage) is solved with more than one mesh, tolerance, method "
            "or discretisation: there is nothing to measure errors against"
        )
    refuse_cube(out / _ERRORS)
    entries = None if cube is None else measured(study, cube)  # before a folder is made for what may be refused
    make_folder(out)
    paths: list[Path] = []
    with contextlib.ExitStack() as stack:
        if cube is None or entries is None:
            solutions = _solved(study, out, progress)
            paths.append(solutions)
            cube = stack.enter_context(open_cube(solutions))
            entries = measured(study, cube)
        paths.append(_write_errors(out / _ERRORS, cube, entries))
        paths += write_report(entries, out, formats)
    return paths


def _solved(study: Study, out: Path, progress: Progress | None) -> Path:
    """Path of the cube of solutions of `study` in the folder `out`, its scenes solved by `timed`."""
    from rcstudy import sweep
    from rcstudy.storage.units import unit_paths
    from rcstudy.store import units_folder

    cube = out / "solutions.nc"
    for _ in timed(warm_up_scenes(study)):
        pass
    refuse_other_study(cube, study.name)
    # every run measures all times anew, unless it resumes one that was interrupted
    fresh = not unit_paths(units_folder(cube))
    sweep.run(study, cube, workers=1, progress=progress, solve=timed, fresh=fresh)
    return cube


def measured(study: Study, tree: xr.DataTree) -> list[Entry]:
    """All rolling cases of an opened cube of `study` with their errors, in the order of grids and indices.

    UserError when the cube lacks variables or parts of fields, is of another study, or no problem has a reference.
    """
    datasets = grids(tree)
    cube = tree.encoding.get("source", "the cube")
    cases = expand(study).cases
    rolling = [case for case in cases if case.scene.creepage is not None]
    for name in dict.fromkeys(case.grid for case in rolling):
        if name in datasets and (missing := [n for n in _NEEDED if n not in datasets[name].variables]):
            raise UserError(f"{cube}: has no {', '.join(missing)} in grid {name}: run without --cube")
    if any(not _holds(datasets.get(case.grid), case) for case in cases):
        raise UserError(f"{cube}: is not of the study {study.path} as it is now: run without --cube")
    # no contact fills its window: cropped fields are smaller than the largest
    if any(datasets[c.grid].sizes[dim] < n for c in rolling for dim, n in zip("xy", c.scene.mesh.cells, strict=True)):
        raise UserError(f"{cube}: stores parts of the fields, not whole windows (outputs: crop): run without --cube")
    entries = [_entry(case, margin_of(case, study), datasets[case.grid]) for case in rolling]
    order = list(datasets)
    entries.sort(key=lambda e: (order.index(e.case.grid), e.case.index))
    of_problem: dict[Problem, list[Entry]] = {}
    for entry in entries:
        of_problem.setdefault(entry.problem, []).append(entry)
    found = False
    for group in of_problem.values():
        found = _measure(group) or found
    if not found:
        raise UserError(f"{study.path}: no problem has a solved case of method newton to serve as its reference")
    return entries


def _holds(dataset: xr.Dataset | None, case: Case) -> bool:
    """Whether the grid `dataset` of a cube (None: there is none) holds `case` at the index of `case`."""
    if dataset is None or len(case.index) != len(case_dims(dataset)):
        return False
    keys = dataset[CASE_KEY]
    return all(i < n for i, n in zip(case.index, keys.shape, strict=True)) and keys.values[case.index] == case.key


def _entry(case: Case, margin: float | None, dataset: xr.Dataset) -> Entry:
    at = dict(zip(case_dims(dataset), case.index, strict=True))
    values = {}
    for name, variable in dataset.data_vars.items():
        if set(variable.dims) == at.keys() and variable.dtype.kind in "fi":
            values[str(name)] = float(as_floats(variable.isel(at).values))
    return Entry(case, dataset, values, margin)


def _measure(group: list[Entry]) -> bool:
    """Set the errors of the cases of one problem; False if it has no reference."""
    exact = [e for e in group if e.scene.method == "newton" and e.status is Status.SOLVED]
    if not exact:
        return False
    finest = min(exact, key=_rank)
    finest.reference = True
    tightest: dict[Any, Entry] = {}
    for e in exact:
        key = _equations(e.scene)
        tightest[key] = min(tightest.get(key, e), e, key=lambda e: e.tolerance)
    fields = {key: e.stress() for key, e in tightest.items()}
    own = [e for e in tightest.values() if _equations(e.scene)[1:] == _equations(finest.scene)[1:]]
    coarser = max((e for e in own if e.cells < finest.cells), key=lambda e: (e.cells, e.scene.mesh.cells), default=None)
    means: dict[tuple[Any, Mesh], np.ndarray] = {}

    def onto(other: Entry, mesh: Mesh) -> np.ndarray:
        """Fields of the solution `other`, averaged over the cells of `mesh`: [3, nx, ny]."""
        key = _equations(other.scene), mesh
        if key not in means:
            means[key] = averaged(fields[key[0]], other.scene.mesh, mesh)
        return means[key]

    for e in group:
        stress, mesh = e.stress(), e.scene.mesh
        if not np.isfinite(stress).all():
            continue
        if mesh.cells != finest.scene.mesh.cells:
            e.errors |= _differences(e, stress, finest, onto(finest, mesh))
            if coarser is not None:
                doubts = _differences(coarser, onto(coarser, mesh), finest, onto(finest, mesh))
                e.errors |= {REFERENCE + name: value for name, value in doubts.items()}
        same = tightest.get(_equations(e.scene))
        if same is not None and same is not e:
            solver = _differences(e, stress, same, fields[_equations(e.scene)])
            e.errors |= {SOLVER + name: value for name, value in solver.items()}
    return True


def _rank(e: Entry) -> Any:
    """Sort key of solved Newton cases of one problem, the reference first.

    Number of cells along x and spin point decide where the rest leaves it open, so that the order of cases never does.
    """
    return -e.cells, e.tolerance, e.scene.discretisation != "aligned", e.scene.mesh.cells, e.scene.spin_point


def _equations(scene: Scene) -> Any:
    """What distinguishes the discrete equations of `scene` from others of its problem."""
    return scene.mesh.cells, scene.discretisation, scene.spin_point


def averaged(values: np.ndarray, mesh: Mesh, onto: Mesh) -> np.ndarray:
    """Means [..., mx, my] over the cells of `onto` of `values` [..., nx, ny] that are constant in each cell of `mesh`.

    Outside of the window of `mesh` the values are 0. Both windows are centred on the origin.
    """
    along_x, along_y = (_overlaps(mesh.size[k], mesh.cells[k], onto.size[k], onto.cells[k]) for k in (0, 1))
    means: np.ndarray = along_x @ values @ along_y.T
    return means


def _overlaps(size: float, cells: int, onto_size: float, onto_cells: int) -> np.ndarray:
    """Share of each of the `onto_cells` cells that is covered by each of the `cells` cells: [onto_cells, cells].

    Both divide lengths centred on 0 into equal cells.
    """
    edges = (np.arange(cells + 1) / cells - 0.5) * size
    onto = (np.arange(onto_cells + 1) / onto_cells - 0.5) * onto_size
    low = np.maximum(edges[None, :-1], onto[:-1, None])
    high = np.minimum(edges[None, 1:], onto[1:, None])
    shares: np.ndarray = np.clip(high - low, 0.0, None) / (onto_size / onto_cells)
    return shares


def _differences(e: Entry, stress: np.ndarray, other: Entry, reference: np.ndarray) -> dict[str, float]:
    """The ERRORS of `e` with fields `stress` against `other` with fields `reference`, both [3, nx, ny] on one mesh."""
    own, true = e.values, other.values
    traction = other.scene.friction * other.scene.load
    moment = traction * true["contact_radius"]

    def relative(name: str, largest: float = 0.0) -> float:
        return _ratio(abs(own[name] - true[name]), abs(true[name]), _ZERO * largest)

    force = np.hypot(own["force_x"] - true["force_x"], own["force_y"] - true["force_y"])
    return {
        "pressure": _ratio(np.linalg.norm(stress[0] - reference[0]), np.linalg.norm(reference[0])),
        "pressure_max": relative("pressure_max"),
        "traction": _ratio(np.linalg.norm(stress[1:] - reference[1:]), np.linalg.norm(reference[1:])),
        "traction_max": relative("traction_max"),
        "force": _ratio(force, np.hypot(true["force_x"], true["force_y"]), _ZERO * traction),
        "moment": relative("moment_z", moment),
        # without slip the power is what the solver's tolerance leaves of nothing
        "friction_power": relative("friction_power") if true["slip_area"] > 0.0 else math.nan,
        "slip_area": relative("slip_area"),
    }


def write_report(entries: Sequence[Entry], out: Path, formats: Sequence[str]) -> list[Path]:
    """Write tables `errors` and `settings`, the figures that the study has cases for and `summary.md` into `out`."""
    rows = report_rows(entries)
    chosen = settings(rows)
    paths = write_table(out, "errors", *errors_table(rows))
    paths += write_table(out, "settings", *settings_table(chosen))
    drawn = []
    with style():
        for name, draw in zip(FIGURES, (work_precision, quantities_figure, tolerances_figure), strict=True):
            figure = draw(rows)
            if figure is not None:
                drawn.append(name)
                paths += save(figure, out, name, formats)
    summary = out / "summary.md"
    with replacing(summary) as temporary:
        temporary.write_text(summary_text(rows, chosen, coupling_errors(entries), drawn), encoding="utf-8")
    return [*paths, summary]


def report_rows(entries: Sequence[Entry]) -> list[Row]:
    """The cases as rows of the report; problems are numbered in the order in which they occur."""
    numbers: dict[Problem, int] = {}
    rows = []
    for e in entries:
        scene, values = e.scene, e.values
        rows.append(
            Row(
                grid=e.case.grid,
                label=str(e.at(LABEL)),
                problem=numbers.setdefault(e.problem, len(numbers)),
                method=scene.method,
                discretisation=scene.discretisation,
                coupling=scene.coupling,
                cells=Cells(*scene.mesh.cells),
                radius=values["contact_radius"] / math.sqrt(math.prod(scene.mesh.spacing)),
                tolerance=e.tolerance,
                status=e.status.words,
                products=e.products,
                iterations_normal=values["iterations_normal"],
                iterations_tangential=values["iterations_tangential"],
                seconds=values["solve_seconds"],
                errors=e.errors,
                reference=e.reference,
            )
        )
    return rows


def coupling_errors(entries: Sequence[Entry]) -> list[tuple[str, dict[str, float]]]:
    """Name and ERRORS of each problem with references for both couplings on one mesh: one-way against full."""
    references: dict[Problem, dict[str, Entry]] = {}
    for e in entries:
        if e.reference:
            alike = problem(replace(e.scene, coupling="one-way"), e.margin)
            references.setdefault(alike, {})[e.scene.coupling] = e
    found = []
    for both in references.values():
        if len(both) == 2 and both["one-way"].scene.mesh == both["full"].scene.mesh:
            one, full = both["one-way"], both["full"]
            parts = str(full.at(LABEL)).split(", ")
            name = ", ".join(p for p in parts if p.split("=")[0] not in _OF_SOLVING)
            found.append((f"{full.case.grid}: {name}", _differences(one, one.stress(), full, full.stress())))
    return found


def _ratio(size: Any, scale: Any, zero: float = 0.0) -> float:
    """`size` over `scale`; NaN if `scale` does not exceed `zero`."""
    return float(size) / float(scale) if scale > zero else float("nan")


def _write_errors(path: Path, tree: xr.DataTree, entries: Sequence[Entry]) -> Path:
    """Write the cube's grids to `path` without their fields, but with the errors of each case; returns `path`.

    Variables: `error_<name>`, `solver_error_<name>`, `reference_error_<name>`.
    """
    nodes: dict[str, xr.Dataset] = {}
    for name, dataset in grids(tree).items():
        own = [e for e in entries if e.case.grid == name]
        if not own:
            continue
        dims = case_dims(dataset)
        slim = dataset[[n for n in _KEPT if n in dataset.variables]]
        slim = slim.drop_vars([n for n in slim.coords if not set(slim[n].dims) <= set(dims)]).load()
        for prefix, words in (
            ("", "error against the converged reference"),
            (SOLVER, "error against the tightest solution on the same mesh"),
            (REFERENCE, "difference of the converged reference from the next coarser mesh"),
        ):
            for quantity, what in ERRORS.items():
                values = np.full(tuple(dataset.sizes[d] for d in dims), np.nan)
                for e in own:
                    values[e.case.index] = e.errors.get(prefix + quantity, np.nan)
                attrs = {"units": "1", "long_name": f"{words}: {what}"}
                slim[f"{prefix}error_{quantity}"] = (dims, values, attrs)
        slim["solve_seconds"].attrs["long_name"] = "time of the whole solve: processor time if made by this command"
        nodes[f"/{name}"] = slim
    attrs = {
        str(k): v for k, v in tree.attrs.items() if k not in ("axes", "grid", "grid_description", "rcstudy_schema")
    }
    nodes["/"] = xr.Dataset(attrs=attrs)
    write_datasets(path, nodes)
    return path
