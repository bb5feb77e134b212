"""Report on a study before it is run: its grids with all values, shared work, and estimates of cost."""

from __future__ import annotations

import math
import re
import textwrap
from collections.abc import Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass

from rcstudy.cases import Axis, Case, Expansion, Grid, expand, layer_set
from rcstudy.mechanics.scene import Layer, Scene
from rcstudy.progress import counted, duration, in_bytes
from rcstudy.result import VARIABLES, Variable
from rcstudy.settings import name_with_body, unit_as_written
from rcstudy.study import Study
from rcstudy.studyfile.build import scene_hertz
from rcstudy.studyfile.spec import OutputsSpec
from rcstudy.threads import available_memory

# Estimates rest on the numbers in this block and nothing else. Measured on one core of a two-core machine of 2025 with
# kernels compiled, on 32 to 256 cells a side: bare, one soft, one very soft and two layers, with and without an elastic
# counterbody, the contact filling 2 to 52 % of the window (the last with size: auto). Times are a fifth longer than
# measured, as machines are rarely idle. Cells outside of the contact cost next to nothing, so times and sizes grow with
# the number of cells in contact.
PRESSURE_SECONDS, PRESSURE_CELL_SECONDS = 0.0013, 2e-6  # one normal problem; each cell in contact
LAYERS_SECONDS, LAYERS_CELL_SECONDS = 0.003, 1.3e-6  # influence coefficients of layers on a mesh; each cell in contact
TRACTION_SECONDS, TRACTION_CELL_SECONDS = 0.0012, 4.5e-6  # a case with creepage (newton, one-way); each cell in contact
# More cells in contact than the first of these take longer each, by their ratio to this power: transforms do not fit
# into the cache, and more products are needed. (On 512 and 1024 cells a side 2 and 3 times as long as on 256.)
MANY_CELLS, BY_MANY_CELLS = 3e4, 0.4
FULL_COUPLING_FACTOR = 2.2  # of a traction solution, besides a pressure for each case
PAPER_CG_FACTOR = 90.0  # it runs to its limit of iterations
EMPTY = 0.008  # compressed over raw size of the zeros of fields; numbers in the contact do not compress
LAYER_DEPTH = 0.5  # of the contact's radius: increase in depth by which the weight of a compliance falls to 1/e
# Stored for a group of the cube: attributes and coordinates, what describes a scalar, and a field; for a case of it:
# label and key, a scalar, the place of a field. (Measured: 1 to 1000 cases, 1 to 6 grids; compressed scalars hardly.)
GROUP_BYTES, SCALAR_BYTES, FIELD_BYTES = 9000, 900, 5500
CASE_BYTES, CASE_SCALAR_BYTES, CASE_FIELD_BYTES = 200, 8, 250
PROCESS_BYTES = 250e6  # held by an interpreter with NumPy, Numba and the compiled kernels
# Held by a solver for each cell in contact: pressure, and tractions besides; for each cell of the window. (Measured on
# 256 to 1024 cells along a side: 4200 to 5400 in all with one-way coupling, 5400 to 8800 with full, up to twice as much
# while several sets of layers are kept.)
PRESSURE_CELL_BYTES, TRACTION_CELL_BYTES, COUPLED_CELL_BYTES, WINDOW_CELL_BYTES = 1500, 3000, 7000, 30
HELD_CASE_BYTES = 3000  # held for each case by the process that deals out the work

_WIDTH = 110  # of a line of values
_SIZED = re.compile(r"[-+.\de]+ (a|Es|mm|MPa)")  # a number on an axis of relative and absolute ones
_LAYERS_SHOWN, _VALUES_SHOWN = 3, 12


@dataclass(frozen=True)
class Estimate:
    """Counts and costs of a study: seconds on one core, bytes of memory (worker, main process) and of the cube."""

    cases: int
    distinct: int
    normal_problems: int
    layer_sets: int
    seconds: float
    worker_bytes: float
    parent_bytes: float
    field_bytes: float
    file_bytes: float


