"""Lists kept by hand: each has every setting of a scene, or every scalar with an error bar, or a reason why not.

A setting that was added to the scene alone appeared in no cube, table or caption, and no test said so.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from typing import Any, get_args

import pytest
import xarray as xr
from contacts import steel

from rcstudy.accuracy import _KEPT
from rcstudy.cases import _LISTED, scene_record
from rcstudy.mechanics.scene import Creepage, Layer, Material, Mesh
from rcstudy.report.held import _WRITTEN
from rcstudy.report.listed import _PATHS, CREEPAGES
from rcstudy.report.quantities import CHOICES, variable
from rcstudy.result import ESTIMATED
from rcstudy.scales import natural_scales
from rcstudy.settings import DESCRIPTIONS
from rcstudy.storage.layout import LAYER_SETTINGS, SETTINGS
from rcstudy.studyfile.spec import SceneSpec, Spec


def leaves(model: type[Spec] = SceneSpec) -> Iterator[str]:
    """Dotted paths of all settings of `model` that are no mappings themselves; `layers.E` is that of each layer."""
    for key, field in model.model_fields.items():
        kinds = [kind for kind in (field.annotation, *get_args(field.annotation)) if isinstance(kind, type)]
        inner = [kind for kind in kinds if issubclass(kind, Spec)]
        yield from (f"{key}.{path}" for path in leaves(inner[0])) if inner else (key,)


CREEPAGE = {f"creepage.{name}" for name in ("longitudinal", "lateral", "spin")}
LAYERS = {f"layers.{name}" for name in ("E", "nu", "thickness")}
STORED = {"load", "friction", *LAYERS, *CREEPAGE}  # each has a variable in cubes, for all cases
MARGIN = "mesh.margin"  # sizes a window that is fitted: no number of a scene that is solved

LISTS: Mapping[str, tuple[Collection[str], Collection[str]]] = {
    "coordinates of lists of cases": (_LISTED, STORED | {MARGIN}),
    # creepages and layers have columns of their own, the margin stands with the window
    "columns of tables": (_PATHS, CREEPAGE | LAYERS | {MARGIN}),
    # captions take what is stored from the cube
    "words of captions": ([path for path in leaves() if path.partition(".")[0] in _WRITTEN], STORED),
}


@pytest.mark.parametrize("name", LISTS)
def test_every_setting_is_listed_or_left_out_for_a_reason(name: str) -> None:
    listed, left_out = LISTS[name]
    assert sorted([*listed, *left_out]) == sorted(leaves())


def test_captions_have_words_for_no_other_setting() -> None:
    assert set(_WRITTEN) <= set(SceneSpec.model_fields)


def test_what_is_stored_of_each_case_is() -> None:
    """It is left out elsewhere for that reason."""
    assert {path.rpartition(".")[2] for path in STORED - LAYERS} <= set(SETTINGS)
    assert len(LAYER_SETTINGS) == len(LAYERS)
    assert len(CREEPAGES) == len(CREEPAGE)


def test_every_setting_has_a_unit_and_a_name() -> None:
    assert {word for path in leaves() for word in path.split(".")} <= set(DESCRIPTIONS)


def test_the_hash_of_a_case_covers_every_setting() -> None:
    scene = steel(
        Mesh((1.0, 1.0), (8, 8)),
        layers=(Layer(1.0, 0.3, 1.0),),
        counterbody=Material(1.0, 0.0),
        creepage=Creepage(0.001),
    )

    def paths(record: Mapping[str, Any]) -> Iterator[str]:
        for key, value in record.items():
            value = value[0] if key == "layers" else value
            yield from (f"{key}.{path}" for path in paths(value)) if isinstance(value, dict) else (key,)

    assert sorted([*paths(scene_record(scene)), MARGIN]) == sorted(leaves())


SIZES = {"contact_radius", "approach"}  # never nil: rounding is small beside their own values
OF_SCALARS: Mapping[str, tuple[Collection[str], Collection[str]]] = {
    "scales of a comparison": (natural_scales(xr.Dataset(), ()), SIZES),
    "what an overview can show": ({variable(name) for name in CHOICES}, ()),
    "numbers that the study of accuracy keeps": (_KEPT, {"approach"}),  # which does not depend on tractions
}


@pytest.mark.parametrize("name", OF_SCALARS)
def test_every_scalar_with_an_error_bar_is_listed_or_left_out_for_a_reason(name: str) -> None:
    """Without its scale, rounding in a number that is nil was told as a difference between cubes."""
    listed, left_out = OF_SCALARS[name]
    assert set(ESTIMATED) == {*listed, *left_out} & set(ESTIMATED)
    assert not set(left_out) & set(listed)
