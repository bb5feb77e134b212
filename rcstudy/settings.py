"""Names and units of the settings of a scene, as stored in cubes and as written in studies."""

from __future__ import annotations

import re
from typing import NamedTuple

LENGTH, MODULUS = "a", "Es"
"""Names of the two scales: the Hertz radius of the uncoated pair, and the substrate's modulus."""


class Description(NamedTuple):
    """`units` and `long_name` of a setting's numbers in a cube, after the CF conventions."""

    units: str
    long_name: str


DESCRIPTIONS: dict[str, Description] = {
    "layer_count": Description("1", "number of layers"),
    "thickness": Description("mm", "thickness of each layer"),
    "modulus": Description("MPa", "Young's modulus of the layer next to the substrate"),
    "layer_nu": Description("1", "Poisson's ratio of the layers"),
    "E": Description("MPa", "Young's modulus"),
    "nu": Description("1", "Poisson's ratio"),
    "radius": Description("mm", "radius"),
    "load": Description("N", "normal load"),
    "friction": Description("1", "coefficient of friction"),
    "longitudinal": Description("1", "longitudinal creepage"),
    "lateral": Description("1", "lateral creepage"),
    "spin": Description("rad mm-1", "spin creepage"),
    "size": Description("mm", "size of the window"),
    "cells": Description("1", "number of cells"),
    "margin": Description("1", "width of the window over that of the contact"),
    "spin_point": Description("1", "point of the spin, in cells ahead of the centre"),
    "normal": Description("1", "tolerance of the pressure"),
    "tangential": Description("1", "tolerance of the tractions"),
    "creepage": Description("1", "creepage"),
    "counterbody": Description("1", "counterbody"),
    "substrate": Description("1", "substrate"),
    "layers": Description("1", "layers"),
    "mesh": Description("1", "mesh"),
    "tolerance": Description("1", "tolerances"),
    "method": Description("1", "method of the traction solver"),
    "coupling": Description("1", "coupling of tractions and pressure"),
    "discretisation": Description("1", "discretisation of the slip"),
    "case": Description("1", "case"),
}
"""Keys are the last word of a setting's path: `spin` for `creepage.spin`."""

_SCALES = {LENGTH: "the Hertz radius a", MODULUS: "the substrate's modulus Es"}
_AS_WRITTEN = {"1": "", "rad mm-1": "rad/mm"}


def ratio_name(long_name: str, scale: str) -> str:
    """The long name of a setting in multiples of `scale` ("a" or "Es")."""
    return f"{long_name} over {_SCALES[scale]}"


def name_with_body(axis: str, long_name: str) -> str:
    """The name of an axis for people; `E` and `nu` with the body that they belong to: `substrate E`."""
    body = re.search(r" of the (substrate|counterbody)\b", long_name) if axis in ("E", "nu") else None
    return f"{body[1]} {axis}" if body else axis


def unit_as_written(units: str, long_name: str = "") -> str:
    """The `units` of a coordinate as usually written: `rad/mm`, `mm`, "" for none; for a `ratio_name` its scale."""
    if units == "1":
        for scale, words in _SCALES.items():
            if long_name.endswith(f" over {words}"):
                return scale
    return _AS_WRITTEN.get(units, units)


def unit_of(name: str) -> str:
    """The unit of the setting `name` (a key of DESCRIPTIONS) as usually written."""
    return unit_as_written(DESCRIPTIONS[name].units)