def contact_cells(scene: Scene) -> float:
    """Estimated number of cells in contact: Hertz's contact with the compliances of the layers weighted by depth.

    Accurate to a twentieth without layers. With layers 0.05 to 20 times as stiff as the substrate it is mostly accurate
    to a sixth, and at most 2 times too large.
    """
    contact = scene_hertz(scene)
    other = 0.0 if scene.counterbody is None else scene.counterbody.compliance
    bare = other + scene.substrate.compliance
    wider = 1.0  # radius of the contact with layers over that of the uncoated one
    for _ in range(6):  # fixed-point iteration, as the depth that counts depends on the radius
        whole, above, depth = other, 1.0, 0.0
        for layer in scene.layers:
            depth += layer.thickness
            below = math.exp(-depth / (LAYER_DEPTH * wider * contact.radius))
            whole += (above - below) * layer.compliance
            above = below
        wider = ((whole + above * scene.substrate.compliance) / bare) ** (1.0 / 3.0)
    area = math.pi * math.prod(contact.a) * wider**2
    return math.prod(scene.mesh.cells) * min(area / math.prod(scene.mesh.size), 0.25 * math.pi)


def _slowed(cells: float) -> float:
    """The number of few cells that take as long as so many (`MANY_CELLS`)."""
    return cells * max(cells / MANY_CELLS, 1.0) ** BY_MANY_CELLS


def _pressure_seconds(cells: float) -> float:
    return PRESSURE_SECONDS + PRESSURE_CELL_SECONDS * _slowed(cells)


def _layers_seconds(scene: Scene, cells: float) -> float:
    return LAYERS_SECONDS + LAYERS_CELL_SECONDS * _slowed(cells) if scene.joined.layers else 0.0


def _traction_seconds(scene: Scene, cells: float) -> float:
    if scene.creepage is None:
        return 0.0
    seconds = TRACTION_SECONDS + TRACTION_CELL_SECONDS * _slowed(cells)
    seconds *= PAPER_CG_FACTOR if scene.method == "paper-cg" else 1.0
    return seconds * (FULL_COUPLING_FACTOR if scene.is_coupled else 1.0)


def _traction_bytes(scene: Scene, cells: float) -> float:
    if scene.creepage is None:
        return 0.0
    return cells * (COUPLED_CELL_BYTES if scene.is_coupled else TRACTION_CELL_BYTES)


def _held_bytes(group: Sequence[Case], cells: float) -> float:
    """What a worker holds for cases that share a normal problem, with so many `cells` in contact."""
    window = WINDOW_CELL_BYTES * math.prod(group[0].scene.mesh.cells)
    return window + PRESSURE_CELL_BYTES * cells + max(_traction_bytes(case.scene, cells) for case in group)


def lack_of_memory(cases: Iterable[Case], workers: int) -> str:
    """A warning if so many `workers` may need more memory than there is for the largest of `cases`; empty if not."""
    # few studies have windows so large that the size of their contacts has to be estimated
    room = available_memory() / workers - PROCESS_BYTES
    most_cells = room / (WINDOW_CELL_BYTES + PRESSURE_CELL_BYTES + COUPLED_CELL_BYTES)
    large = [case for case in cases if math.prod(case.scene.mesh.cells) > most_cells]
    held = max((_held_bytes([case], contact_cells(case.scene)) for case in large), default=0.0)
    return _beyond_memory(PROCESS_BYTES + held, workers)


def _beyond_memory(worker_bytes: float, workers: int) -> str:
    """A warning if `workers` that hold so much each may need more than there is; empty if not."""
    memory = available_memory()
    if worker_bytes * workers <= memory:
        return ""
    each = f"{in_bytes(worker_bytes)} of memory" + (f" for each of {workers} workers" if workers > 1 else "")
    return f"the largest cases need about {each}, and there are {in_bytes(memory)}: the system may end what takes more"


