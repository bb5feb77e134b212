"""Benchmark of the solver, one thread; prints Markdown tables.

Usage: python scripts/benchmark.py [--parts a,b] [--repeats 9] [--cells 64,128,256,512] [--large] [--json FILE]

a  whole solves against CONTACT, in units of one SciPy rfft2 + irfft2 of the doubled window, measured in between
b  products and iterations over meshes, and for contacts of all kinds
c  time of the parts of a solve, and time of the tractions against that of their FFTs alone
d  the paper's 48 layered cases at 1e-6
e  full coupling against one-way
f  cases a second of a sweep with one and two workers
g  the paper's study, whole command
h  aligned cells against kalker, the paper's rolling cases

Times of one thread (a to e and h) are processor time, which other programs disturb less, and medians of the repeats
unless stated otherwise; f and g are wall time. `--large` adds 1024 cells to a, b and c.
"""

from __future__ import annotations

import argparse
import contextlib
import functools
import importlib
import json
import os
import platform
import statistics
import subprocess
import sys
import tempfile
import time
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator
from dataclasses import asdict, replace
from operator import itemgetter
from pathlib import Path
from typing import Any, TypeVar, get_args

from rcstudy.threads import THREAD_VARIABLES, available_cores

os.environ.update(dict.fromkeys(THREAD_VARIABLES, "1"))

import numpy as np
import pyfftw
import scipy.fft
from aligned_errors import rolling_groups

import rcstudy
from rcstudy import provenance, sweep
from rcstudy.cases import expand
from rcstudy.mechanics import contact, convolution, influence, layered, normal, proof
from rcstudy.mechanics.scene import Creepage, Discretisation, Layer, Material, Mesh, Scene, Tolerance
from rcstudy.progress import Silent
from rcstudy.result import Status
from rcstudy.study import load_study
from rcstudy.studyfile.build import fitted_size

solve = importlib.import_module("rcstudy.solve")  # the package's own `solve` is a function
ROOT = Path(__file__).resolve().parent.parent
PAPER = ROOT / "configs" / "paper.yaml"
STEEL = Material(210000.0, 0.3)
CONTACT_UNITS = {64: 270.0, 128: 277.0, 256: 412.0, 512: 630.0}
TARGETS = {64: 9.0, 128: 14.0, 256: 25.0, 512: 40.0}
ALL_PARTS = "abcdefgh"
_FAR = 1e-9  # tolerance of the solution against which errors of tractions are measured
_RUN = 25e-3  # seconds of a run of solves, as of a unit: a single short solve after a unit would find the caches cold

Clock = time.process_time


def uncoated(cells: int) -> Scene:
    """The scene that CONTACT was measured on: equal elastic bodies, 2 x 2 mm, tolerances 1e-5."""
    return Scene(
        STEEL,
        (50.0, 50.0),
        100.0,
        Mesh((2.0, 2.0), (cells, cells)),
        counterbody=STEEL,
        creepage=Creepage(0.002, 0.001, 0.01),
        tolerance=Tolerance(1e-5, 1e-5),
    )


def coated(cells: int, layers: tuple[Layer, ...]) -> Scene:
    """The same with layers under a rigid body."""
    return replace(uncoated(cells), layers=layers, counterbody=None)


A = 0.2533  # Hertz's radius (mm) under the rigid body
SCENES: dict[str, Callable[[int], Scene]] = {
    "no layer": uncoated,
    "one layer": lambda n: coated(n, (Layer(105000.0, 0.3, 0.5 * A),)),
    "two layers": lambda n: coated(n, (Layer(840000.0, 0.3, 0.25 * A), Layer(420000.0, 0.3, 0.25 * A))),
}


def forget() -> None:
    """Empty all caches of the mechanics except those that depend on lengths only, so that the next solve is complete.

    Kept are FFT plans, good lengths for them, and the kernels of the Hankel transforms (`hankel._kernels`, made once
    for a length), which take 3 to 5 ms in the first layered solve of a process.
    """
    for module in (contact, influence, normal, proof, solve, layered):
        for value in list(vars(module).values()):
            inner = getattr(value, "cache_clear", None)
            if inner is not None and value not in (convolution.transform, convolution.good_length):
                inner()


