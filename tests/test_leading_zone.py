"""Slip zones at the leading edge on discrete cells against strips solved densely, and the slip that is known there."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from contacts import steel
from scipy.optimize import brentq

from rcstudy.mechanics.aligned import AlignedContact
from rcstudy.mechanics.contact import solve_normal, solve_rolling
from rcstudy.mechanics.edge_slip import OF_HALF_SPACE
from rcstudy.mechanics.exact import contact_modulus, hertz_contact
from rcstudy.mechanics.scene import Creepage, Mesh, Scene
from rcstudy.mechanics.subcell.leading_zone import numbers
from rcstudy.mechanics.subcell.moved_rows import EDGE

ZONES = numbers(5, EDGE, OF_HALF_SPACE)


class Strip:
    """A strip of length L (cells) with the pressure sqrt(r (L - r)), bodies unlike in (1 - 2 nu)/G and friction 1.

    `growth`: beta/(pi mu), by which |q|/p grows for each factor e towards the leading edge; `creepage`: in units of the
    slip by tractions of 1 MPa in half a cell; `finer`: cells per cell. Solved densely, one cell at a time.
    """

    def __init__(self, length: float, growth: float, creepage: float, finer: int) -> None:
        long = length * finer
        self.r = np.arange(math.ceil(long - EDGE)) + EDGE
        ends = np.append(np.append(0.0, self.r[:-1] + 0.5), long)
        half = 0.5 * long
        x = np.clip((ends - half) / half, -1.0, 1.0)
        self.p = np.diff(0.5 * half**2 * (x * np.sqrt(1.0 - x * x) + np.arcsin(x))) / finer
        between = 0.5 * (self.p + np.append(0.0, self.p[:-1]))
        nearest = np.append(0.0, between[:-1]) + np.append(between[1:], 0.5 * self.p[-1])
        slip = between + (2.0 * between - nearest) / 12.0
        slip[0] -= OF_HALF_SPACE * self.p[0]
        number = np.arange(self.r.size)
        matrix = -1.0 / (np.pi * (number[:, None] - number - 0.5))
        known = creepage + np.pi * growth * slip
        state = np.zeros(self.r.size)
        for _ in range(100):
            stick = state == 0.0
            q = state * self.p
            q[stick] = np.linalg.solve(matrix[np.ix_(stick, stick)], -(known + matrix @ q)[stick])
            s = known + matrix @ q
            new = np.where(stick & (np.abs(q) > self.p), np.sign(q), state)
            new[~stick & (s * state > 0.0)] = 0.0
            if (new == state).all():
                break
            state = new
        assert (new == state).all()
        self.q, self.slips, self.finer = q, state != 0.0, finer
        self.leading = int(np.argmin(self.slips))  # slip cells at the leading end
        self.v = q[self.leading] / self.p[self.leading]
        self.force, self.sticking = q.sum() / finer, float((~self.slips).sum()) / finer


def missed(growth: float, slips: int, v: float) -> tuple[float, float]:
    """E and w of the zone in front of which `slips` cells slip, the first stick cell having q = v p."""
    c = ZONES[slips]
    log = ((v * c[6] - c[2]) / growth - c[0]) / c[1]
    w = 4.0 * math.exp(log - 2.0)
    return w - 2.0 * (c[3] + log * c[4] + c[5] / growth), w


@pytest.mark.heavy
@pytest.mark.parametrize(
    ("growth", "creepage", "slips"), [(0.2, -10.0, 0), (0.2, 0.0, 0), (0.25, -5.0, 1), (0.3, 5.0, 1), (0.35, 0.0, 1)]
)
def test_zone_of_a_strip(growth: float, creepage: float, slips: int) -> None:
    """The first stick cell tells the width, to a twelfth of a cell, and the force that coarse cells make too large."""
    length = 150.0
    coarse, fine = (Strip(length, growth, creepage, finer) for finer in (1, 12))
    assert coarse.leading == slips
    e, w = missed(growth, slips, coarse.v)
    found = (fine.leading + 0.25) / 12.0
    assert w == pytest.approx(found, abs=0.09)
    unit = 0.5 * np.pi * 0.5 * length * growth * math.sqrt(fine.sticking / length)
    assert (coarse.force - fine.force) / unit == pytest.approx(2.0 * e, abs=0.025)
    assert e > 0.03


def test_number_of_slip_cells_changes_where_tractions_reach_the_bound() -> None:
    """A cell that is about to slip, and one that has just begun to: the same zone, and the same is missed of it."""
    for growth in (0.2, 0.6, 1.2):
        for slips in range(4):
            c, after = ZONES[slips : slips + 2]
            log = ((c[6] - c[2]) / growth - c[0]) / c[1]
            # v of the next cell in the zone with one slip cell more
            v = growth * (after[0] + log * after[1] + after[2] / growth) / after[6]
            now, then = missed(growth, slips, 1.0), missed(growth, slips + 1, v)
            assert now == pytest.approx(then, abs=1e-9)


def test_numbers_are_those_of_a_long_strip() -> None:
    """h against a dense solution: tractions of stick under a root of pressure, but for a multiple of g."""
    n = 1500
    r = np.arange(n) + EDGE
    b = np.diff(np.append(0.0, r + 0.5) ** 1.5) / 1.5
    between = 0.5 * (b + np.append(0.0, b[:-1]))
    s = between.copy()
    s[:-1] += (2.0 * between[:-1] - between[1:] - np.append(0.0, between[:-2])) / 12.0
    s[0] -= OF_HALF_SPACE * b[0]
    number = np.arange(n)
    matrix = -1.0 / (np.pi * (number[:, None] - number - 0.5))
    h, g = np.linalg.solve(matrix, -np.stack([np.pi * s, np.ones(n)], axis=1)).T
    g *= 0.5 * math.sqrt(math.pi) / g[0]
    # c0 and c1 of no slip cell are h_0 and g_0; of one, what is left of h_1 and g_1 after half of these
    multiple = (ZONES[0, 0] - h[0]) / g[0]
    assert ZONES[0, 1] == pytest.approx(g[0], rel=1e-12)
    # the strip's end is felt like 7/n
    assert ZONES[1, 0] == pytest.approx(h[1] + multiple * g[1] - 0.5 * ZONES[0, 0], abs=6e-3)
    assert ZONES[1, 1] == pytest.approx(g[1] - 0.5 * g[0], abs=2e-3)
    assert [ZONES[1, 3], ZONES[1, 4]] == pytest.approx([ZONES[0, 0] / math.sqrt(math.pi), g[0] / math.sqrt(math.pi)])


def test_zone_without_slip_cells_ends_at_half_of_where_stick_would_reach_the_bound() -> None:
    """Nothing of it is there: E = w, which is 4 e^-2 of w0."""
    e, w = missed(0.4, 0, 0.5)
    assert e == pytest.approx(w, rel=1e-14)
    c = ZONES[0]
    w0 = math.exp(brentq(lambda log: 0.4 * (c[0] + log * c[1] + c[2] / 0.4) / c[6] - 0.5, -9.0, 2.0))
    assert w == pytest.approx(4.0 * math.exp(-2.0) * w0, rel=1e-12)


def rigid_ball(cells: int, creepage: Creepage) -> Scene:
    scene = steel(Mesh((0.66, 0.66), (cells, cells)), counterbody=None, friction=0.15, creepage=creepage)
    return replace(scene, discretisation="aligned")


def test_slip_by_pressure_at_centres_of_leading_cells() -> None:
    """Hertz's own, weighted with the pressure over each cell; interpolated it is more than three times as far off."""
    scene = rigid_ball(26, Creepage(0.0, 0.01))
    contact = AlignedContact(solve_normal(scene))
    hertz = hertz_contact(scene.radius, scene.load, contact_modulus(scene.substrate, None))
    a, largest = hertz.a[0], 1.5 * scene.load / math.pi / hertz.a[0] ** 2
    nu, modulus = scene.substrate.nu, scene.substrate.E

    def exact(x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """-du_x/dx, by u = -(1 - 2 nu)(1 + nu)/(3 E) a^2 p0/r (1 - (1 - r^2/a^2)^1.5) along the radius."""
        square = x * x + y * y
        inside = np.maximum(1.0 - square / a**2, 0.0)
        f = (1.0 - inside**1.5) / square
        slope = 2.0 * x * (1.5 * np.sqrt(inside) / a**2 - f) / square
        return np.asarray((1.0 - 2.0 * nu) * (1.0 + nu) / (3.0 * modulus) * a * a * largest * (f + x * slope))

    x, y = contact.centres
    dx = scene.mesh.spacing[0]
    local = contact.local_slip(scene.friction)
    assert local is not None
    s, rows = contact.slip_by_pressure[:, 0], contact.rows
    errors = []
    for j in range(rows.count.size // 2 - 3, rows.count.size // 2 + 4):
        one, two = rows.index[:2, j]
        edge = x[one] + EDGE * dx
        inside = edge - dx * (EDGE + 0.5) * (np.arange(400) + 0.5) / 400
        weight = np.sqrt(np.maximum(1.0 - (inside**2 + y[one] ** 2) / a**2, 0.0))
        mean = np.sum(weight * exact(inside, np.full(400, y[one]))) / weight.sum()
        straight = 0.5 * (s[one] + s[two])
        known = straight + local[0, one] * (local[3, one] - 0.5 * (local[2, one] + local[2, two]))
        errors.append([straight - mean, known - mean])
    straight_off, known_off = np.abs(errors).mean(axis=0) / abs(s).max()
    assert straight_off > 0.03
    assert known_off < 0.3 * straight_off


@pytest.mark.parametrize("friction", [0.1, 0.4])
def test_local_slip_of_a_half_space(friction: float) -> None:
    """(1 - 2 nu)/(2 G) n_x n of the pressure, of which 0.8 counts; cancelled where slip is small.

    One contact serves several coefficients of friction.
    """
    scene = rigid_ball(26, Creepage(0.0, 0.01))
    contact = AlignedContact(solve_normal(scene))
    nu, shear = scene.substrate.nu, 0.5 * scene.substrate.E / (1.0 + scene.substrate.nu)
    contact.local_slip(0.2)
    local = contact.local_slip(friction)
    assert local is not None
    rows = contact.rows
    held = rows.count > 1
    leading, n = rows.index[0, held], rows.normals[:, held]
    np.testing.assert_allclose(local[:2, leading], 0.8 * (0.5 - nu) / shear * n[0] * n, rtol=1e-12)
    assert ((local[0] != 0.0).sum(), len(leading)) == (2 * held.sum(), held.sum())
    begins = 0.12 * math.hypot(friction * (1.0 - nu), 0.5 - nu) / shear
    np.testing.assert_allclose(local[4], begins * rows.weighted, rtol=1e-12)
    np.testing.assert_array_equal(local[3], rows.weighted)


@pytest.mark.heavy
@pytest.mark.parametrize(
    ("longitudinal", "lateral", "spin"),
    [(0.0, 3.0, 0.0), (-1.05, 1.05, 0.0), (0.0, 0.0, 1.5), (-0.6, 0.0, 0.0), (-1.0, 0.0, 0.0)],
)
def test_forces_of_bodies_unlike_with_little_friction(longitudinal: float, lateral: float, spin: float) -> None:
    """A steel ball on a rigid plane, friction 0.15, ten cells a radius: forces are 0.3 to 0.7 % of mu P off without."""
    full, a = 0.15 * 0.2533 / 50.0, 0.2533
    creepage = Creepage(longitudinal * full, lateral * full, spin * full / a)
    scene, fine = rigid_ball(26, creepage), rigid_ball(208, creepage)

    def forces(scene: Scene) -> np.ndarray:
        contact = AlignedContact(solve_normal(scene))
        rolling = solve_rolling(contact, scene)
        unseen = contact.unseen_slip(rolling, scene.friction)
        return np.array(contact.resultant(rolling, scene.friction)[:2]) - [unseen.force_x, unseen.force_y]

    off = np.abs(forces(scene) - forces(fine)) / (scene.friction * scene.load)
    assert off.max() < 0.002