def _variables(cases: Sequence[Case]) -> list[Variable]:
    """What is stored of the `cases` of a grid: with tractions if any of them has creepage."""
    tangential = any(case.scene.creepage is not None for case in cases)
    return [variable for variable in VARIABLES.values() if tangential or not variable.tangential]


def _cell_bytes(cases: Sequence[Case], outputs: OutputsSpec) -> int:
    """Raw size of all fields of one cell in a grid."""
    width = {"f8": 8 if outputs.precision == "float64" else 4, "i1": 1}
    return sum(width[v.dtype] for v in _variables(cases) if v.kind == "field") if outputs.fields else 0


def _bytes_besides(cases: Sequence[Case], outputs: OutputsSpec) -> float:
    """Stored size of a grid besides the numbers of its fields."""
    stored = _variables(cases)
    fields = sum(v.kind == "field" for v in stored)
    scalars, fields = len(stored) - fields, fields if outputs.fields else 0
    group = GROUP_BYTES + SCALAR_BYTES * scalars + FIELD_BYTES * fields
    return group + len(cases) * (CASE_BYTES + CASE_SCALAR_BYTES * scalars + CASE_FIELD_BYTES * fields)


def _most_cells(cases: Sequence[Case], outputs: OutputsSpec, in_contact: Mapping[str, float]) -> float:
    """Cells stored for each of a grid's `cases`: those of its largest mesh, to which others are padded.

    If fields are cropped, about those of a box that holds the largest contact; `in_contact`: cells of contacts by key.
    """
    whole = math.prod(max(case.scene.mesh.cells[k] for case in cases) for k in (0, 1))
    if outputs.crop != "contact":
        return whole
    return min(whole, 4.0 / math.pi * max(in_contact[case.key] for case in cases))


def estimate(study: Study, expansion: Expansion) -> Estimate:
    """Counts and costs of `study`; `expansion` is its expansion."""
    groups = list(expansion.groups())
    of_grid = expansion.by_grid()
    cell_bytes = {grid: _cell_bytes(cases, study.outputs) for grid, cases in of_grid.items()}
    seconds = filled = held = 0.0
    in_contact: dict[str, float] = {}
    layers: dict[Hashable, float] = {}  # seconds of each set
    for group in groups:
        cells = contact_cells(group[0].scene)
        in_contact |= dict.fromkeys((case.key for case in group), cells)
        layers.setdefault(layer_set(group[0].scene), _layers_seconds(group[0].scene, cells))
        distinct = {case.key: case.scene for case in group}  # equal cases are solved once
        seconds += _pressure_seconds(cells) + sum(_traction_seconds(scene, cells) for scene in distinct.values())
        held = max(held, _held_bytes(group, cells))
        filled += cells * sum(cell_bytes[case.grid] for case in group)
    stored = {grid: _most_cells(cases, study.outputs, in_contact) for grid, cases in of_grid.items()}
    fields = float(sum(len(cases) * stored[grid] * cell_bytes[grid] for grid, cases in of_grid.items()))
    count = len(expansion.cases)
    besides = sum(_bytes_besides(cases, study.outputs) for cases in of_grid.values())
    return Estimate(
        cases=count,
        distinct=len({case.key for case in expansion.cases}),
        normal_problems=len(groups),
        layer_sets=len(layers),
        seconds=seconds + sum(layers.values()),
        worker_bytes=PROCESS_BYTES + held,
        parent_bytes=PROCESS_BYTES + HELD_CASE_BYTES * count,
        field_bytes=fields,
        file_bytes=filled + EMPTY * fields + besides,
    )


