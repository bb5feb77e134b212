"""The result of a case (status, scalars, fields, proof) and the catalogue of all stored variables."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from enum import IntEnum
from functools import cache
from typing import Literal

import numpy as np


class Status(IntEnum):
    """How a case ended; the numbers of a case that is not SOLVED must not be used as results."""

    SOLVED = 0
    NOT_CONVERGED = 1
    PROOF_FAILED = 2
    REFUSED = 3
    ERROR = 4

    @classmethod
    def _missing_(cls, value: object) -> None:
        raise ValueError(f"{value} is no status of a case")  # as may be in a damaged cube

    @property
    def words(self) -> str:
        """The status in words, for example `not converged`."""
        return self.name.lower().replace("_", " ")


class CellState(IntEnum):
    """State of a cell of the potential contact area."""

    EXTERIOR = 0
    STICK = 1
    SLIP = 2


@dataclass(frozen=True)
class Variable:
    """One stored quantity: its kind, units, and the name shown next to it."""

    kind: Literal["field", "scalar", "text"]
    units: str
    long_name: str
    dtype: str = "f8"
    tangential: bool = False  # absent if only the pressure is solved for
    timing: bool = False  # differs from run to run
    nonnegative: bool = False  # a result that is less is an error
    enum: type[IntEnum] | None = None


VARIABLES: dict[str, Variable] = {
    # fields, dims (..., x, y)
    "pressure": Variable("field", "MPa", "contact pressure"),
    "traction_x": Variable("field", "MPa", "longitudinal traction on the coated body", tangential=True),
    "traction_y": Variable("field", "MPa", "lateral traction on the coated body", tangential=True),
    "slip_x": Variable("field", "1", "longitudinal slip per unit rolling speed", tangential=True),
    "slip_y": Variable("field", "1", "lateral slip per unit rolling speed", tangential=True),
    "state": Variable("field", "1", "state of the cell", "i1", tangential=True, enum=CellState),
    # resultants and extrema
    "force_x": Variable("scalar", "N", "longitudinal force on the coated body", tangential=True),
    "force_y": Variable("scalar", "N", "lateral force on the coated body", tangential=True),
    "moment_z": Variable("scalar", "N mm", "spin moment sum(x qy - y qx) dx dy", tangential=True),
    "pressure_max": Variable("scalar", "MPa", "largest pressure", nonnegative=True),
    "contact_area": Variable("scalar", "mm2", "area of contact", nonnegative=True),
    "slip_area": Variable("scalar", "mm2", "area of slip", tangential=True, nonnegative=True),
    "contact_radius": Variable("scalar", "mm", "radius of the circle of the area of contact", nonnegative=True),
    "approach": Variable("scalar", "mm", "rigid approach of the bodies"),
    "traction_max": Variable("scalar", "MPa", "largest magnitude of the traction", tangential=True, nonnegative=True),
    "friction_power": Variable("scalar", "N", "friction power per unit rolling speed", tangential=True),
    # how the case ended
    "status": Variable("scalar", "1", "how the case ended", "i1", enum=Status),
    "status_reason": Variable("text", "1", "why the case is not solved", "str"),
    "residual_normal": Variable("scalar", "1", "relative residual of the pressure solver"),
    "residual_tangential": Variable("scalar", "1", "relative residual of the traction solver", tangential=True),
    "iterations_normal": Variable("scalar", "1", "iterations of the pressure solver", "i4"),
    "iterations_tangential": Variable("scalar", "1", "iterations of the traction solver", "i4", tangential=True),
    "operator_products": Variable(
        "scalar", "1", "operator and preconditioner products of the traction solver", "i4", tangential=True
    ),
    "coarse_products": Variable("scalar", "1", "products on the coarser meshes of its cascade", "i4", tangential=True),
    "products_normal": Variable("scalar", "1", "operator and preconditioner products of the pressure solver", "i4"),
    "solve_seconds": Variable("scalar", "s", "wall time of the solve", timing=True),
    # the proof: computed independently of the solver's stopping test
    "proof_tension": Variable("scalar", "1", "largest tension over p_max"),
    "proof_load": Variable("scalar", "1", "|sum(p) dx dy - P| / P"),
    "proof_gap": Variable("scalar", "1", "largest |gap| where p > 0, over the approach"),
    "proof_penetration": Variable("scalar", "1", "largest overlap outside the contact, over the approach"),
    "proof_stick": Variable(
        "scalar", "1", "largest |slip| in a stick cell, over the largest slip without tractions", tangential=True
    ),
    "proof_slip": Variable(
        "scalar",
        "1",
        "largest |s + |s| q/|q|| in a slip cell, over the largest slip without tractions",
        tangential=True,
    ),
    "proof_bound": Variable(
        "scalar", "1", "largest excess of |q| over mu p, in slip cells any deviation, over mu p_max", tangential=True
    ),
}
# scalars with an estimate of their discretisation error, stored next to them as <name>_error
ESTIMATED = (
    "force_x",
    "force_y",
    "moment_z",
    "pressure_max",
    "contact_area",
    "slip_area",
    "contact_radius",
    "approach",
    "traction_max",
    "friction_power",
)
VARIABLES |= {
    f"{name}_error": replace(
        VARIABLES[name],
        long_name=f"estimated discretisation error of the {VARIABLES[name].long_name}",
        nonnegative=True,
    )
    for name in ESTIMATED
}


@cache
def expected_scalars(*, tangential: bool) -> frozenset[str]:
    """Names of the scalars that every solved case has besides its status; `tangential`: its tractions are solved for.

    Results of a state of the program that did not have one of them yet are not taken over.
    """
    return frozenset(
        name
        for name, variable in VARIABLES.items()
        if variable.kind == "scalar" and name != "status" and (tangential or not variable.tangential)
    )


@dataclass
class Result:
    """Result of one case. `fields` are arrays [nx, ny] of the whole window; keys are those of VARIABLES.

    A case that was not solved has a status and a reason; its numbers, if any, are kept for inspection.
    """

    status: Status
    reason: str = ""
    scalars: dict[str, float] = field(default_factory=dict)
    fields: dict[str, np.ndarray] = field(default_factory=dict)
