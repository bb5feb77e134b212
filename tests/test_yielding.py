"""Tractions under plates by way of foundations: they get there, and where others do they are not asked for."""

import pytest

import rcstudy
from rcstudy.mechanics import contact
from rcstudy.mechanics.influence import Influence
from rcstudy.mechanics.scene import Layer, Material
from rcstudy.mechanics.yielding import bend

SUBSTRATE = Material(210000.0, 0.3)
LAYERS = [{"E": "Es", "nu": 0.3, "thickness": "0.1 a"}, {"E": "1e-4 Es", "nu": 0.44, "thickness": "0.6 a"}]
PLATE = {
    "substrate": {"E": 210000, "nu": 0.3},
    "layers": LAYERS,
    "radius": [8, 0.7],
    "load": 414,
    "friction": 0.3,
    "tolerance": {"normal": 1e-6, "tangential": 1e-6},
}


@pytest.mark.parametrize("creepage", [{}, {"lateral": 0.003}, {"longitudinal": 0.003}])
def test_plates_on_cells_longer_than_wide_are_solved(creepage: dict) -> None:
    """Newton's method alone, from the coarser mesh, had not ended after 100 steps and 5000 products."""
    result = rcstudy.solve(PLATE | {"creepage": creepage, "mesh": {"size": [4.7, 1.23], "cells": [16, 64]}})
    assert result.status == 0
    assert result.operator_products + result.coarse_products < 1700


def test_contrast_of_layers() -> None:
    """One on half-spaces and soft films, whose short waves are the stiffer or as stiff; more under a plate."""
    of = {}
    for name, layers in {
        "none": (),
        "film": (Layer(2100.0, 0.3, 0.1),),
        "plate": (Layer(210000.0, 0.3, 0.01), Layer(21.0, 0.3, 0.1)),
    }.items():
        influence = Influence(SUBSTRATE, layers, None, (0.01, 0.01), 3.0)
        of[name] = influence.contrast((64, 64), influence.traction_responses)
    assert of["none"] == 1.0
    assert of["film"] < 3.0
    assert of["plate"] > 50.0


def test_ordinary_contacts_take_no_foundation(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(contact, "FOUNDATIONS", None)  # would raise
    coating = PLATE | {"layers": [{"E": "2 Es", "nu": 0.3, "thickness": "0.5 a"}], "creepage": {"longitudinal": 0.002}}
    assert rcstudy.solve(coating | {"mesh": {"size": "auto", "cells": [32, 32]}}).status == 0


def test_bending_is_looked_at_once() -> None:
    influence = Influence(SUBSTRATE, (), None, (0.01, 0.01), 3.0)
    assert not bend(influence, (8, 8))