def plan_report(study: Study) -> str:
    """The expanded grids, shared work, and estimated memory, file size and time of `study`, as lines of text."""
    expansion = expand(study)
    total = estimate(study, expansion)
    of_grid = expansion.by_grid()
    grids = len(study.grids)
    lines = [f"study {study.name}: {counted(total.cases, 'case')} in {counted(grids, 'grid')}"]
    if study.description:
        lines.append(study.description.strip())
    for grid in expansion.grids:
        lines += ["", *_grid_lines(grid, of_grid[grid.name])]
    stored = "scalars only"
    if study.outputs.fields:
        stored = f"{study.outputs.precision} fields of {in_bytes(total.field_bytes)} before compression"
    lines += [
        "",
        "total",
        f"  cases            {total.cases}, of which {total.distinct} differ",
        f"  normal problems  {total.normal_problems}, each solved once, or once a batch where workers share its cases",
        f"  layer sets       {total.layer_sets}; workers keep influence coefficients while the bodies stay the same",
        f"  memory, about    {in_bytes(total.worker_bytes)} a worker, {in_bytes(total.parent_bytes)} the main process",
        f"  cube, about      {in_bytes(total.file_bytes)} ({stored})",
        f"  time, about      {duration(total.seconds)} of one core, divided among the workers",
        "",
        textwrap.fill(
            f"Times assume {PRESSURE_SECONDS * 1e3:g} ms a pressure, {TRACTION_SECONDS * 1e3:g} ms a traction solution "
            f"and {LAYERS_SECONDS * 1e3:g} ms a set of layers, and {PRESSURE_CELL_SECONDS * 1e6:g}, "
            f"{TRACTION_CELL_SECONDS * 1e6:g} and {LAYERS_CELL_SECONDS * 1e6:g} us more for each cell "
            f"in contact, where these are more than {MANY_CELLS:.0f} by a factor of "
            f"(cells/{MANY_CELLS:.0f})^{BY_MANY_CELLS:g}; full coupling counts {FULL_COUPLING_FACTOR:g} times, "
            f"paper-cg {PAPER_CG_FACTOR:g} times. Starting up and compiling are extra. Files assume that fields take "
            "next to no room outside of the contact, whose size is estimated: all within some factor of 2 (times on "
            "very few cells may be a third).",
            _WIDTH,
        ),
    ]
    if lacking := _beyond_memory(total.worker_bytes, 1):
        lines += ["", textwrap.fill(lacking, _WIDTH)]
    return "\n".join(lines)


def _grid_lines(grid: Grid, cases: Sequence[Case]) -> list[str]:
    lines = [f"grid {grid.name}" + (f": {grid.description.strip()}" if grid.description.strip() else "")]
    names = [name_with_body(axis.name, axis.coords[axis.name].long_name) for axis in grid.axes]
    width = max(map(len, names))
    for k, axis in enumerate(grid.axes):
        start = f"  {names[k]:{width}}  {axis.size:3d}  "
        stacks = _stacks(cases, k) if axis.name == "layers" else {}
        wrapped = textwrap.wrap(
            _values(axis, stacks, _WIDTH - len(start)),
            _WIDTH,
            initial_indent=start,
            subsequent_indent=" " * len(start),
            break_long_words=False,
            break_on_hyphens=False,
        )
        lines += [line.replace("\xa0", " ") for line in wrapped]
    scenes = [case.scene for case in cases]
    meshes = sorted({scene.mesh.cells for scene in scenes})
    mesh = " and ".join(f"{nx} x {ny}" for nx, ny in meshes[:4]) + (" and others" if len(meshes) > 4 else "")
    solved = "pressure only" if all(scene.creepage is None for scene in scenes) else "pressure and tractions"
    normals = [group[0].scene for group in Expansion((), tuple(cases)).groups()]
    lines.append(
        f"  {counted(len(cases), 'case')}, {counted(len(normals), 'normal problem')}, "
        f"{counted(len({layer_set(s) for s in scenes}), 'layer set')}; {solved}, {mesh} cells"
    )
    return [*lines, *textwrap.wrap(_contact(normals), _WIDTH, initial_indent="  ", subsequent_indent="    ")]