def whole(scene: Scene) -> tuple[float, Any]:
    """Seconds and result of one whole solve: coefficients, pressure, tractions, proof."""
    forget()
    begun = Clock()
    result = solve.solve_scene(scene)
    seconds = Clock() - begun
    if result.status not in (Status.SOLVED, Status.PROOF_FAILED):
        raise SystemExit(f"{scene}: {result.reason}")
    return seconds, result


def fft_pair(cells: int) -> float:
    """Seconds of one SciPy rfft2 + irfft2 of 2N x 2N float64 numbers, one thread: the mean of enough of them."""
    field = np.random.default_rng(1).standard_normal((2 * cells, 2 * cells))
    count = max(2, round(60e6 / field.size / np.log2(field.size) / 2))
    begun = Clock()
    for _ in range(count):
        scipy.fft.irfft2(scipy.fft.rfft2(field, workers=1), s=field.shape, workers=1)
    return (Clock() - begun) / count


def repeats_of(cells: int, repeats: int) -> int:
    """`repeats` for 256 cells; fewer for longer solves, more for shorter ones, which other programs disturb more."""
    return max(3, repeats * 256 // cells)


def table(titles: list[str], rows: list[list[Any]]) -> None:
    """Print a Markdown table; floats with three significant digits."""
    print("| " + " | ".join(titles) + " |")
    print("|" + " --- |" * len(titles))
    for row in rows:
        print("| " + " | ".join(f"{v:.3g}" if isinstance(v, float) else str(v) for v in row) + " |")
    print(flush=True)


Key = TypeVar("Key")

KEYS_A = (
    *("scene", "cells", "milliseconds", "least_milliseconds", "wall_milliseconds", "unit_milliseconds"),
    *("median_unit_milliseconds", "units", "contact_units", "speedup", "aim", "error"),
)


def error_of_tractions(scene: Scene) -> float:
    """Relative error (L2) of the tractions of `scene` against the solution of the same equations at tolerance _FAR."""
    ours, far = (
        np.stack([whole(s)[1].fields[name] for name in ("traction_x", "traction_y")])
        for s in (scene, replace(scene, tolerance=Tolerance(_FAR, _FAR)))
    )
    return float(np.linalg.norm(ours - far) / np.linalg.norm(far))


def part_a(options: argparse.Namespace) -> Any:
    """Whole solves against CONTACT."""
    print("## a. Whole solves\n")
    print(
        "One unit: one SciPy `rfft2` + `irfft2` of the doubled window. CONTACT: its better solver on the first scene.\n"
    )
    print("Solves and units are means of runs of some 25 ms, or of one solve; faster by: least against least.")
    print(f"Error: of the tractions, L2, against the same equations at a tolerance of {_FAR:g}; asked for: 1e-5.\n")
    scenes = {(name, n): make(n) for name, make in SCENES.items() for n in options.cells}
    counts = {}
    for key, scene in scenes.items():
        whole(scene)
        counts[key] = max(1, round(_RUN / whole(scene)[0]))
    samples: dict[tuple[str, int], list[float]] = {key: [] for key in scenes}
    walls: dict[tuple[str, int], list[float]] = {key: [] for key in scenes}
    units: dict[int, list[float]] = {n: [] for n in options.cells}
    # scenes take turns, as the machine is faster or slower for seconds at a time
    for key in turns({key: repeats_of(key[1], options.repeats) for key in scenes}):
        units[key[1]].append(fft_pair(key[1]))
        wall = time.perf_counter()
        samples[key].append(sum(whole(scenes[key])[0] for _ in range(counts[key])) / counts[key])
        walls[key].append((time.perf_counter() - wall) / counts[key])
    found: list[dict[str, Any]] = []
    for name, n in scenes:
        unit, least = min(units[n]), min(samples[name, n])
        row: dict[str, Any] = {
            "scene": name,
            "cells": n,
            "milliseconds": 1e3 * statistics.median(samples[name, n]),
            "least_milliseconds": 1e3 * least,
            "wall_milliseconds": 1e3 * statistics.median(walls[name, n]),
            "unit_milliseconds": 1e3 * unit,
            "median_unit_milliseconds": 1e3 * statistics.median(units[n]),
            "units": least / unit,
            "error": f"{error_of_tractions(scenes[name, n]):.1e}",
        }
        if name == "no layer" and n in CONTACT_UNITS:
            speedup = CONTACT_UNITS[n] / row["units"]
            row |= {"contact_units": CONTACT_UNITS[n], "speedup": speedup, "aim": TARGETS[n]}
        found.append(row)
    rows = [[row.get(key, "") for key in KEYS_A] for row in found]
    titles = ["scene", "cells", "ms", "least", "wall", "unit, least", "median", "units", "CONTACT", "faster by", "aim"]
    table([*titles, "error"], rows)
    for name in SCENES:
        times = {n: min(samples[name, n]) for n in options.cells}
        if len(times) > 1:
            exponent = float(np.polyfit(np.log(list(times)), np.log(list(times.values())), 1)[0])
            found.append({"scene": name, "exponent": exponent})
            print(f"Time grows like cells^{exponent:.2f} along one side: {name}.")
    print()
    return found + called_from_python(options)


def called_from_python(options: argparse.Namespace) -> list[dict[str, Any]]:
    """`rcstudy.solve` on the scene that CONTACT was measured on, beside the solver alone; prints a table."""
    print("The first scene by `rcstudy.solve`, from a mapping to a Dataset, and the solver alone, in turns; ms, least.")
    print("Coefficients are those of the call before, as in a loop over creepages.\n")
    found = []
    for n in options.cells:
        scene = uncoated(n)
        ways = {
            "rcstudy.solve": functools.partial(rcstudy.solve, asdict(scene)),
            "solver alone": functools.partial(solve.solve_scene, scene),
        }
        least = dict.fromkeys(ways, float("inf"))
        count = max(1, 1024 // n)
        for _ in range(repeats_of(n, options.repeats)):
            for name, way in ways.items():
                begun = Clock()
                for _ in range(count):
                    way()
                least[name] = min(least[name], 1e3 * (Clock() - begun) / count)
        found.append({"cells": n, **least})
    table(["cells", *ways], [list(row.values()) for row in found])
    return found


def turns(counts: dict[Key, int]) -> Iterator[Key]:
    """Each key as often as `counts` says, evenly spread."""
    places = [((k + 0.5) / count, key) for key, count in counts.items() for k in range(count)]
    yield from (key for _, key in sorted(places, key=itemgetter(0)))


def part_b(options: argparse.Namespace) -> Any:
    """Products and iterations over meshes."""
    print("## b. Products\n")
    print("Products of the traction solver count applications of the operator and of its preconditioner.\n")
    found = []
    for name, make in SCENES.items():
        for n in options.cells:
            numbers = whole(make(n))[1].scalars
            found.append(
                {
                    "scene": name,
                    "cells": n,
                    "pressure steps": int(numbers["iterations_normal"]),
                    "pressure products": int(numbers["products_normal"]),
                    "Newton steps": int(numbers["iterations_tangential"]),
                    "own mesh": int(numbers["operator_products"]),
                    "coarser meshes": int(numbers["coarse_products"]),
                }
            )
    table(list(found[0]), [list(row.values()) for row in found])
    contacts = of_all_kinds()
    print(f"Contacts of {len(contacts)} pairs of bodies, each under {len(contacts[0])} creepages from next to none to")
    print("full slip, some 52 cells across on 64 x 64. ", end="")
    return {"scenes": found, "all kinds": growth(contacts, [n for n in options.cells if n <= 512])}


def of_all_kinds() -> list[list[Scene]]:
    """Scenes of one normal problem each, in windows that fit: homogeneous bodies, layers and films, all creepages."""
    pairs: list[tuple[tuple[Layer, ...], Material | None]] = [
        ((), STEEL),
        ((), None),
        ((), Material(70000.0, 0.33)),  # aluminium
        ((Layer(52500.0, 0.3, 0.1),), None),
        ((Layer(840000.0, 0.3, 0.1),), None),
        ((Layer(500000.0, 0.25, 0.003),), STEEL),
        ((Layer(1000.0, 0.3, 0.02),), None),
        ((Layer(1000.0, 0.49, 0.02),), None),
        ((Layer(5.0, 0.4999, 1.0),), None),  # rubber
    ]
    # over friction times the radius of the contact over that of the ball, about the creepage of full slip
    partial = (0.1, 0.05, 0.0), (0.5, 0.0, 0.0), (0.0, 0.5, 0.0), (0.0, 0.0, 0.75), (0.5, 0.25, 0.5)
    creepages = *partial, (2.0, 0.0, 0.0), (0.0, 0.0, 3.0), (2.0, 1.0, 2.0)
    found = []
    for layers, counterbody in pairs:
        scene = Scene(STEEL, (50.0, 50.0), 100.0, Mesh((1.0, 1.0), (64, 64)), layers, counterbody, friction=0.3)
        scene = replace(scene, mesh=Mesh(fitted_size(scene, 1.25, (64, 64)), (64, 64)))
        radius = float(np.sqrt(np.prod(normal.estimated_contact(scene))))
        scale = scene.friction * radius / scene.radius[0]
        found.append(
            [replace(scene, creepage=Creepage(x * scale, y * scale, r * scale / radius)) for x, y, r in creepages]
        )
    return found


class Stopwatch:
    """Measures the seconds spent in parts of the program, each without the parts that it calls."""

    def __init__(self) -> None:
        self.seconds: defaultdict[str, float] = defaultdict(float)
        self._stack: list[tuple[str, float]] = []

    def wrap(self, function: Callable[..., Any], part: str) -> Callable[..., Any]:
        """`function` wrapped such that its time counts as that of `part`."""

        @functools.wraps(function)
        def run(*args: Any, **kwargs: Any) -> Any:
            now = Clock()
            if self._stack:
                outer, since = self._stack[-1]
                self.seconds[outer] += now - since
            self._stack.append((part, now))
            try:
                return function(*args, **kwargs)
            finally:
                now = Clock()
                name, since = self._stack.pop()
                self.seconds[name] += now - since
                if self._stack:
                    self._stack[-1] = (self._stack[-1][0], now)

        return run


@contextlib.contextmanager
def patched(*replacements: tuple[Any, str, Any]) -> Iterator[None]:
    """Replace attributes (owner, name, value) inside the block."""
    before = [(owner, name, getattr(owner, name)) for owner, name, _ in replacements]
    try:
        for owner, name, value in replacements:
            setattr(owner, name, value)
        yield
    finally:
        for owner, name, value in before:
            setattr(owner, name, value)


PARTS = ("coefficients", "their transforms", "pressure", "tractions", "proof", "rest")


def breakdown(scene: Scene) -> dict[str, float]:
    """Seconds of one whole solve by PARTS."""
    watch = Stopwatch()
    parts = [
        (influence.Influence, "__init__", "coefficients"),
        (influence.Influence, "quadrant", "coefficients"),
        (influence.Influence, "once", "their transforms"),
        (solve, "solve_normal", "pressure"),
        (solve, "solve_rolling", "tractions"),
        (solve, "solve_coupled", "tractions"),
        (solve, "prove_normal", "proof"),
        (solve, "prove_rolling", "proof"),
        (solve, "slips", "proof"),
    ]
    forget()
    with patched(*((owner, name, watch.wrap(getattr(owner, name), part)) for owner, name, part in parts)):
        watch.wrap(solve.solve_scene, "rest")(scene)
    return {part: watch.seconds[part] for part in PARTS}


@functools.cache
def plain_transforms(shape: tuple[int, int]) -> tuple[Callable[[], None], Callable[[], None]]:
    """pyFFTW's real transforms of two arrays of this shape in one plan, forward and back."""
    real = pyfftw.zeros_aligned((2, *shape), dtype="float64")
    hat = pyfftw.zeros_aligned((2, shape[0], shape[1] // 2 + 1), dtype="complex128")
    plans = (
        pyfftw.FFTW(a, b, axes=(1, 2), direction=direction, threads=1, flags=("FFTW_ESTIMATE", "FFTW_DESTROY_INPUT"))
        for a, b, direction in ((real, hat, "FFTW_FORWARD"), (hat, real, "FFTW_BACKWARD"))
    )
    forward, backward = (plan.execute for plan in plans)
    return forward, backward


def fft_floor(scene: Scene, repeats: int) -> dict[str, float]:
    """Seconds of the traction solution (operators made before) and of its FFTs alone, replayed in the same order.

    Plain: each FFT as a two-dimensional real transform of both components. Own: the solver's FFTs, which leave out
    rows of zeros and, on the torus, transform both components as one complex array.
    """
    solved = contact.solve_normal(scene)
    contact.solve_rolling(solved, scene)
    own: list[Callable[[], None]] = []
    plain: list[Callable[[], None]] = []

    def recorded(method: Callable[..., None], back: bool) -> Callable[..., None]:
        def run(plan: Any) -> None:
            own.extend(getattr(plan, stage) for stage in stages[back])
            plain.append(plain_transforms(plan.padded)[back])
            used.add(plan)
            method(plan)

        return run

    used: set[Any] = set()
    kinds = convolution.Transform, convolution.ShiftedTransform, convolution.PairTransform
    stages = ("_rows", "_columns"), ("_columns_back", "_rows_back")
    ways = ("forward", "backward")
    with patched(*((k, name, recorded(getattr(k, name), name == ways[1])) for k in kinds for name in ways)):
        rolling = contact.solve_rolling(solved, scene)
    # zeros, since other numbers would grow with every replay to infinities, which take longer
    fed = [plan.field if isinstance(plan, convolution.PairTransform) else plan.real for plan in used]
    for plan, field in zip(used, fed, strict=True):
        field[:] = 0.0
        plan.hat[:] = 0.0
    times: dict[str, list[float]] = {"whole": [], "own": [], "plain": []}
    for _ in range(repeats):
        begun = Clock()
        contact.solve_rolling(solved, scene)
        times["whole"].append(Clock() - begun)
        for field in fed:
            field[:] = 0.0
        for name, calls in (("own", own), ("plain", plain)):
            begun = Clock()
            for call in calls:
                call()
            times[name].append(Clock() - begun)
    least = {name: 1e3 * min(of) for name, of in times.items()}
    return {
        "products": rolling.products + rolling.coarse_products,
        "transforms": len(plain),
        "tractions_milliseconds": least["whole"],
        "plain_milliseconds": least["plain"],
        "ratio": least["whole"] / least["plain"],
        "own_milliseconds": least["own"],
        "own_ratio": least["whole"] / least["own"],
    }


def part_c(options: argparse.Namespace) -> Any:
    """Where the time goes, and the FFT floor."""
    print("## c. Where the time goes (ms)\n")
    found: dict[str, list[Any]] = {"breakdown": [], "floor": []}
    for name, make in SCENES.items():
        for n in options.cells:
            breakdown(make(n))
            samples = [breakdown(make(n)) for _ in range(repeats_of(n, options.repeats))]
            row = {part: 1e3 * statistics.median(s[part] for s in samples) for part in PARTS}
            found["breakdown"].append({"scene": name, "cells": n, **row})
    table(["scene", "cells", *PARTS], [list(row.values()) for row in found["breakdown"]])
    print(
        "Tractions (symbols made before) against the bare FFTs of their products, in the same order; least times.\n"
        "Plain: real 2-D FFTs of both components in one plan. Own: as they are here, without what is zero.\n"
    )
    for name, make in SCENES.items():
        for n in options.cells:
            floor = fft_floor(make(n), repeats_of(n, options.repeats))
            found["floor"].append({"scene": name, "cells": n, **floor})
    titles = ["scene", "cells", "products", "transforms", "tractions, ms", "plain FFTs, ms", "ratio"]
    titles += ["own FFTs, ms", "ratio"]
    table(titles, [list(row.values()) for row in found["floor"]])
    return found


def part_d(options: argparse.Namespace) -> Any:
    """The paper's layered cases, and all of its rolling ones on finer meshes."""
    study = load_study(PAPER)
    wanted = {"figure_7", "figure_8", "figure_9", "figure_10"}
    layered = []  # scenes, those of one normal problem together
    for cases in expand(study).groups():
        layered.append([replace(c.scene, tolerance=Tolerance(1e-6, 1e-6)) for c in cases if c.grid in wanted])
    rolling = rolling_groups(PAPER)
    print(f"## d. The paper's {sum(map(len, layered))} layered cases, tolerances 1e-6\n")
    for scenes in layered:
        list(solve.solve_group(scenes))
    forget()
    begun = Clock()
    results = [r for scenes in layered for r in solve.solve_group(scenes)]
    each = (Clock() - begun) / len(results)
    found: dict[str, Any] = {"cases": len(results), "milliseconds_a_case": 1e3 * each}
    rows = []
    for words, names in (
        ("products, own mesh", ("operator_products",)),
        ("products, coarser meshes", ("coarse_products",)),
        ("products, all meshes", ("operator_products", "coarse_products")),
        ("Newton steps", ("iterations_tangential",)),
        ("pressure steps", ("iterations_normal",)),
    ):
        values = [sum(int(r.scalars[name]) for name in names) for r in results]
        rows.append([words, statistics.median(values), max(values)])
        found[words] = {"median": statistics.median(values), "worst": max(values)}
    table(["", "median", "worst"], rows)
    bad = Counter(r.status.name for r in results if r.status != Status.SOLVED)
    print(f"{1e3 * each:.2f} ms a case, pressures and coefficients included. Not solved: {dict(bad) or 0}.\n")
    found["growth"] = growth(rolling, [n for n in options.cells if n <= 512])
    close = [Creepage(0.0001 * (k + 1), 0.0, 0.005) for k in range(24)]
    layers = [Layer(52500.0 * 2**k, 0.3, 0.2 * A) for k in (0, 1, 3, 4)]
    dense = [[replace(coated(128, (layer,)), creepage=creepage) for creepage in close] for layer in layers]
    found["series"] = in_series({"the paper's rolling cases": rolling, "24 creepages to a layer, 128 cells": dense})
    return found


def in_series(families: dict[str, list[list[Scene]]]) -> list[dict[str, Any]]:
    """Products and time with `--series` over those without; families: groups of scenes of one normal problem each."""
    print("Cases of close creepages starting from one another (`--series`), over cases alone: products on all meshes,")
    print("least of five processor times of whole solves.\n")
    found = []
    for name, groups in families.items():
        products, seconds = {False: 0.0, True: 0.0}, {False: np.inf, True: np.inf}
        for _ in range(5):
            for series in products:
                begun = Clock()
                results = [r for scenes in groups for r in solve.solve_group(scenes, series=series)]
                seconds[series] = min(seconds[series], Clock() - begun)
                products[series] = sum(r.scalars["operator_products"] + r.scalars["coarse_products"] for r in results)
        ratios = {"products": products[True] / products[False], "time": seconds[True] / seconds[False]}
        found.append({"cases": name, "number": sum(map(len, groups)), **ratios})
    table(list(found[0]), [list(row.values()) for row in found])
    return found


def growth(groups: list[list[Scene]], meshes: list[int]) -> list[dict[str, Any]]:
    """Products of rolling cases by mesh; groups: those of one normal problem each."""
    number = sum(map(len, groups))
    print(f"Products of all {number} rolling cases at 1e-6; growth: case by case, over the first mesh.\n")
    found: list[dict[str, Any]] = []
    first: np.ndarray | None = None
    for n in meshes:
        results = []
        for group in groups:
            finer = [replace(s, mesh=Mesh(s.mesh.size, (n, n)), tolerance=Tolerance(1e-6, 1e-6)) for s in group]
            results += solve.solve_group(finer)
        own, coarse = (
            np.array([int(r.scalars[name]) for r in results]) for name in ("operator_products", "coarse_products")
        )
        first = own if first is None else first
        row: dict[str, Any] = {"cells": n, "not solved": sum(r.status != Status.SOLVED for r in results)}
        for words, values in (("own mesh", own), ("all meshes", own + coarse), ("growth", own / first)):
            row |= {f"{words}, median": float(np.median(values)), f"{words}, worst": float(values.max())}
        found.append(row)
    table(list(found[0]), [list(row.values()) for row in found])
    return found


def part_e(options: argparse.Namespace) -> Any:
    """Full coupling against one-way."""
    print("## e. Full coupling against one-way (least times)\n")
    found = []
    rigid = {"no layer, rigid ball": lambda n: replace(SCENES["no layer"](n), counterbody=None)}
    for name, make in (rigid | {name: SCENES[name] for name in ("one layer", "two layers")}).items():
        for n in (c for c in options.cells if c <= 512):
            one_way = make(n)
            full = replace(one_way, coupling="full")
            samples: dict[str, list[float]] = {"one-way": [], "full": []}
            products = {}
            whole(one_way), whole(full)
            for _ in range(repeats_of(n, options.repeats)):
                for scene in (one_way, full):
                    seconds, result = whole(scene)
                    samples[scene.coupling].append(seconds)
                    products[scene.coupling] = result.scalars["operator_products"] + result.scalars["coarse_products"]
            one, both = (1e3 * min(samples[key]) for key in ("one-way", "full"))
            found.append(
                {
                    "scene": name,
                    "cells": n,
                    "one-way, ms": one,
                    "full, ms": both,
                    "ratio": both / one,
                    "products, one-way": int(products["one-way"]),
                    "products, full": int(products["full"]),
                }
            )
    table(list(found[0]), [list(row.values()) for row in found])
    return found


STUDY = """\
study: throughput
scene:
  substrate: {E: 210000, nu: 0.3}
  radius: 50
  load: 100
  mesh: {size: [2, 2], cells: [128, 128]}
grids:
  coated:
    coating: {layer_count: 1}
    axes:
      thickness: [THICKNESSES]
      modulus: [0.25 Es, 0.5 Es, 2 Es, 4 Es]
      creepage:
"""


class Times(Silent):
    """Records the wall times at which cases were done."""

    def __init__(self) -> None:
        self.times: list[float] = []

    def advance(self, *, failed: bool) -> None:
        """Note the time."""
        self.times.append(time.perf_counter())


def sweep_command(study: Path, cube: Path, *options: str) -> float:
    """Wall time (s) of `rcstudy sweep`, as it is typed."""
    command = [sys.executable, "-m", "rcstudy", "sweep", str(study), "-o", str(cube), "-q", "--fresh", *options]
    begun = time.perf_counter()
    subprocess.run(command, check=True, env={**os.environ, "PYTHONPATH": str(ROOT)}, stdout=subprocess.DEVNULL)
    return time.perf_counter() - begun


def part_f(options: argparse.Namespace) -> Any:
    """Throughput of a sweep."""
    print("## f. Sweep\n")
    lines = [f"        - {{label: c{k}, longitudinal: {0.0001 * (k + 1):.4f}, spin: 0.005}}" for k in range(24)]
    found = []
    with tempfile.TemporaryDirectory() as folder:
        path, cube = Path(folder) / "throughput.yaml", Path(folder) / "cube.nc"
        thicknesses = ", ".join(f"{0.2 + 0.04 * k:.2f} a" for k in range(24))
        text = STUDY.replace("THICKNESSES", thicknesses) + "\n".join(lines) + "\n"
        path.write_text(text, encoding="utf-8")
        study = load_study(path)
        sweep_command(path, cube, "--workers", "1")  # warms the disk and the compiled kernels
        for workers in (1, 2):
            command, steady = np.inf, 0.0
            for _ in range(2):
                command = min(command, sweep_command(path, cube, "--workers", str(workers)))
                times = Times()
                sweep.run(study, cube, workers=workers, progress=times, fresh=True)
                steady = max(steady, (len(times.times) - 1) / (times.times[-1] - times.times[0]))
            rate = study.size / command
            found.append({"workers": workers, "cases": study.size, "seconds": command, "rate": rate, "steady": steady})
    one = found[0]
    for row in found:
        row["efficiency"] = row["rate"] / row["workers"] / one["rate"]
        row["steady_efficiency"] = row["steady"] / row["workers"] / one["steady"]
    print("128 x 128 cells, one layer, fields stored; the better of two runs, wall time of the whole command.")
    print("Steady: from the first case done to the last, without the start of the workers.\n")
    titles = ["workers", "cases", "s", "cases/s", "cases/s, steady", "efficiency", "efficiency, steady"]
    table(titles, [list(row.values()) for row in found])
    return found


def part_g(options: argparse.Namespace) -> Any:
    """The paper's study."""
    print("## g. The paper's study\n")
    from rcstudy.cube import case_table, open_cube

    walls, solves, phases = [], [], []
    with tempfile.TemporaryDirectory() as folder:
        cube = Path(folder) / "paper.nc"
        for k in range(4):
            wall = sweep_command(PAPER, cube)
            if k == 0:
                continue  # warms the disk and the compiled kernels
            walls.append(wall)
            with open_cube(cube) as tree:
                solves.append(float(case_table(tree)["solve_seconds"].sum()))
                phases.append(float(tree.attrs["wall_seconds"]))
                count = len(case_table(tree))
    found = {
        "cases": count,
        "solves_seconds": statistics.median(solves),
        "solves_and_cube_seconds": statistics.median(phases),
        "command_seconds": statistics.median(walls),
        "least_command_seconds": min(walls),
    }
    titles = ["cases", "solves, s", "solves and cube, s", "whole command, s", "least of three, s"]
    table(titles, [list(found.values())])
    return found


def part_h(options: argparse.Namespace) -> Any:
    """What aligned cells cost, the paper's rolling cases."""
    groups, discretisations = rolling_groups(PAPER), get_args(Discretisation)
    number = sum(map(len, groups))
    print(f"## h. Aligned cells against kalker, the paper's {number} rolling cases\n")
    print(
        "Either comes first in turn. Times: the sums of the least ones of each group of cases. Ratios: of these times, "
        "and the median of those of one turn.\n"
    )
    found = []
    for n in (80, 160, 320):
        seconds = {name: np.zeros((options.repeats + 1, len(groups))) for name in discretisations}
        products = {}
        for turn in range(options.repeats + 1):
            for discretisation in discretisations if turn % 2 == 0 else discretisations[::-1]:
                results = []
                for k, group in enumerate(groups):
                    mesh = Mesh(group[0].mesh.size, (n, n))
                    scenes = [replace(scene, mesh=mesh, discretisation=discretisation) for scene in group]
                    begun = Clock()
                    results += solve.solve_group(scenes)
                    seconds[discretisation][turn, k] = Clock() - begun
                both = "operator_products", "coarse_products"
                products[discretisation] = sum(r.scalars[name] for r in results for name in both) / number
        kalker, aligned = (seconds[key][1:] for key in ("kalker", "aligned"))  # the first turn warms up
        # noise of the machine seldom spares a turn over all groups, but one group in some turn
        least = {"kalker": float(kalker.min(axis=0).sum()), "aligned": float(aligned.min(axis=0).sum())}
        found.append(
            {
                "cells": n,
                "kalker, ms a case": 1e3 * least["kalker"] / number,
                "aligned, ms a case": 1e3 * least["aligned"] / number,
                "ratio, least": least["aligned"] / least["kalker"],
                "ratio, median": float(np.median(aligned.sum(axis=1) / kalker.sum(axis=1))),
                "products, kalker": products["kalker"],
                "products, aligned": products["aligned"],
            }
        )
    table(list(found[0]), [list(row.values()) for row in found])
    return found


def parts_of(text: str) -> list[str]:
    """Names of parts, separated by commas."""
    names = text.split(",")
    for name in names:
        if name not in list(ALL_PARTS):
            raise argparse.ArgumentTypeError(f"no part {name!r}: {', '.join(ALL_PARTS)}")
    return names


def numbers_of(text: str) -> list[int]:
    """Numbers of cells, separated by commas."""
    names = text.split(",")
    if not all(name.isdecimal() and int(name) >= 8 for name in names):
        raise argparse.ArgumentTypeError(f"{text!r}: whole numbers of at least 8, separated by commas")
    return [int(name) for name in names]


def main() -> None:
    """Run the parts asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--parts", type=parts_of, default=list(ALL_PARTS))
    parser.add_argument("--repeats", type=int, default=9)
    parser.add_argument("--cells", type=numbers_of, default=[64, 128, 256, 512])
    parser.add_argument("--large", action="store_true", help="1024 cells too")
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    options.cells = options.cells + ([1024] if options.large else [])
    load = os.getloadavg()
    found: dict[str, Any] = {
        "cpu": str(provenance.collect().get("machine_cpu", platform.machine())),
        "cores": available_cores(),
        "load_average_before": load,
    }
    print("# Benchmark\n")
    print(f"{found['cpu']}, {found['cores']} cores, Python {platform.python_version()}, NumPy {np.__version__}.")
    print(f"Load average before: {load[0]:.1f}, {load[1]:.1f}, {load[2]:.1f}; ", end="")
    print("quiet." if load[0] < 0.25 * found["cores"] else "other programs were running: trust the ratios.")
    print("Processor time of one thread, medians, unless stated otherwise.\n", flush=True)
    for name in options.parts:
        found[name] = globals()[f"part_{name}"](options)
    found["load_average_after"] = load = os.getloadavg()
    print(f"Load average after: {load[0]:.1f}, {load[1]:.1f}, {load[2]:.1f}.")
    if options.json:
        options.json.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
