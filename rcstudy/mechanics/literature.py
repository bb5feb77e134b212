"""The publications that equations and methods come from, and which of them are behind the results of a scene.

Code and documents cite them by their short names, such as "Johnson 1985", but for the first, which is the paper ("P"
in the documents). Cubes name those behind their numbers.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from itertools import pairwise

from rcstudy.mechanics.scene import Scene


@dataclass(frozen=True)
class Parts:
    """Which parts of the mechanics a scene needs."""

    layered: bool
    stiffened: bool  # a layer is stiffer than what is below it
    oblong: bool  # radii of curvature differ
    rolling: bool  # tractions are computed
    coupled: bool  # pressure and tractions act on each other
    aligned: bool
    newton: bool


@dataclass(frozen=True)
class Publication:
    """A publication: its name in the code, full reference, what for, and whether scenes of given `Parts` use it."""

    name: str
    reference: str
    purpose: str
    serves: Callable[[Parts], bool]


def parts(scene: Scene) -> Parts:
    """The parts of the mechanics that `scene` needs."""
    layers = scene.joined.layers
    rolling = scene.creepage is not None
    return Parts(
        layered=bool(layers),
        stiffened=any(one.compliance < below.compliance for one, below in pairwise((*layers, scene.substrate))),
        oblong=scene.radius[0] != scene.radius[1],
        rolling=rolling,
        coupled=scene.is_coupled,
        aligned=scene.discretisation == "aligned",
        newton=rolling and scene.method == "newton",
    )


def behind(scenes: Iterable[Scene]) -> tuple[Publication, ...]:
    """The publications that results of such `scenes` rest on, in the order of `PUBLICATIONS`.

    Some of them only where a scene needs it: whether layers bend like plates, or Newton's method fails, its solution
    shows.
    """
    kinds = {parts(scene) for scene in scenes}
    return tuple(one for one in PUBLICATIONS if any(one.serves(kind) for kind in kinds))


def listed(publications: Iterable[Publication]) -> str:
    """A line for each publication: name, colon, full reference. As in the attribute `references` of cubes."""
    return "\n".join(f"{one.name}: {one.reference}" for one in publications)


PUBLICATIONS = (
    Publication(
        "Tribology Letters 2021",
        "Three-dimensional rolling contact with one or two elastic layers. Tribology Letters 69, 139 (2021),"
        " doi:10.1007/s11249-021-01514-x",
        "the problem and its equations; the paper's study and its method `paper-cg`",
        lambda need: True,
    ),
    Publication(
        "Johnson 1985",
        "K. L. Johnson, Contact Mechanics. Cambridge University Press, Cambridge (1985)",
        "Hertz's contact, responses and coefficients of half-spaces, Carter's strip",
        lambda need: True,
    ),
    Publication(
        "Love 1929",
        "A. E. H. Love, The stress produced in a semi-infinite solid by pressure on part of the boundary. Philosophical"
        " Transactions of the Royal Society of London A 228, 377-420 (1929)",
        "influence coefficients of half-spaces",
        lambda need: True,
    ),
    Publication(
        "Polonsky and Keer 1999",
        "I. A. Polonsky, L. M. Keer, A numerical method for solving rough contact problems based on the multi-level"
        " multi-summation and conjugate gradient techniques. Wear 231, 206-219 (1999)",
        "conjugate gradients for the pressure",
        lambda need: True,
    ),
    Publication(
        "Vollebregt 2014",
        "E. A. H. Vollebregt, A new solver for the elastic normal contact problem using conjugate gradients, deflation,"
        " and an FFT-based preconditioner. Journal of Computational Physics 257, 333-351 (2014)",
        "their preconditioner",
        lambda need: True,
    ),
    Publication(
        "Carlson 1995",
        "B. C. Carlson, Numerical computation of real or complex elliptic integrals. Numerical Algorithms 10, 13-26"
        " (1995)",
        "ellipses of Hertz's contact",
        lambda need: need.oblong,
    ),
    Publication(
        "Hamilton 2000",
        "A. J. S. Hamilton, Uncorrelated modes of the non-linear power spectrum. Monthly Notices of the Royal"
        " Astronomical Society 312, 257-284 (2000)",
        "Hankel transforms of the responses of layers",
        lambda need: need.layered,
    ),
    Publication(
        "Hintermüller, Ito and Kunisch 2003",
        "M. Hintermüller, K. Ito, K. Kunisch, The primal-dual active set strategy as a semismooth Newton method. SIAM"
        " Journal on Optimization 13, 865-888 (2003)",
        "pressure under layers that bend like plates",
        lambda need: need.stiffened,
    ),
    Publication(
        "Kalker 1990",
        "J. J. Kalker, Three-Dimensional Elastic Bodies in Rolling Contact. Kluwer, Dordrecht (1990)",
        "steady rolling on cells",
        lambda need: need.rolling,
    ),
    Publication(
        "Saad 1993",
        "Y. Saad, A flexible inner-outer preconditioned GMRES algorithm. SIAM Journal on Scientific Computing 14,"
        " 461-469 (1993)",
        "linear systems of Newton's method",
        lambda need: need.newton,
    ),
    Publication(
        "Eisenstat and Walker 1996",
        "S. C. Eisenstat, H. F. Walker, Choosing the forcing terms in an inexact Newton method. SIAM Journal on"
        " Scientific Computing 17, 16-32 (1996)",
        "how far these are solved",
        lambda need: need.newton,
    ),
    Publication(
        "Wiener and Hopf 1931",
        "N. Wiener, E. Hopf, Über eine Klasse singulärer Integralgleichungen. Sitzungsberichte der Preussischen"
        " Akademie der Wissenschaften, Physikalisch-mathematische Klasse, 696-706 (1931)",
        "edges on cells: in the preconditioner, and with `aligned` their place and corrections",
        lambda need: need.newton or need.aligned,
    ),
    Publication(
        "Rice 1968",
        "J. R. Rice, A path independent integral and the approximate analysis of strain concentration by notches and"
        " cracks. Journal of Applied Mechanics 35, 379-386 (1968)",
        "how pressure rises within skins behind what sticks, for the error bars",
        lambda need: need.coupled and need.stiffened,
    ),
    Publication(
        "Alart and Curnier 1991",
        "P. Alart, A. Curnier, A mixed formulation for frictional contact problems prone to Newton like solution"
        " methods. Computer Methods in Applied Mechanics and Engineering 92, 353-375 (1991)",
        "pressure and tractions together",
        lambda need: need.coupled,
    ),
    Publication(
        "Kalker 1967",
        "J. J. Kalker, On the Rolling Contact of Two Elastic Bodies in the Presence of Dry Friction. Doctoral thesis,"
        " Delft University of Technology (1967)",
        "forces of rows that stick, with `aligned`",
        lambda need: need.aligned and need.rolling,
    ),
    Publication(
        "Haines and Ollerton 1963",
        "D. J. Haines, E. Ollerton, Contact stress distributions on elliptical contact surfaces subjected to radial and"
        " tangential forces. Proceedings of the Institution of Mechanical Engineers 177, 95-114 (1963)",
        "outline of slip zones, with `aligned`",
        lambda need: need.aligned and need.rolling,
    ),
    Publication(
        "Morozov 1966",
        "V. A. Morozov, On the solution of functional equations by the method of regularization. Soviet Mathematics"
        " Doklady 7, 414-417 (1966)",
        "how smooth widths of slip zones are, with `aligned`",
        lambda need: need.aligned and need.rolling,
    ),
    Publication(
        "Panagiotopoulos 1975",
        "P. D. Panagiotopoulos, A nonlinear programming approach to the unilateral contact-, and friction-boundary"
        " value problem in the theory of elasticity. Ingenieur-Archiv 44, 421-432 (1975)",
        "solving for one with the other held, in turn: with `aligned`, to fit windows, and if Newton's method fails",
        lambda need: need.coupled,
    ),
    Publication(
        "Anderson 1965",
        "D. G. Anderson, Iterative procedures for nonlinear integral equations. Journal of the ACM 12, 547-560 (1965)",
        "how these turns converge",
        lambda need: need.coupled,
    ),
    Publication(
        "Walker and Ni 2011",
        "H. F. Walker, P. Ni, Anderson acceleration for fixed-point iterations. SIAM Journal on Numerical Analysis 49,"
        " 1715-1735 (2011)",
        "the same",
        lambda need: need.coupled,
    ),
)