def _contact(scenes: Sequence[Scene]) -> str:
    """Semi-axes and largest pressure of the uncoated pairs of `scenes` after Hertz, whose size shows slips in units."""
    contacts = {scene_hertz(scene) for scene in scenes}
    x, y = (_range((contact.a[k] for contact in contacts), "mm") for k in (0, 1))
    circular = all(scene.radius[0] == scene.radius[1] for scene in scenes)
    size = f"radius {x}" if circular else f"semi-axes {x} (x), {y} (y)"
    layers = ", without layers" if any(scene.layers for scene in scenes) else ""
    return f"contact after Hertz{layers}: {size}, largest pressure {_range((c.p0 for c in contacts), 'MPa')}"


def _range(values: Iterable[float], unit: str) -> str:
    """The least and the largest of `values`, one number where they do not differ in the digits shown."""
    known = sorted(values)
    return " to ".join(dict.fromkeys(f"{value:.4g}" for value in (known[0], known[-1]))) + f" {unit}"


def _stacks(cases: Sequence[Case], k: int) -> dict[int, str]:
    """The layers at each place along axis `k`, from the surface down; none where they depend on another axis, too."""
    found: dict[int, set[tuple[Layer, ...]]] = {}
    for case in cases:
        found.setdefault(case.index[k], set()).add(case.scene.layers)
    return {i: _stack(*layers) for i, layers in found.items() if len(layers) == 1}


def _stack(layers: tuple[Layer, ...]) -> str:
    shown = [f"{layer.thickness:.6g} mm of {layer.E:.6g} MPa" for layer in layers[:_LAYERS_SHOWN]]
    more = len(layers) - len(shown)
    return ", ".join([*shown, f"{more} more"] if more else shown) or "no layers"


def _values(axis: Axis, inside: Mapping[int, str], room: int) -> str:
    """The values of an axis as written and in absolute units; spaces within a value are no-break spaces.

    `inside`: what some values stand for. A value that is longer than the `room` of a line may be broken between its
    parts.
    """
    kept = range(axis.size) if axis.size <= _VALUES_SHOWN else (*range(_VALUES_SHOWN - 1), axis.size - 1)
    texts = [f"{_value(axis, i)} ({inside[i]})" if i in inside else _value(axis, i) for i in kept]
    texts = [text.replace(" ", "\xa0") for text in texts]
    texts = [text if len(text) < room else text.replace(",\xa0", ", ").replace("\xa0(", " (") for text in texts]
    if axis.size > _VALUES_SHOWN:
        texts.insert(-1, "...")
    return ", ".join(texts)


def _value(axis: Axis, i: int) -> str:
    label = axis.labels[i]
    if axis.name == "case":  # what it stands for is in the file
        return label
    # numbers of cells are complete in the label, as they have no unit
    if label == " x ".join(str(coord.values[i]) for name, coord in axis.coords.items() if name.startswith("cells_")):
        return label
    inside = []
    for name, coord in axis.coords.items():
        value = coord.values[i]
        if name == axis.name and isinstance(value, str) and value.startswith(f"{label} "):
            label = value  # a number beside relative ones, with its unit
        elif name != axis.name and isinstance(value, str) and _SIZED.fullmatch(value) and value not in label:
            inside.append(f"{name} {value}")
        if isinstance(value, str) or name.endswith("_ratio") or (axis.name == "creepage" and value == 0.0):
            continue
        if math.isnan(value):  # the modulus of a rigid counterbody, which it does not have
            continue
        unit = f" {unit_as_written(coord.units, coord.long_name)}".rstrip()
        if name != axis.name:
            inside.append(f"{name} {value:.6g}{unit}")
        elif coord.units == "1":  # the label is complete
            continue
        elif f"{value:.12g}" == label:  # the label lacks only the unit
            label += unit
        else:
            inside.append(f"{value:.6g}{unit}")
    return f"{label} ({', '.join(inside)})" if inside else label
