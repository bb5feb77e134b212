"""Reliability of the error bars: random contacts against aligned cells four times finer, or more.

Usage: python scripts/error_bars.py [--cases 64] [--seed 1] [--discretisation kalker] [--contacts mild].
Prints, as a table in Markdown, for each scalar the share of cases whose true error lies within the estimate, the median
ratio of estimate to truth, and the true error itself. The truth is found on aligned cells, whichever discretisation is
judged: `kalker` on cells four times finer still has a quarter of the error (`--truth own` takes these). Contacts:

- `mild`: up to three layers, common bodies. Half of them in a window of random size, half in one that fits the contact
  as `mesh.size: auto` does, so that the contact's edges lie at the same place between cells in all of these;
- `full`: like `mild`, of bodies whose pressure moves their surfaces along each other, under full coupling;
- `wild`: up to six layers of any stiffness and thickness, ellipses, friction from 0.03 to 1.6, either coupling;
- `alike`: bodies of one material without layers, round or long contacts, at 0.03 to 2 times the creepage of full slip;
- `engineering`: hard and soft coatings on a ball, and wheels on rails, in windows by `auto`;
- `films`: soft films, thinner or thicker than cells, some of them nearly incompressible or under stiff skins;
- `unlike`: steel, in half of the cases with a layer, under a rigid or elastic ball, with friction from 0.05 to 0.3;
- `few`: contacts of `mild` and `engineering` on 5 to 18 cells along the window, against eight times as many;
- `fewest`: contacts of `mild`, `full`, `alike` and `unlike` 1 to 12 cells across, as many of each number (`--across`:
  only of this one), on square and oblong cells, against 128 cells along a window that fits;
- `coarse`: contacts of `mild`, `engineering` and `unlike` on 10 to 30 cells along the window, most of which have one
  coarser mesh, against eight times as many;
- `sticking`: contacts of `mild` and `alike` at 0.003 to 0.3 of their creepages;
- `sliding`: 0.8 to 1.5 times the creepage at which the last of the cells begins to slip;
- `rubber`: nearly incompressible films of 1 MPa to 1 GPa on steel or stiffer bodies, 0.03 to 2.5 cells thick;
- `pulled`: under rigid balls, friction times Dundurs' constant 0.2 to 1.2, full coupling;
- `pressed`: without creepage, contacts of `mild`, `films` and `rubber` whose surfaces pressure alone makes slip;
- `long`: bodies without layers in contacts 2 to 12 times as long one way, the pole of spin inside;
- `oblong`: bare and coated bodies in contacts 1.5 to 10 times as long one way, on 15 to 55 cells along either side of
  the window, most of them without spin;
- `skinned`: skins 2 to 300 times as stiff as what they lie on, up to 1.2 cells thick, most of them far thinner: on
  polymers, on soft layers and on metals; two in three fully coupled; against eight times as many cells.

Published: results/error_bars.md.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from rcstudy.errors import UserError
from rcstudy.mechanics.normal import estimated_contact
from rcstudy.mechanics.scene import Coupling, Creepage, Layer, Material, Mesh, Scene, Tolerance
from rcstudy.progress import counted
from rcstudy.result import ESTIMATED, CellState, Status
from rcstudy.solve import solve_scene
from rcstudy.study import scene_from_mapping
from rcstudy.studyfile.build import fitted_size

STEEL = Material(210000.0, 0.3)
# times as many cells along each side for the truth; 4 for the others
_FINER = {"few": 8, "coarse": 8, "between": 12, "skinned": 8}
_COUPLINGS: tuple[Coupling, Coupling] = ("one-way", "full")
_ACROSS = 1, 2, 3, 4, 5, 6, 8, 10, 12  # cells across the contacts of `fewest`
CREEPAGES = (
    (0.002, 0.0, 0.0),
    (0.002, 0.001, 0.0),
    (0.002, 0.001, 0.01),
    (0.0, 0.002, 0.0),
    (0.0, 0.0, 0.01),
    (0.001, 0.0, 0.005),
    (0.004, 0.004, 0.01),
    (0.0005, 0.0005, 0.0),
    (0.0005, 0.0, 0.02),
)


def mild_scene(rng: np.random.Generator, discretisation: str) -> Scene:
    """A contact with up to three layers, any counterbody, circular or elliptic."""
    return _in_a_window(_mild(rng, discretisation), rng)


def full_scene(rng: np.random.Generator, discretisation: str) -> Scene:
    """A mild contact whose pressure displaces the surfaces along each other, under full coupling."""
    while True:
        scene = replace(_mild(rng, discretisation), coupling="full")
        if scene.moves_by_pressure:
            return _in_a_window(scene, rng)


def _mild(rng: np.random.Generator, discretisation: str) -> Scene:
    """A mild contact in a window that is still to be chosen."""
    layers = tuple(
        Layer(
            210000.0 * 10 ** rng.uniform(-1.0, 0.7), float(rng.choice([0.2, 0.3, 0.4, 0.48])), rng.uniform(0.0125, 0.3)
        )
        for _ in range(rng.choice([0, 0, 1, 1, 2, 3]))
    )
    counterbody = (None, None, STEEL, Material(70000.0, 0.33))[rng.integers(4)]
    radius = ((50.0, 50.0), (50.0, 50.0), (80.0, 40.0), (30.0, 90.0))[rng.integers(4)]
    return Scene(
        STEEL,
        radius,
        100.0,
        Mesh((1.0, 1.0), (24, 24)),
        layers,
        counterbody,
        float(rng.choice([0.3, 0.6, 1.0])),
        Creepage(*CREEPAGES[rng.integers(len(CREEPAGES))]),
        discretisation=discretisation,  # type: ignore[arg-type]
        tolerance=Tolerance(1e-6, 1e-6),
    )


def _in_a_window(scene: Scene, rng: np.random.Generator) -> Scene:
    """The scene in a window of 2.6 to 4 semi-axes or, as often, in a fitted one with a margin of 1.25 or another.

    In fitted windows with the same margin the edges of all contacts lie at the same place between the same number of
    cells.
    """
    if rng.random() < 0.5:
        cells = int(rng.choice([24, 32, 40, 48, 64]))
        width = rng.uniform(2.6, 4.0)
        ax, ay = estimated_contact(scene)
        return replace(scene, mesh=Mesh((width * ax, width * ay), (cells, cells)))
    cells = int(rng.integers(20, 65))
    margin = 1.25 if rng.random() < 0.5 else rng.uniform(1.05, 1.6)
    return replace(scene, mesh=Mesh(fitted_size(scene, margin, (cells, cells)), (cells, cells)))


def alike_scene(rng: np.random.Generator, discretisation: str) -> Scene:
    """Steel on steel without layers: pressure does not displace the surfaces along each other."""
    radius = (50.0, 50.0) if rng.random() < 0.4 else (_power(rng, 1.0, 2.5), _power(rng, 1.0, 2.5))
    scene = Scene(
        STEEL,
        radius,
        100.0,
        Mesh((1.0, 1.0), (24, 24)),
        (),
        STEEL,
        _power(rng, -1.3, 0.0),
        Creepage(),
        discretisation=discretisation,  # type: ignore[arg-type]
        tolerance=Tolerance(1e-6, 1e-6),
    )
    return _in_a_window(_creeping(scene, _direction(rng, 0.4), 10.0 ** rng.uniform(-1.5, 0.3)), rng)


def long_scene(rng: np.random.Generator, discretisation: str) -> Scene:
    """Bodies without layers, a contact 2 to 12 times as long one way, and a pole of spin in it; window by `auto`.

    From 0.03 to 5 times the spin of full slip; as many cells along as across, or not.
    """
    radius = tuple(rng.permutation([8.0, 8.0 * _power(rng, 0.5, 1.6)]).tolist())
    counterbody = (STEEL, STEEL, None, Material(70000.0, 0.33))[rng.integers(4)]
    cells = (int(rng.integers(12, 49)), int(rng.integers(12, 49)))
    bare = Scene(STEEL, radius, 100.0, Mesh((1.0, 1.0), cells), (), counterbody, _power(rng, -1.0, 0.0))
    ax, ay = estimated_contact(bare)
    spin = bare.friction * math.sqrt(ax * ay / math.prod(radius)) / max(ax, ay) * _power(rng, -1.5, 0.7)
    away, angle = math.sqrt(rng.random()), rng.uniform(0.0, 2.0 * math.pi)
    creepage = Creepage(spin * away * ay * math.sin(angle), -spin * away * ax * math.cos(angle), spin)
    return replace(
        bare,
        mesh=Mesh(fitted_size(bare, 1.25, cells), cells),
        creepage=creepage,
        discretisation=discretisation,  # type: ignore[arg-type]
        tolerance=Tolerance(1e-6, 1e-6),
    )


def oblong_scene(rng: np.random.Generator, discretisation: str) -> Scene:
    """A contact up to ten times as long one way under up to two layers, of long cells; a quarter fully coupled.

    At 0.06 to 1.6 times the creepage of full slip, in three of four cases without spin; window by `auto`.
    """
    radius = tuple(rng.permutation([20.0, 20.0 * _power(rng, 0.3, 1.4)]).tolist())
    nus = rng.choice([0.0, 0.2, 0.3, 0.45], size=2)
    layers = tuple(Layer(_power(rng, 3.7, 6.0), float(nu), _power(rng, -2.0, -0.5)) for nu in nus)
    cells = (int(rng.integers(15, 56)), int(rng.integers(15, 56)))
    scene = Scene(
        Material(210000.0, float(rng.choice([0.0, 0.3, 0.45]))),
        radius,
        _power(rng, 0.7, 2.3),
        Mesh((1.0, 1.0), cells),
        layers[: rng.choice([0, 0, 1, 2])],
        (None, STEEL, Material(70000.0, 0.45), Material(5000.0, 0.0))[rng.integers(4)],
        _power(rng, -1.0, 0.15),
        coupling="full" if rng.random() < 0.25 else "one-way",
        discretisation=discretisation,  # type: ignore[arg-type]
        tolerance=Tolerance(1e-6, 1e-6),
    )
    scene = replace(scene, mesh=Mesh(fitted_size(scene, rng.uniform(1.1, 1.7), cells), cells))
    direction = rng.normal(size=3) * (1.0, 1.0, float(rng.random() < 0.25))
    if rng.random() < 0.5:
        direction = direction * np.eye(3)[rng.integers(2)]
    return _creeping(scene, direction / np.linalg.norm(direction), _power(rng, -1.2, 0.2))


def unlike_scene(rng: np.random.Generator, discretisation: str) -> Scene:
    """Steel, in half of the cases with a layer, under a rigid or an elastic ball and with little friction.

    Slip by pressure then causes wide slip zones at the leading edge, with slip that turns from there on.
    """
    layers: tuple[Layer, ...] = ()
    if rng.random() < 0.5:
        layers = (Layer(STEEL.E * _power(rng, -0.7, 0.7), 0.3, _power(rng, -2.0, -0.5)),)
    counterbody = None if rng.random() < 0.5 else Material(STEEL.E * _power(rng, -2.0, 0.3), rng.uniform(0.2, 0.45))
    scene = Scene(
        STEEL,
        (50.0, 50.0),
        100.0,
        Mesh((1.0, 1.0), (24, 24)),
        layers,
        counterbody,
        _power(rng, -1.3, -0.5),
        Creepage(),
        discretisation=discretisation,  # type: ignore[arg-type]
        tolerance=Tolerance(1e-6, 1e-6),
    )
    return _in_a_window(_creeping(scene, _direction(rng, 0.3), 10.0 ** rng.uniform(-1.0, 0.4)), rng)


def engineering_scene(rng: np.random.Generator, discretisation: str) -> Scene:
    """A coated body under a ball, or a wheel on a rail, window by `auto`; 0.1 to 3 times the creepage of full slip."""
    mapping = _coated(rng) if rng.random() < 0.5 else _rail(rng)
    cells = int(rng.integers(24, 69))
    mapping |= {
        "creepage": {"longitudinal": 0.001},
        "coupling": _COUPLINGS[rng.integers(2)],
        "discretisation": discretisation,
        "mesh": {"size": "auto", "cells": [cells, cells]},
        "tolerance": {"normal": 1e-6, "tangential": 1e-6},
    }
    scene = scene_from_mapping(mapping)
    return _creeping(scene, _direction(rng, 0.3), 10.0 ** rng.uniform(-1.0, 0.5))


def _coated(rng: np.random.Generator) -> dict[str, Any]:
    """Settings of a ball on titanium nitride, diamond-like carbon or a polymer, thicknesses from 0.5 um to 1 mm."""
    coat = rng.integers(3)
    if coat == 0:
        layer = {"E": rng.uniform(400e3, 600e3), "nu": 0.25, "thickness": _power(rng, -3.0, -1.8)}
    elif coat == 1:
        layer = {"E": rng.uniform(80e3, 300e3), "nu": 0.2, "thickness": _power(rng, -3.3, -2.0)}
    else:
        layer = {"E": _power(rng, 2.5, 3.7), "nu": rng.uniform(0.35, 0.49), "thickness": _power(rng, -2.0, 0.0)}
    layers = [layer]
    if coat < 2 and rng.random() < 0.3:
        layers.append({"E": rng.uniform(100e3, 300e3), "nu": 0.3, "thickness": _power(rng, -3.3, -2.3)})
    return {
        "substrate": {"E": float(rng.choice([210000.0, 70000.0, 110000.0])), "nu": 0.3},
        "layers": layers,
        "counterbody": ("rigid", {"E": 210000, "nu": 0.3}, {"E": 380000, "nu": 0.22})[rng.integers(3)],
        "radius": _power(rng, 0.3, 1.7),
        "load": _power(rng, 0.0, 2.7),
        "friction": rng.uniform(0.03, 0.5),
    }


def _rail(rng: np.random.Generator) -> dict[str, Any]:
    """Settings of wheel and rail: steel, some with a worn or a deposited layer, on steel, another metal or rigid."""
    steel = {"E": 210000, "nu": 0.28}
    layer = {"E": f"{rng.uniform(0.3, 1.5):.3g} Es", "nu": 0.28, "thickness": f"{_power(rng, -2.0, 0.3):.3g} a"}
    return {
        "substrate": steel,
        "layers": [layer] if rng.random() < 0.3 else [],
        "counterbody": (steel, steel, {"E": 70000, "nu": 0.33}, {"E": 110000, "nu": 0.25}, "rigid")[rng.integers(5)],
        "radius": [rng.uniform(150.0, 600.0), _power(rng, 1.5, 3.3)],
        "load": _power(rng, 3.0, 5.2),
        "friction": rng.uniform(0.1, 0.6),
    }


def film_scene(rng: np.random.Generator, discretisation: str) -> Scene:
    """A film of 0.1 to 100 GPa and 6 um to 0.3 mm, some under a stiff skin; 0.03 to 3 of the creepage of full slip."""
    film = Layer(
        _power(rng, 2.0, 5.0), float(rng.choice([0.3, 0.4, 0.45, 0.48, 0.49, 0.499, 0.5])), _power(rng, -2.2, -0.5)
    )
    skin = (Layer(_power(rng, 4.8, 5.8), 0.3, _power(rng, -2.2, -1.0)),) if rng.random() < 0.33 else ()
    cells = int(rng.integers(16, 41))
    scene = Scene(
        STEEL,
        ((50.0, 50.0), (50.0, 50.0), (20.0, 20.0), (10.0, 200.0), (10.0, 2000.0), (300.0, 460.0))[rng.integers(6)],
        _power(rng, 1.0, 4.0),
        Mesh((1.0, 1.0), (cells, cells)),
        (*skin, film),
        (None, None, STEEL, Material(70000.0, 0.33))[rng.integers(4)],
        rng.uniform(0.1, 0.6),
        Creepage(),
        "full" if rng.random() < 0.2 else "one-way",
        discretisation=discretisation,  # type: ignore[arg-type]
        tolerance=Tolerance(1e-6, 1e-6),
    )
    scene = _creeping(scene, _direction(rng, 0.4), 10.0 ** rng.uniform(-1.5, 0.5))
    return replace(scene, mesh=Mesh(fitted_size(scene, 1.3, (cells, cells)), (cells, cells)))


def between_scene(rng: np.random.Generator, discretisation: str) -> Scene:
    """Wheel and rail, or other bodies alike or not, and one or two soft films between them, 0.003 to 0.1 radii thick.

    On these 16 to 40 cells along the longer side of the window most films are thinner than a cell.
    """
    kind = rng.integers(3)
    if kind == 0:
        body, radius = Material(STEEL.E, 0.28), (rng.uniform(300.0, 500.0), _power(rng, 2.0, 3.5))
        load, friction = _power(rng, 4.3, 5.1), rng.uniform(0.08, 0.3)
    else:
        body, side = Material(_power(rng, 4.8, 5.5), rng.uniform(0.2, 0.35)), _power(rng, 0.7, 2.7)
        radius = side, side * _power(rng, -0.5, 0.6)
        load, friction = body.E * side**2 * _power(rng, -7.5, -5.0), rng.uniform(0.05, 0.5)
    other = body if kind < 2 else Material(body.E * _power(rng, -0.5, 0.5), rng.uniform(0.2, 0.4))
    bare = Scene(body, radius, load, Mesh((1.0, 1.0), (8, 8)), (), other)
    a = estimated_contact(bare)[0]
    layers = tuple(
        Layer(body.E * _power(rng, -2.3, -0.7), rng.uniform(0.3, 0.48), a * _power(rng, -2.5, -1.0))
        for _ in range(rng.integers(1, 3))
    )
    cells = int(rng.integers(16, 41))
    scene = replace(
        bare,
        layers=layers,
        friction=friction,
        coupling=_COUPLINGS[rng.integers(2)],
        creepage=Creepage(),
        discretisation=discretisation,  # type: ignore[arg-type]
        tolerance=Tolerance(1e-6, 1e-6),
    )
    size = fitted_size(scene, rng.uniform(1.2, 1.6), (cells, cells))
    scene = replace(scene, mesh=Mesh(size, (cells, cells)))
    return _creeping(scene, _direction(rng, 0.3), 10.0 ** rng.uniform(-1.0, 0.7))


def rubber_scene(rng: np.random.Generator, discretisation: str) -> Scene:
    """A film of 1 MPa to 1 GPa, nu 0.45 to 0.5 and 0.03 to 2.5 cells thick, on steel or on stiffer or softer bodies.

    Creepages are 0.1 to 3 times that of full slip between bodies of the substrate, or up to some ten per cent.
    """
    while True:
        cells = int(rng.integers(20, 65))
        film = Layer(
            _power(rng, 0.0, 3.0),
            float(rng.choice([0.45, 0.48, 0.49, 0.495, 0.499, 0.5, 0.5])),
            _power(rng, -2.5, -0.5),
        )
        scene = Scene(
            STEEL if rng.random() < 0.5 else Material(_power(rng, 4.5, 6.5), 0.3),
            ((50.0, 50.0), (50.0, 50.0), (20.0, 20.0), (10.0, 200.0), (300.0, 460.0))[rng.integers(5)],
            _power(rng, 0.0, 3.5),
            Mesh((1.0, 1.0), (cells, cells)),
            (film,),
            (None, None, STEEL, Material(70000.0, 0.33))[rng.integers(4)],
            rng.uniform(0.1, 0.6),
            Creepage(),
            discretisation=discretisation,  # type: ignore[arg-type]
            tolerance=Tolerance(1e-6, 1e-6),
        )
        scene = replace(scene, mesh=Mesh(fitted_size(scene, 1.3, (cells, cells)), (cells, cells)))
        if not 0.03 < film.thickness / max(scene.mesh.spacing) < 2.5:
            continue
        if rng.random() < 0.5:
            return _creeping(scene, _direction(rng, 0.4), 10.0 ** rng.uniform(-1.0, 0.5))
        size = 0.1 * rng.choice([0.1, 1.0]) * rng.normal(size=3)
        return _with_creepage(scene, size * [1.0, 1.0, 2.6 / scene.mesh.size[0]])


def skinned_scene(rng: np.random.Generator, discretisation: str) -> Scene:
    """A skin up to 1.2 cells thick, stiffer than what it lies on: a polymer, a soft layer on steel, or a metal.

    At 0.06 to 2 times the creepage of full slip; window by `auto`, 20 to 36 cells along it.
    """
    cells, side = int(rng.integers(20, 37)), float(rng.choice([3.0, 10.0, 50.0]))
    counterbody = (None, STEEL)[rng.integers(2)]
    kind = rng.integers(3)
    under: tuple[Layer, ...] = ()
    below = (STEEL, Material(110000.0, 0.33), Material(70000.0, 0.33))[rng.integers(3)]
    if kind == 0:
        below = Material(_power(rng, 3.2, 3.8), rng.uniform(0.35, 0.42))
    elif kind == 1:
        under = (Layer(_power(rng, 3.0, 4.5), rng.uniform(0.3, 0.42), _power(rng, -2.0, -0.3)),)
    modulus = (under[0] if under else below).E * _power(rng, 0.3, 1.0 if kind == 2 else 2.5)
    scene = Scene(
        below,
        (side, side * (_power(rng, -0.5, 0.5) if rng.random() < 0.3 else 1.0)),
        below.E * side**2 * _power(rng, -6.5, -4.5),
        Mesh((1.0, 1.0), (cells, cells)),
        (Layer(modulus, 0.22, 1e-3), *under),
        counterbody,
        _power(rng, -1.3, -0.1),
        coupling="full" if rng.random() < 0.67 else "one-way",
        discretisation=discretisation,  # type: ignore[arg-type]
        tolerance=Tolerance(1e-6, 1e-6),
    )
    dx = fitted_size(scene, 1.4, (cells, cells))[0] / cells
    skin = replace(scene.layers[0], thickness=dx * _power(rng, -3.0 if kind == 1 else -1.7, 0.08))
    scene = replace(scene, layers=(skin, *under))
    scene = replace(scene, mesh=Mesh(fitted_size(scene, 1.4, (cells, cells)), (cells, cells)))
    return _creeping(scene, _direction(rng, 0.4), _power(rng, -1.2, 0.3))


def few_scene(rng: np.random.Generator, discretisation: str) -> Scene:
    """A contact of `mild` or `engineering` on 5 to 18 cells along the longer side of its window."""
    scene = (mild_scene if rng.random() < 0.5 else engineering_scene)(rng, discretisation)
    return _on_cells(scene, int(rng.integers(5, 19)))


def fewest_scene(rng: np.random.Generator, discretisation: str, across: int = 0) -> Scene:
    """A contact of `mild`, `full`, `alike` or `unlike`, `across` (0: one of `_ACROSS`) cells across, within a tenth.

    The contact is that of Hertz's estimate. Cells are square, or up to 2.5 times as long as wide, or such that as many
    lie across either side. At least one to three rows are free all round, so that edges lie anywhere between cells.
    """
    kind = (mild_scene, full_scene, alike_scene, unlike_scene)[rng.integers(4)]
    scene = kind(rng, discretisation)
    semi_axes = np.array(estimated_contact(scene))
    mean = np.sqrt(semi_axes.prod())
    stretch = 10.0 ** (rng.uniform(-0.2, 0.2) * np.array([1.0, -1.0]))
    shape = (np.full(2, mean), mean * stretch, semi_axes)[rng.integers(3)]
    sides = 2.0 * shape / ((across or rng.choice(_ACROSS)) * rng.uniform(0.9, 1.1))
    cells = np.ceil(2.0 * semi_axes / sides).astype(int) + rng.integers(3, 7, size=2)
    width, height = (cells * sides).tolist()
    return replace(scene, mesh=Mesh((width, height), (int(cells[0]), int(cells[1]))))


def coarse_scene(rng: np.random.Generator, discretisation: str) -> Scene:
    """A contact of `mild`, `engineering` or `unlike` on 10 to 30 cells along the longer side of its window."""
    kind = (mild_scene, engineering_scene, unlike_scene)[rng.integers(3)]
    return _on_cells(kind(rng, discretisation), int(rng.integers(10, 31)))


def _on_cells(scene: Scene, cells: int) -> Scene:
    """The scene with this number of cells along the longer side of its window, at least 4 along the other."""
    most = max(scene.mesh.cells)
    nx, ny = (max(4, round(cells * n / most)) for n in scene.mesh.cells)
    return replace(scene, mesh=Mesh(scene.mesh.size, (nx, ny)))


def sticking_scene(rng: np.random.Generator, discretisation: str) -> Scene:
    """A contact of `mild` or `alike` that hardly slips."""
    scene = (mild_scene if rng.random() < 0.5 else alike_scene)(rng, discretisation)
    assert scene.creepage is not None
    parts = scene.creepage.longitudinal, scene.creepage.lateral, scene.creepage.spin
    return _with_creepage(scene, _power(rng, -2.5, -0.5) * np.array(parts))


def sliding_scene(rng: np.random.Generator, discretisation: str) -> Scene:
    """A round or long contact, bare or coated, at 0.8 to 1.5 of the creepage at which the last cell begins to slip."""
    layers = (Layer(_power(rng, 4.0, 6.0), 0.3, _power(rng, -2.0, -0.5)),) if rng.random() < 0.4 else ()
    radius = (50.0, 50.0) if rng.random() < 0.5 else (_power(rng, 1.0, 2.0), _power(rng, 1.0, 2.0))
    cells = int(rng.integers(16, 65))
    scene = Scene(
        STEEL,
        radius,
        100.0,
        Mesh((1.0, 1.0), (cells, cells)),
        layers,
        (None, STEEL, Material(70000.0, 0.33))[rng.integers(3)],
        _power(rng, -1.3, -0.1),
        Creepage(),
        discretisation=discretisation,  # type: ignore[arg-type]
        tolerance=Tolerance(1e-6, 1e-6),
    )
    scene = replace(scene, mesh=Mesh(fitted_size(scene, 1.25, scene.mesh.cells), scene.mesh.cells))
    direction = np.array([(1, 0, 0), (0, 1, 0), (1, 1, 0), (1, 0.5, 0.3), (0.3, 1, 0.7), (0, 0, 1)][rng.integers(6)])
    low, high = 0.1, 10.0
    for _ in range(12):
        middle = float(np.sqrt(low * high))
        state = solve_scene(_creeping(scene, direction, middle)).fields["state"]
        low, high = (middle, high) if (state == CellState.STICK).any() else (low, middle)
    # half of them where a stick zone narrower than a cell may be
    times = rng.uniform(0.96, 1.15) if rng.random() < 0.5 else rng.uniform(0.8, 1.5)
    return _creeping(scene, direction, high * times)


def pulled_scene(rng: np.random.Generator, discretisation: str) -> Scene:
    """A body under a rigid ball, pressure pulled at by friction; 0.1 to 10 times the creepage of full slip."""
    nu = rng.uniform(0.0, 0.4)
    layers = (Layer(_power(rng, 2.0, 4.0), rng.uniform(0.0, 0.4), _power(rng, -1.0, 0.3)),)
    scene = Scene(
        Material(1000.0, nu),
        (10.0, _power(rng, 0.8, 1.2)),
        5.0,
        Mesh((1.0, 1.0), (24, 24)),
        layers if rng.random() < 0.3 else (),
        None,
        _power(rng, -0.7, 0.08) * 2.0 * (1.0 - nu) / (1.0 - 2.0 * nu),
        coupling="full",
        discretisation=discretisation,  # type: ignore[arg-type]
        tolerance=Tolerance(1e-6, 1e-6),
    )
    sides, cells = rng.uniform(3.2, 4.2) * np.array(estimated_contact(scene)), int(rng.integers(24, 65))
    scene = replace(scene, mesh=Mesh((float(sides[0]), float(sides[1])), (cells, cells)))
    return _creeping(scene, _direction(rng, 0.4), _power(rng, -1.0, 1.0))


def pressed_scene(rng: np.random.Generator, discretisation: str) -> Scene:
    """A contact of `mild`, `films` or `rubber` without creepage, of bodies whose surfaces slip by pressure."""
    while True:
        kind = (mild_scene, film_scene, rubber_scene)[rng.integers(3)]
        scene = replace(kind(rng, discretisation), creepage=Creepage())
        if scene.moves_by_pressure:
            return scene


def _direction(rng: np.random.Generator, single: float) -> np.ndarray:
    """Random unit vector of longitudinal, lateral and spin creepage; with probability `single` only one of them."""
    direction = rng.normal(size=3)
    if rng.random() < single:
        direction = np.eye(3)[rng.integers(3)]
    unit: np.ndarray = direction / np.linalg.norm(direction)
    return unit


def _creeping(scene: Scene, direction: np.ndarray, times: float) -> Scene:
    """The scene at `times` the approximate creepage of full slip: friction times contact radius over radius."""
    ax, ay = estimated_contact(scene)
    a = np.sqrt(ax * ay)
    size = times * scene.friction * a / np.sqrt(np.prod(scene.radius))
    return _with_creepage(scene, np.array([1.0, 1.0, 1.5 / a]) * direction * size)


def _with_creepage(scene: Scene, parts: np.ndarray) -> Scene:
    """The scene with longitudinal and lateral creepage and spin (rad/mm) `parts` [3], as far as a study allows them."""
    return replace(scene, creepage=Creepage(*np.clip(parts, (-1.0, -1.0, -1000.0), (1.0, 1.0, 1000.0)).tolist()))


def wild_scene(rng: np.random.Generator, discretisation: str) -> Scene:
    """A contact of nearly any bodies, half of them with layers that are not extreme; creepage for partial slip."""
    while True:
        stiffness, thickness = ((-1.5, 1.2), (-1.5, 0.5)) if rng.random() < 0.5 else ((-4.0, 3.0), (-3.0, 1.0))
        radius = [_power(rng, 0.0, 3.0), _power(rng, 0.0, 3.0)] if rng.random() < 0.4 else _power(rng, 0.0, 3.0)
        cells = [int(n) for n in rng.integers(16, 56, size=2)]
        layers = [
            {
                "E": f"{_power(rng, *stiffness)} Es",
                "nu": _poisson(rng),
                "thickness": f"{_power(rng, *thickness)} a",
            }
            for _ in range(rng.choice([0, 1, 1, 1, 2, 3, 4, 5, 6]))
        ]
        counterbodies = "rigid", "rigid", {"E": "1 Es", "nu": 0.3}, {"E": f"{_power(rng, -4.0, 1.0)} Es", "nu": 0.4}
        mapping = {
            "substrate": {"E": 210000.0 if rng.random() < 0.7 else _power(rng, 1.0, 6.0), "nu": _poisson(rng)},
            "layers": layers,
            "counterbody": counterbodies[rng.integers(4)],
            "radius": radius,
            "load": _power(rng, -6.0, 6.0) if rng.random() < 0.5 else _power(rng, 0.0, 3.0),
            "friction": _power(rng, -1.5, 0.2),
            "creepage": {"longitudinal": 0.001},
            "mesh": {"size": "auto", "cells": cells if rng.random() < 0.5 else cells[:1] * 2, "margin": 1.6},
            "coupling": _COUPLINGS[rng.integers(2)],
            "discretisation": discretisation,
            "tolerance": {"normal": 1e-6, "tangential": 1e-6},
        }
        try:
            scene = scene_from_mapping(mapping)
        except UserError as error:
            if "mesh" not in str(error):  # the only error expected is a window that cannot be fitted
                raise
            continue
        ax, ay = estimated_contact(scene)
        size = scene.friction * ax / scene.radius[0] * np.array([1.0, 1.0, 1.0 / np.sqrt(ax * ay)])
        parts = rng.choice([-1.0, 1.0], size=3) * 10.0 ** rng.uniform(-2.0, 0.7, size=3) * size
        parts *= [(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 0), (1, 0, 1), (1, 1, 1)][rng.integers(6)]
        return _with_creepage(scene, parts)


def _power(rng: np.random.Generator, low: float, high: float) -> float:
    """A random number between 10^low and 10^high, uniform in its logarithm."""
    return float(10.0 ** rng.uniform(low, high))


def _poisson(rng: np.random.Generator) -> float:
    return float(rng.choice([0.0, 0.1, 0.3, 0.3, 0.45, 0.49, 0.4999]))


CONTACTS: dict[str, Callable[[np.random.Generator, str], Scene]] = {
    "mild": mild_scene,
    "full": full_scene,
    "wild": wild_scene,
    "alike": alike_scene,
    "engineering": engineering_scene,
    "films": film_scene,
    "rubber": rubber_scene,
    "between": between_scene,
    "unlike": unlike_scene,
    "few": few_scene,
    "fewest": fewest_scene,
    "coarse": coarse_scene,
    "sticking": sticking_scene,
    "sliding": sliding_scene,
    "pulled": pulled_scene,
    "pressed": pressed_scene,
    "long": long_scene,
    "oblong": oblong_scene,
    "skinned": skinned_scene,
}


def main() -> None:
    """Solve each contact on its own mesh and on one four times finer (`_FINER`: eight or twelve times).

    Eight times as many cells as `fewest` have may be too few for the truth. Its window fits the contact.
    """
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=int, default=64)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--discretisation", default="kalker")
    parser.add_argument("--contacts", choices=CONTACTS, default="mild")
    parser.add_argument("--truth", choices=["aligned", "own"], default="aligned")
    parser.add_argument("--across", type=int, choices=_ACROSS, help="with fewest: cells across each contact")
    options = parser.parse_args()
    contacts = CONTACTS[options.contacts]
    if options.across is not None:
        if options.contacts != "fewest":
            parser.error("--across goes with --contacts fewest")
        contacts = partial(fewest_scene, across=options.across)
    rng = np.random.default_rng(options.seed)
    truth: dict[str, list[float]] = {name: [] for name in ESTIMATED}
    estimate: dict[str, list[float]] = {name: [] for name in ESTIMATED}
    scale: dict[str, list[float]] = {name: [] for name in ESTIMATED}
    count = unsolved = 0
    while count < options.cases:
        scene = contacts(rng, options.discretisation)
        nx, ny = (_FINER.get(options.contacts, 4) * n for n in scene.mesh.cells)
        fine_mesh = Mesh(scene.mesh.size, (nx, ny))
        if options.contacts == "fewest":
            fine_mesh = Mesh(fitted_size(scene, 1.25, (128, 128)), (128, 128))
        cells: Any = "aligned" if options.truth == "aligned" else scene.discretisation
        own, fine = solve_scene(scene), solve_scene(replace(scene, mesh=fine_mesh, discretisation=cells))
        if own.status != Status.SOLVED or fine.status != Status.SOLVED:
            unsolved += 1
            continue
        count += 1
        force = scene.friction * scene.load
        for name in ESTIMATED:
            truth[name].append(abs(own.scalars[name] - fine.scalars[name]))
            estimate[name].append(own.scalars[f"{name}_error"])
            by = {"force_x": force, "force_y": force, "moment_z": force * fine.scalars["contact_radius"]}
            scale[name].append(by.get(name, abs(fine.scalars[name]) or 1.0))
    left_out = counted(unsolved, "further contact")
    across = f" --across {options.across}" if options.across else ""
    print(f"`--discretisation {options.discretisation} --contacts {options.contacts}{across}", end=" ")
    print(f"--seed {options.seed} --cases {count}`: {left_out} left out: not solved on one of the two meshes.\n")
    print(
        "| scalar | within estimate, % | estimate / true error, median | true error, median, % "
        "| true error, 90th percentile, % |"
    )
    print("| --- | --- | --- | --- | --- |")
    for name in ESTIMATED:
        e, b, s = (np.array(values[name]) for values in (truth, estimate, scale))
        seen = e > 1e-9 * s
        if 2 * seen.sum() < len(e):  # a force or moment that vanishes by symmetry
            continue
        ratio, (middle, most) = np.median(b[seen] / e[seen]), 100.0 * np.percentile(e / s, (50, 90))
        print(f"| {name} | {100 * np.mean(e <= b):.0f} | {ratio:.1f} | {middle:.2g} | {most:.2g} |")


if __name__ == "__main__":
    main()
