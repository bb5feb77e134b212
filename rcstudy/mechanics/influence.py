r"""Influence coefficients: displacement at a cell's centre due to unit stress on another cell.

The contributions of both bodies as half-spaces are closed forms (Love for pressure, Cerruti for tractions). The
contribution of the layers, i.e. the difference from a half-space of the top material, is smooth. Its Green's functions
follow from four radial functions, with D = alpha times the difference of the frequency responses (`layered.py`),

    s(r) = 1/(2 pi) int Da J0(alpha r) d alpha                u_z by p:  s
    d(r) = 1/(4 pi) int (Dc + Dd) J0(alpha r) d alpha         u_x by qx: d - g cos(2 theta)
    g(r) = 1/(4 pi) int (Dc - Dd) J2(alpha r) d alpha         u_x by qy:   - g sin(2 theta)
    p(r) = 1/(2 pi) int Db J1(alpha r) d alpha                u_x by p:    - p cos(theta)

computed on logarithmic grids of r by fast Hankel transforms (`hankel.py`; Hamilton 2000), which resolve layers of a
micrometre and wavelengths of a metre equally well. Near the origin cells are integrated in polar coordinates with a
tabulated radial integral, so that a layer may be far thinner than a cell. The other cells are integrated by Gauss
points, whose number falls with the distance.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable
from copy import copy
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, TypeVar

import numpy as np

from rcstudy.mechanics import edge_slip
from rcstudy.mechanics.convolution import COMPONENTS, good_length
from rcstudy.mechanics.half_line import HALF_SPACE, OF_NO_LAYERS, HalfLine, for_pressure, for_tractions, wave_numbers
from rcstudy.mechanics.kernels import coefficients
from rcstudy.mechanics.layered import frequency_response, half_space_response, response_difference
from rcstudy.mechanics.missed import Missed, missed
from rcstudy.mechanics.numerics.hankel import hankel_transforms, running_integral
from rcstudy.mechanics.scene import Layer, Material
from rcstudy.mechanics.skins import rise_at_cusp

T = TypeVar("T")

_LOG_STEP = 0.03  # of the grids of alpha and r
_BIAS = -0.5  # makes D(alpha) / alpha^bias vanish at both ends of the grid, and the transform as well
_LOW, _HIGH = 1e-24, 2e4  # range of alpha, in units of 1/(total thickness) and 1/(thinnest layer)
_IMAGE, _LEAST_IMAGE = 1e-9, 1e-12  # part of zz that periodic images may be, and that is left if they would be more
_LOWEST = 1e-100  # 1/mm: squares have to be in the range of floating point numbers
# Thin, soft, incompressible layers, and stiff skins on soft layers, have kernels that decay within a few cells. For
# 1500 stacks of one to four layers (E ratios 0.01 to 100, 0.01 to 20 cells thick, nu 0 to 0.5, cells up to 10:1) the
# numbers below give errors of the coefficients, over the largest one, of 3e-12 in the median and 1e-9 at worst, against
# finer tables and many more points; 3 x 3 points and 16 angles in all give 2e-9 and 1e-5.
_NEAR = 5.0  # cells closer than this many (larger) cell sides are integrated in polar coordinates
_ANGLES, _PIECE = 16, 1.0  # Gauss points per piece of the angular variable, and the largest length of a piece
_RINGS = {0.0: 6, 6.5: 5, 9.0: 4, 18.0: 3, 50.0: 2}  # distance in (larger) cell sides: Gauss points along each side
# Far from a top layer that is softer than all below together by more than this factor, what the half-spaces and the
# layers contribute cancels. The distances then grow such that errors of n points, as the power -2 n of the distance,
# remain the same part of the sum. (Beyond 50 cells on 1e-6 of the stiffness: 1e-3 without, 1e-7 with it.)
_SOFT = 10.0
_TOGETHER = np.array([1.0, -1.0, 1.0, 1.0])  # signs with which body 2's responses a, b, c, d add to body 1's
_MOST_CELLS = 16  # length of the longest waves, over 2 pi dx, at which bodies are looked at (`Influence._of_cells`)
_SCALE, _SCALES = 1.5, 40  # scale times wave number, and number of scales, in `Influence.skin_at_edge`
_SKIN = 0.2  # see `Influence.pull_under_skin`
_APART = 1.1  # of wave numbers at which `Influence.squeezed` takes a slope
_KEPT = 20  # cached symbols and operators of one mesh; a contact needs 4 to 11, more if its box has to be enlarged


@dataclass(frozen=True)
class RadialTables:
    """Radial functions s, d, g, p at log r = log_r0 + step * (0..n-1), and their integrals.

    kernel [n, 4] (mm/MPa/mm^2): the functions; primitive [n, 4]: their integrals r dr from 0 to r.
    """

    log_r0: float
    step: float
    kernel: np.ndarray
    primitive: np.ndarray


def radial_tables(substrate: Material, layers: tuple[Layer, ...], r_max: float) -> RadialTables:
    """Tables of the four radial functions of the layers' contribution, for distances up to `r_max` (mm).

    By fast Hankel transforms (Hamilton 2000). The tables start at 5e-5 of the thinnest layer, where the functions have
    reached their limits to working precision.
    """
    thin = min(layer.thickness for layer in layers)
    high, low = math.log(_HIGH / thin), math.log(_lowest(substrate, layers, thin, r_max))
    # rounded up to a length that transforms fast: these are few, so that most stacks share the kernels of `hankel.py`
    n = good_length(math.ceil((high - low) / _LOG_STEP))
    log_alpha = high + _LOG_STEP * np.arange(1 - n, 1)
    da, db, dc, dd = response_difference(substrate, layers, np.exp(log_alpha))
    functions = np.stack((da, 0.5 * (dc + dd), 0.5 * (dc - dd), db)) / (2.0 * math.pi)
    # a margin of 8 nodes serves the interpolation near r_max
    count = min(n, max(8, math.ceil((math.log(r_max) + high) / _LOG_STEP) + 8))
    log_r, transforms = hankel_transforms(functions, log_alpha, _LOG_STEP, (0, 0, 2, 1), _BIAS, count)
    kernel = np.ascontiguousarray(transforms.T)
    area = kernel * np.exp(2.0 * log_r)[:, None]
    # below the table s and d are constants, g ~ r^2, p ~ r: int_0^r0 f r dr
    below = area[0] / np.array([2.0, 2.0, 4.0, 3.0])
    return RadialTables(float(log_r[0]), _LOG_STEP, kernel, running_integral(area, _LOG_STEP) + below)


def _lowest(substrate: Material, layers: tuple[Layer, ...], thin: float, r_max: float) -> float:
    """Lower end (1/mm) of the range of alpha for distances up to `r_max` (mm); `thin`: the least thickness h (mm).

    The transform takes the range to repeat itself. The image of the highest alpha, about 1/h of the thinnest layer,
    adds a constant at all distances: sqrt(low h/_HIGH)/h times the layer's compliance, where that of the substrate over
    the distance counts. (With `_LOW` alone it is 4 % of the approach under a film of 1 MPa and 3e-10 mm on steel.)
    """
    softest = max(1.0, *(substrate.E / layer.E for layer in layers))
    low = _LOW / sum(layer.thickness for layer in layers)
    image = softest * r_max / thin * math.sqrt(low * thin / _HIGH)
    if image <= _IMAGE:
        return low
    return max(low * (_LEAST_IMAGE / image) ** 2, _LOWEST)


class Influence:
    """Influence coefficients of both bodies together on one mesh, computed for as many cells as are requested.

    Tangential displacements are the differences u1 - u2, normal ones the sum by which the gap opens. Body 1 is `layers`
    (from the surface down) on `substrate`, body 2 (`counterbody`) a half-space or rigid (None). `spacing`: dx, dy (mm);
    `reach`: the largest distance (mm) that will be requested.
    """

    def __init__(
        self,
        substrate: Material,
        layers: tuple[Layer, ...],
        counterbody: Material | None,
        spacing: tuple[float, float],
        reach: float,
    ) -> None:
        self.spacing = spacing
        self._substrate = substrate
        self._layers = layers
        self._top: Material = layers[0] if layers else substrate
        self._counterbody = counterbody
        self._tables = radial_tables(substrate, layers, reach + math.hypot(*spacing)) if layers else None
        self._quadrant = self._layer_part = np.zeros((len(COMPONENTS), 0, 0))
        self._made: dict[Hashable, Any] = {}
        self._numbers: dict[Hashable, Any] = {}
        self._coarser: Influence | None = None

    @property
    def layered(self) -> bool:
        """Whether there are layers."""
        return bool(self._layers)

    def normal_response(self, alpha: np.ndarray) -> np.ndarray:
        """Frequency response [n] of u_z to p (mm/MPa), both bodies together, at wave numbers `alpha` [n] (1/mm)."""
        response: np.ndarray = self._responses(alpha)[0]
        return response

    def traction_responses(self, alpha: np.ndarray) -> np.ndarray:
        """Frequency responses [2, n] (mm/MPa) to tractions along and across the wave vector, both bodies together.

        The displacements are those in the direction of the tractions; `alpha` [n]: wave numbers (1/mm).
        """
        responses: np.ndarray = self._responses(alpha)[2:]
        return responses

    def contrast(self, shape: tuple[int, int], response: Callable[[np.ndarray], np.ndarray]) -> float:
        """How much more a long wave yields than a shorter one would on a half-space: 1 there, more under plates.

        The `response` times alpha, constant on a half-space, is taken at wavelengths from 2 pi times the size of a box
        of `shape` cells down to two cells, and the largest value at longer waves compared with each.
        """
        if not self.layered:
            return 1.0
        dx, dy = self.spacing
        longest, shortest = max(shape[0] * dx, shape[1] * dy), min(dx, dy) / math.pi
        alpha = np.exp(np.linspace(-math.log(longest), -math.log(shortest), 40))
        compliance = response(alpha) * alpha
        return float((np.maximum.accumulate(compliance, axis=-1) / compliance).max())

    def stiffer_across(self, radius: float) -> float:
        """Compliance to pressure over that to tractions along the wave, for a contact of `radius` (mm).

        1 on half-spaces, thousands under plates, which bend far more easily than they stretch.
        """
        normal, _, along, _ = self._responses(np.array([2.0 / radius]))[:, 0]
        return float(normal / along)

    def _responses(self, alpha: np.ndarray) -> np.ndarray:
        """Frequency responses a, b, c, d [4, n] (mm/MPa) of both bodies together at `alpha` [n] (1/mm): `layered.py`.

        That of u_x to p (b) is body 1's less body 2's, as their surfaces face each other.
        """
        responses = frequency_response(self._substrate, self._layers, alpha)
        if self._counterbody is not None:
            responses += (_TOGETHER * half_space_response(self._counterbody))[:, None] / alpha
        return responses

    def half_line(self, side: float) -> HalfLine:
        """Discrete half-line of pressures, for an edge across cells of length `side` (mm)."""
        if not self.layered:
            return HALF_SPACE
        return self._known(("half-line", side), lambda: for_pressure(self._of_half_lines(side)[0]))

    def half_line_of_tractions(self, side: float) -> HalfLine:
        """Discrete half-line of tractions normal to a stick-slip border, in aligned cells of length `side` (mm)."""
        if not self.layered:
            return OF_NO_LAYERS
        return self._known(("border", side), lambda: for_tractions(self._of_half_lines(side)[2]))

    @property
    def exaggerated_slip(self) -> float:
        """Slip by pressure that aligned cells exaggerate in leading cells, per unit of their pressure (1/MPa).

        See `edge_slip.py`.
        """
        if not self.layered:
            return edge_slip.OF_HALF_SPACE * self.slip_under_pressure
        dx = self.spacing[0]

        def made() -> float:
            shift = self.half_line(dx).shift - HALF_SPACE.shift
            return edge_slip.exaggeration(self._responses(edge_slip.wave_numbers(dx))[:3], dx, shift)

        return self._known("exaggerated slip", made)

    def _of_half_lines(self, side: float) -> np.ndarray:
        """`_responses` [4, n], made once for both half-lines of cells of length `side` (mm)."""
        return self._known(("of half-lines", side), lambda: self._responses(wave_numbers(side)))

    def once(self, key: Hashable, make: Callable[[], T]) -> T:
        """Result of `make` (for instance symbols on some box), computed at the first call with `key` and cached.

        The `_KEPT` most recently used results are kept, as contacts of many sizes have many boxes.
        """
        made: T = self._made.pop(key) if key in self._made else make()
        self._made[key] = made  # as the last one
        if len(self._made) > _KEPT:
            del self._made[next(iter(self._made))]
        return made

    def _known(self, key: Hashable, make: Callable[[], T]) -> T:
        """As `once`, for the few numbers that do not depend on a box: all are kept."""
        if key not in self._numbers:
            self._numbers[key] = make()
        known: T = self._numbers[key]
        return known

    def coarser(self) -> Influence:
        """The coefficients for cells of twice the size; the tables of the radial functions are shared."""
        if self._coarser is None:
            other = copy(self)
            other.spacing = 2.0 * self.spacing[0], 2.0 * self.spacing[1]
            other._quadrant = other._layer_part = np.zeros((len(COMPONENTS), 0, 0))
            other._made, other._numbers = {}, {}
            self._coarser = other  # once it is complete, as an interrupt may end this at any line
        return self._coarser

    @property
    def _of_cells(self) -> np.ndarray:
        """alpha times `_responses` [4, n] (1/MPa) at wave numbers alpha of 1/dx over 1 to `_MOST_CELLS` cells."""

        def made() -> np.ndarray:
            alpha = 1.0 / (self.spacing[0] * np.arange(1, _MOST_CELLS + 1))
            found: np.ndarray = alpha * self._responses(alpha)
            return found

        return self._known("of cells", made)

    @property
    def slip_under_pressure(self) -> float:
        """Slip (u_i - u_(i+1))/dx per unit of pressure at the same point (1/MPa), in plane strain.

        It is (1 - 2 nu)/(2 G) of one body less that of the other (Johnson 1985, 2.25a). With layers alpha b(alpha) at
        alpha = 1/dx is used instead: for such short waves a layer a few cells thick is a half-space.
        """

        return float(self._of_cells[1, 0])

    @property
    def most_slip_under_pressure(self) -> float:
        """The largest magnitude of `slip_under_pressure` for any wave of the bodies' own (1/MPa), for error bars.

        That is alpha b(alpha) at alpha of 1/dx over 1 to `_MOST_CELLS` cells: where the layer on top moves like the
        counterbody, e.g. if both are incompressible or rigid, pressure causes slip by longer waves alone.
        """
        return float(np.abs(self._of_cells[1]).max())

    @property
    def local_part_of_slip(self) -> float:
        """Part (0 to 1) of the slip by pressure that pressure causes on the spot: all of it on half-spaces."""
        most = self.most_slip_under_pressure
        return abs(self.slip_under_pressure) / most if most > 0.0 else 1.0

    @property
    def slip_under_tractions(self) -> tuple[float, float]:
        """alpha times the responses to tractions along and across a wave (1/MPa), at wave number alpha = 1/dx.

        On half-spaces the first is (1 - nu)/G (Johnson 1985, 2.25a), summed over the bodies, the second 1/G.
        """

        along, across = self._of_cells[2:, 0].tolist()
        return along, across

    @property
    def slip_by_pressure_over_tractions(self) -> float:
        """Dundurs' constant beta: `slip_under_pressure` over the like response to tractions along waves.

        Johnson 1985, section 5.1.
        """
        return self.slip_under_pressure / self.slip_under_tractions[0]

    @property
    def most_slip_by_pressure_over_tractions(self) -> float:
        """The largest magnitude of Dundurs' constant for any wave of `_of_cells`."""
        return float(np.abs(self._of_cells[1] / self._of_cells[2]).max())

    @property
    def pull_under_skin(self) -> float:
        """Dundurs' constant of what lies under a skin stiffer than itself, times how much more that yields; else 0.

        The former is the largest magnitude for any wave of `_of_cells`, the latter the largest normal response to
        these, times the wave number, over that to a wave of 1/dx; from 1 + `_SKIN` on it counts in full.
        """
        normal = self._of_cells[0]
        more = float(normal.max() / normal[0])
        return self.most_slip_by_pressure_over_tractions * more * min(1.0, (more - 1.0) / _SKIN)

    @property
    def skin_at_edge(self) -> tuple[float, float]:
        """Difference (-) of Dundurs' constant on a scale below that of a cell from its own, and that scale (mm).

        Beside the edge the top layers respond as half-spaces of their own, on scales as small as they are thin. Of all
        scales, `_SCALE` over the wave number and at most a cell, that with the largest product of the two counts. Both
        are 0 without layers.
        """
        if not self.layered:
            return 0.0, 0.0

        def made() -> tuple[float, float]:
            dx = self.spacing[0]
            shortest = 10.0 / min(min(layer.thickness for layer in self._layers), dx)
            alpha = np.geomspace(1.0 / dx, shortest, _SCALES)
            _, by_pressure, along, _ = self._responses(alpha)
            beta = by_pressure / along
            difference, scale = np.abs(beta - beta[0]), np.minimum(_SCALE / alpha, dx)
            most = int(np.argmax(difference * scale))
            return float(difference[most]), float(scale[most])

        return self._known("skin at edge", made)

    def cusp_in_skin(self, radius: float) -> float:
        """By how much pressure rises at borders of stick within layers that cells do not see, over mu p0 (Rice 1968).

        See `skins.py`; `radius` (mm): of the contact.
        """
        if not self.layered:
            return 0.0
        thinnest = min(layer.thickness for layer in self._layers)
        return rise_at_cusp(self._responses, self.spacing[0], radius, thinnest)

    def missed(self, radius: float) -> Missed:
        """What these cells miss of the responses of thin layers, in a contact of this radius (mm): `missed.py`.

        Of compliance the larger part of those by their two sides, of slip, which is along x, that by dx.
        """
        if not self.layered:
            return Missed()
        dx, dy = self.spacing
        along = missed(self._responses, dx, radius)
        across = along if dx == dy else missed(self._responses, dy, radius)
        return along._replace(compliance=max(along.compliance, across.compliance))

    def squeezed(self, radius: float) -> float:
        """How far (0 to 1) the layers respond like an incompressible film in a contact of this `radius` (mm).

        It is the exponent of k, as far as it lies between 0 and 1, in what they add to the substrate's response to
        waves of number k = 4/radius: 2 for thin incompressible films, which give way by being squeezed out sideways
        (k^2 h^3/(3 G)), 0 for thin compressible ones, -1 for thick ones. 0 if they make it stiffer.
        """
        if not self.layered:
            return 0.0
        alpha = 4.0 / radius * np.array([1.0 / _APART, _APART])
        added = frequency_response(self._substrate, self._layers, alpha)[0]
        added = (added - half_space_response(self._substrate)[0] / alpha).tolist()
        if min(added) <= 0.0:
            return 0.0
        return min(max(math.log(added[1] / added[0]) / (2.0 * math.log(_APART)), 0.0), 1.0)

    def as_half_space(self, most: int, tolerance: float) -> int:
        """Cells, at most `most` (of `_MOST_CELLS`), over which bodies respond as to waves of one cell: as half-spaces.

        For waves of numbers from 1/dx down to 1/dx over so many cells the responses to tractions along waves, times the
        wave number, and u_x by p over u_x by q_x, deviate from what they are at 1/dx by at most the relative
        `tolerance`.
        """
        if not self.layered:
            return most
        _, by_pressure, along, _ = self._of_cells[:, :most]
        parts = np.stack([along, by_pressure / along])
        alike = np.all(np.abs(parts - parts[:, :1]) <= tolerance * np.abs(parts[:, :1]), axis=0)
        return most if alike.all() else int(np.argmin(alike))

    def reach_of_tractions(self, length: float) -> float:
        """Part of the force by slip zones at the leading edge that layers leave in a contact of this `length` (mm).

        Over that by Hertz's pressure on half-spaces: the root of the ratio of the responses to tractions, times the
        wave number, to waves as long as the contact's radius and as short as a cell, at most 1 (`subcell/unseen.py`).
        """
        alpha = np.array([2.0 / length, 1.0 / self.spacing[0]])
        far, near = (alpha * self.traction_responses(alpha)[0]).tolist()
        return min(math.sqrt(far / near), 1.0)

    def quadrant(self, nx: int, ny: int) -> np.ndarray:
        """Coefficients at offsets i dx, j dy, i = 0..nx-1, j = 0..ny-1: array [6, >= nx, >= ny] in mm/MPa.

        Components as in `COMPONENTS`; negative offsets follow by parity (zz, xx, yy even; xy odd in x and in y; xp
        odd in x, yp odd in y).
        """
        have = self._quadrant.shape
        if have[1] < nx or have[2] < ny:
            layer_part = self._grown_layer_part(max(nx, have[1]), max(ny, have[2]))
            # assigned together, so that they stay consistent if memory runs out
            self._quadrant, self._layer_part = self._with_half_spaces(layer_part), layer_part
        return self._quadrant

    def around(self, padded: tuple[int, int], ahead: int = 0) -> np.ndarray:
        """`quadrant` for the offsets that symbols on a torus of `padded` cells need.

        `ahead`: number of additional cells along x, one for the upwind difference.
        """
        return self.quadrant(padded[0] // 2 + 1 + ahead, padded[1] // 2 + 1)

    def _grown_layer_part(self, nx: int, ny: int) -> np.ndarray:
        """Contribution of the layers, [6, nx, ny]; only cells not yet known are computed."""
        out = np.zeros((len(COMPONENTS), nx, ny))
        if self._tables is not None:
            _, have_x, have_y = self._layer_part.shape
            out[:, :have_x, :have_y] = self._layer_part
            layer_integrals(self._tables, self.spacing, (have_x, have_y), out, self._softness)
        return out

    @property
    def _softness(self) -> float:
        """Normal compliance of both bodies to the shortest waves over that to the longest ones."""
        near, far = (
            sum(float(half_space_response(m)[0]) for m in (body, self._counterbody) if m is not None)
            for body in (self._top, self._substrate)
        )
        return near / far

    def _with_half_spaces(self, layer_part: np.ndarray) -> np.ndarray:
        """Half-spaces in closed form (Johnson 1985, Eqs 3.18, 3.75, integrated) plus `layer_part` [6, nx, ny].

        Only cells not yet known are computed.
        """
        bodies = [(self._top, 1.0)]
        if self._counterbody is not None:
            bodies.append((self._counterbody, -1.0))
        # 1/(2 pi G), nu/(2 pi G), (1-2nu)/(4 pi G); the last one is a difference: pressure moves both surfaces the same
        # way along x
        g_inv = sum(1.0 / (2.0 * math.pi * m.G) for m, _ in bodies)
        nu_g = sum(m.nu / (2.0 * math.pi * m.G) for m, _ in bodies)
        dilation = sum(sign * (1.0 - 2.0 * m.nu) / (4.0 * math.pi * m.G) for m, sign in bodies)
        out = np.empty(layer_part.shape)
        have = self._quadrant.shape[1:]
        out[:, : have[0], : have[1]] = self._quadrant
        coefficients.half_spaces(*self.spacing, g_inv - nu_g, nu_g, dilation, *have, layer_part, out)
        return out


def layer_integrals(
    tables: RadialTables, spacing: tuple[float, float], have: tuple[int, int], out: np.ndarray, softness: float
) -> None:
    """Write the layers' contribution, integrated over the cells, into `out` [6, nx, ny].

    It is the difference from a half-space of the top material, of `softness` times the compliance of all below. Cells
    with i < have[0] and j < have[1] are known.
    """
    dx, dy = spacing
    _, nx, ny = out.shape
    side = max(dx, dy)
    near = min(nx, math.ceil(_NEAR * side / dx)), min(ny, math.ceil(_NEAR * side / dy))
    grid = tables.log_r0, tables.step, dx, dy
    if have[0] < near[0] or have[1] < near[1]:
        have = near
        coefficients.near_cells(tables.primitive, *grid, *near, *_gauss(_ANGLES), _PIECE, out)
    excess = max(1.0, softness / _SOFT)
    beyond = side * np.array([distance * excess ** (0.5 / points) for distance, points in _RINGS.items()])
    coefficients.far_cells(tables.kernel, *grid, *have, beyond, tuple(_gauss(n) for n in _RINGS.values()), out)


@lru_cache(maxsize=8)
def _gauss(points: int) -> tuple[np.ndarray, np.ndarray]:
    """Gauss-Legendre nodes and weights on [-1/2, 1/2]."""
    nodes, weights = 0.5 * np.array(np.polynomial.legendre.leggauss(points))
    nodes.setflags(write=False)
    weights.setflags(write=False)
    return nodes, weights
