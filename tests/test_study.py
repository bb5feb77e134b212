"""Reading a study: what is taken, and how everything else is refused, with its place in the file."""

import math
from dataclasses import replace

import numpy as np
import pytest
from studies import BASE, CONFIGS, load_text, refusal

from rcstudy.cases import expand
from rcstudy.errors import UserError
from rcstudy.mechanics.scene import Creepage, Layer, Material
from rcstudy.study import MAX_CASES, load_study, scene_from_mapping
from rcstudy.studyfile import grids
from rcstudy.studyfile.axis_labels import labelled_scenes
from rcstudy.studyfile.build import scene_hertz
from rcstudy.studyfile.ranges import RangeSpec
from rcstudy.studyfile.written import starting_scene, written_grid
from rcstudy.studyfile.yamltree import shorten

SCENE = {
    "substrate": {"E": 210000, "nu": 0.3},
    "radius": 50,
    "load": 100,
    "mesh": {"size": [2, 2], "cells": [32, 32]},
}


@pytest.fixture
def load(tmp_path):
    """Loads a text as a study file."""
    return lambda text: load_text(tmp_path, text)


@pytest.fixture
def refused(tmp_path):
    """Lines of the refusal of a text."""
    return lambda text: refusal(tmp_path, text)


def scenes(study, grid=0):
    plan = study.grids[grid]
    return [plan.scene(index) for index in plan.indices()]


# what is taken


def test_paper_study_states_every_case_of_figures_3_to_10():
    study = load_study(CONFIGS / "paper.yaml")
    shapes = {grid.name: grid.shape for grid in study.grids}
    maps = {f"figure_{k}": (2, 6) for k in (7, 8, 9, 10)}
    assert shapes == {
        "figure_3_bare": (1,),
        "figure_3": (2, 3, 2),
        "figure_4": (4,),
        "figure_5": (3, 2, 5),
        "figure_6": (3, 2, 5),
        **maps,
    }
    assert study.size == 125
    by_name = {grid.name: grid for grid in study.grids}
    a = scene_hertz(by_name["figure_3_bare"].scene((0,))).radius
    assert a == pytest.approx(0.2533, abs=5e-5)
    # Table 1, two stiff layers: E1 = 2 E2 = 4 Es, the first at the surface
    stiff = by_name["figure_9"].scene((1, 5))
    assert stiff.layers == (Layer(840000.0, 0.3, 0.25 * a), Layer(420000.0, 0.3, 0.25 * a))
    assert stiff.creepage == Creepage(0.002, 0.001, 0.01)
    soft = by_name["figure_10"].scene((0, 1))
    assert soft.layers == (Layer(52500.0, 0.3, 0.5 * a), Layer(105000.0, 0.3, 0.5 * a))
    assert soft.creepage == Creepage(0.002, 0.002, 0.0)
    assert by_name["figure_4"].axes[0].labels == ("a", "c", "e", "g")
    assert [s.creepage.longitudinal for s in scenes(study, 3)[:5]] == [0.0002, 0.0004, 0.0006, 0.0008, 0.001]
    assert all(s.creepage is None for k in (0, 1) for s in scenes(study, k))


def test_study_keeps_its_text_and_hash():
    path = CONFIGS / "small.yaml"
    study = load_study(str(path))
    assert study.text == path.read_text(encoding="utf-8")
    assert study.path == path
    assert len(study.sha256) == 64
    assert (study.name, study.size, study.outputs.fields, study.outputs.precision) == ("small", 9, True, "float64")


def test_relative_quantities_follow_the_case(load):
    study = load(BASE + "  g: {axes: {load: [100, 200], thickness: [0.5 a, 0.1], modulus: [0.5 Es, 300000]}}\n")
    for scene, (load_n, thickness, modulus) in zip(
        scenes(study),
        [(p, t, m) for p in (100, 200) for t in ("0.5 a", 0.1) for m in (105000.0, 300000.0)],
        strict=True,
    ):
        a = (0.75 * load_n * 50 * (1 - 0.3**2) / 210000) ** (1 / 3)
        assert scene.layers[0].thickness == pytest.approx(0.5 * a if thickness == "0.5 a" else thickness, rel=1e-14)
        assert modulus == scene.layers[0].E


@pytest.mark.parametrize("text", ["0.5 a", "0.5a", " .5  a ", "5e-1 a", "+0.5 a"])
def test_ways_to_write_a_relative_length(text):
    layer = {"E": "1 Es", "nu": 0.3, "thickness": text}
    scene = scene_from_mapping({**SCENE, "layers": [layer]})
    assert scene.layers == (Layer(210000.0, 0.3, 0.5 * scene_hertz(scene).radius),)


def test_a_of_an_elliptic_contact_is_the_geometric_mean():
    scene = scene_from_mapping({**SCENE, "radius": [50, 200], "mesh": {"size": ["8 a", "8 a"], "cells": [8, 8]}})
    ax, ay = scene_hertz(scene).a
    assert scene.mesh.size[0] == pytest.approx(8 * math.sqrt(ax * ay), rel=1e-14)


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1e-3", 1e-3),
        ("1E-3", 1e-3),
        ("+1.5e2", 150.0),
        (".5", 0.5),
        (".5e1", 5.0),
        ("+.5E2", 50.0),
        ("7", 7.0),
        ("0x10", 16.0),
    ],
)
def test_numbers_are_read_as_yaml_1_2_writes_them(load, text, value):
    (scene,) = scenes(load(BASE + f"  g: {{axes: {{friction: [{text}]}}}}\n"))
    assert scene.friction == value
    assert type(scene.friction) is float


@pytest.mark.parametrize("text", ["'\u0663'", "\u0663 a", "0.\u0665 a", "1e\uff11 a"])
def test_digits_are_those_of_yaml(refused, text):
    """Digits of other scripts were taken in relative quantities, and only there."""
    (line,) = refused(BASE + f"  g: {{axes: {{thickness: [{text}], modulus: [1000]}}}}\n")
    assert line.startswith("s.yaml:8:26: grids.g.axes.thickness[0]: ")
    assert ": a number above 0, in mm, or of the Hertz radius such as '0.25 a'" in line


@pytest.mark.parametrize("text", ["1_000", "1_000.5", "'1,000'", "0x1_0", "0b110", "'0,5'"])
def test_separators_are_no_part_of_numbers(refused, text):
    """Underscores were taken, as in YAML 1.1."""
    (line,) = refused(BASE + f"  g: {{axes: {{friction: [{text}]}}}}\n")
    number = text.strip("'")
    assert line.startswith(f"s.yaml:8:25: grids.g.axes.friction[0]: {number}: a number above 0")
    hint = "; numbers have a decimal point and no thousands separators"
    assert line.endswith(hint) or number in ("0x1_0", "0b110")


def test_grid_overrides_the_shared_scene_key_by_key(load):
    text = BASE + "  g: {scene: {mesh: {cells: [16, 8]}, counterbody: {E: 2 Es, nu: 0}}, axes: {friction: [0.5]}}\n"
    (scene,) = scenes(load(text))
    assert scene.mesh.size == (2.0, 2.0)
    assert scene.mesh.cells == (16, 8)
    assert scene.counterbody == Material(420000.0, 0.0)
    assert scene.substrate == Material(210000.0, 0.3)


def test_a_shared_scene_may_be_empty_where_grids_give_all(load):
    scene = "{substrate: {E: 210000, nu: 0.3}, radius: 50, load: 100, mesh: {size: auto, cells: [8, 8]}}"
    study = load(f"study: s\nscene: {{}}\ngrids:\n  g: {{scene: {scene}, cases: [{{label: a}}]}}\n")
    assert [scene.load for scene in scenes(study)] == [100.0]


def test_axis_of_one_creepage_keeps_the_others(load):
    text = BASE + "  g: {scene: {creepage: {longitudinal: 0.001}}, axes: {creepage.spin: [0, 0.02]}}\n"
    assert [s.creepage for s in scenes(load(text))] == [Creepage(0.001, 0, 0), Creepage(0.001, 0, 0.02)]
    (alone,) = scenes(load(BASE + "  g: {axes: {creepage.spin: [0.02]}}\n"))
    assert alone.creepage == Creepage(0, 0, 0.02)


def test_one_layer_of_a_coating_is_the_layer_that_is_given(load):
    """1000 MPa over and times 210000 MPa is another number."""
    moduli = ["1000", "0.1 Es", "333.3", "1.7 Es"]
    layers = ", ".join(f"[{{E: {E}, nu: 0.3, thickness: 0.1}}]" for E in moduli)
    study = load(
        BASE + f"  g: {{coating: {{thickness: 0.1}}, axes: {{modulus: [{', '.join(moduli)}]}}}}\n"
        f"  h: {{axes: {{layers: [{layers}]}}}}\n"
    )
    assert scenes(study) == scenes(study, 1)
    assert scenes(study)[0].layers[0].E == 1000.0


def test_case_list(load):
    study = load(
        BASE
        + """\
  g:
    coating: {thickness: 0.1, modulus: 2 Es}
    cases:
      - {label: coated}
      - {label: thick, coating: {thickness: 0.2, layer_count: 2, layer_nu: 0.25}}
      - {label: bare, coating: {layer_count: 0}, creepage: {spin: 0.01}}
"""
    )
    coated, thick, bare = scenes(study)
    assert coated.layers == (Layer(420000.0, 0.3, 0.1),)
    assert thick.layers == (Layer(840000.0, 0.25, 0.2), Layer(420000.0, 0.25, 0.2))
    assert bare.layers == ()
    assert (coated.creepage, bare.creepage) == (None, Creepage(0, 0, 0.01))
    assert study.grids[0].axes[0].labels == ("coated", "thick", "bare")


def test_axes_by_their_ends(load):
    (grid,) = load(
        BASE + "  g:\n    coating: {layer_count: 1}\n    axes:\n"
        "      thickness: {first: 0.1 a, last: 10 a, count: 5, spacing: log}\n"
        "      modulus: {first: Es, last: 2 Es, count: 4}\n"
        "      creepage.spin: {first: 0.01, last: -0.01, count: 3}\n"
        "      friction: {first: 0.3, last: 0.30000003, count: 3}\n"
    ).grids
    thickness, modulus, spin, close = grid.axes
    assert thickness.labels == ("0.1 a", "0.316228 a", "1 a", "3.16228 a", "10 a")
    assert [value.value for value in modulus.values] == [1.0, 1.33333, 1.66667, 2.0]
    assert spin.values == (0.01, 0.0, -0.01)
    assert close.values == pytest.approx((0.3, 0.300000015, 0.30000003), rel=1e-15)
    assert grid.shape == (5, 4, 3, 3)


@pytest.mark.parametrize("count", range(3, 41))
def test_a_range_across_zero_has_zero_itself(count):
    """Whatever rounding leaves of it would be a label."""
    for k in range(1, count - 1):
        ends = {"first": -0.001 * k, "last": 0.001 * (count - 1 - k)}
        values = [value.value for value in RangeSpec.model_validate({**ends, "count": count}).values()]
        assert str(values[k]) == "0.0"
        assert values == pytest.approx(np.linspace(*ends.values(), count), rel=1e-5, abs=1e-15)


@pytest.mark.parametrize(("first", "last", "between"), [(2100001, 2100003, 2100002), (0.1234568, 0.1234564, 0.1234566)])
def test_rounding_leaves_values_between_the_ends(first, last, between):
    """One value between two close ends is distinct when rounded, but was beyond them."""
    values = RangeSpec.model_validate({"first": first, "last": last, "count": 3}).values()
    assert [value.value for value in values] == pytest.approx([first, between, last], rel=1e-15)


def test_a_case_of_a_list_is_named_where_the_shared_mesh_is_wrong_for_it(load):
    base = BASE + "  g:\n    cases:\n      - {label: light, load: 100}\n      - {label: heavy, load: 20000}\n"
    with pytest.raises(UserError, match=r"scene\.mesh\.size: \[2, 2\]: must be larger .* \(case heavy\)$"):
        load(base)


def test_ends_of_any_size(load):
    """Neither their quotient nor their product need be a number that there is; and an end is what was written."""
    (grid,) = load(
        BASE + "  g:\n    coating: {layer_count: 1}\n    axes:\n"
        "      thickness: {first: 0.1234567890123456 a, last: 0.5 a, count: 2}\n"
        "      modulus: [1 Es]\n"
        "      creepage.lateral: {first: 1.0e-200, last: 1.0e-190, count: 3, spacing: log}\n"
        "      creepage.longitudinal: {first: -1.0e-4, last: -1.0e-2, count: 3, spacing: log}\n"
    ).grids
    thickness, _, lateral, longitudinal = grid.axes
    assert thickness.values[0].value == 0.1234567890123456
    assert lateral.values == (1e-200, 1e-195, 1e-190)
    assert longitudinal.values == (-1e-4, -1e-3, -1e-2)
    wide = RangeSpec.model_validate({"first": 1e-200, "last": 1e200, "count": 3, "spacing": "log"})
    assert [value.value for value in wide.values()] == [1e-200, 1.0, 1e200]


def test_labels(load):
    study = load(
        BASE + "  g: {axes: {creepage: [{spin: 0.1}, {label: 0.20, spin: 0.2}, {spin: 0.3}], radius: [[9, 8], 9]}}\n"
    )
    assert [axis.labels for axis in study.grids[0].axes] == [("a", "0.20", "c"), ("9 x 8", "9")]


def test_aliases_stand_for_what_they_name(load):
    study = load(BASE + "  g: {axes: {friction: &f [0.1, 0.2]}}\n  h: {axes: {friction: *f}}\n")
    assert [grid.shape for grid in study.grids] == [(2,), (2,)]


# what is refused


def test_text_that_only_its_quotes_tell_from_what_is_allowed(tmp_path):
    with pytest.raises(UserError, match=r'outputs.fields: "true": true or false'):
        load_text(tmp_path, BASE + "  g: {axes: {friction: [1]}}\noutputs: {fields: 'true'}\n")


@pytest.mark.parametrize(
    ("scene", "words"),
    [
        ("substrate: {E: ¶-1}", "scene.substrate.E: -1: a number above 0, in MPa"),
        ("substrate: {nu: ¶0.51}", "scene.substrate.nu: 0.51: a number from 0 to 0.5"),
        ("substrate: {E: ¶2 Es}", "scene.substrate.E: 2 Es: a number above 0, in MPa"),
        ("substrate: {E: ¶210 GPa}", "scene.substrate.E: 210 GPa: a number above 0, in MPa"),
        ("radius: ¶50 mm", "scene.radius: 50 mm: a number above 0, in mm"),
        ("radius: [50, ¶0]", "scene.radius[1]: 0: a number above 0, in mm"),
        ("radius: ¶[50]", "scene.radius: [50]: a number above 0, in mm, or two [Rx, Ry]"),
        ("radius: ¶3 a", "scene.radius: 3 a: a number above 0, in mm"),
        ("radius: ¶0", "scene.radius: 0: a number above 0, in mm, or two [Rx, Ry] ('a' follows from it)"),
        ("radius: ¶'50, 50'", "scene.radius: 50, 50: a number above 0, in mm, or two [Rx, Ry] ('a' follows from it)"),
        ("radius: [¶0, 5]", "scene.radius[0]: 0: a number above 0, in mm ('a' follows from it)"),
        ("load: ¶0", "scene.load: 0: a number above 0, in N"),
        ("load: ¶true", "scene.load: true: a number above 0, in N"),
        ("load: ¶'100'", 'scene.load: "100": a number above 0, in N'),
        ("load: ¶.inf", "scene.load: .inf: a number above 0, in N"),
        ("load: ¶.nan", "scene.load: .nan: a number above 0, in N"),
        ("load: ¶~", "scene.load: ~: a number above 0, in N"),
        ("load: ¶{}", "scene.load: {}: a number above 0, in N"),
        ("friction: ¶0", "scene.friction: 0: a number above 0"),
        ("friction: ¶NaN", "scene.friction: NaN: a number above 0"),
        ("mesh: {size: [¶0, 1]}", "scene.mesh.size[0]: 0: a number above 0, in mm"),
        ("mesh: {size: ¶2}", "scene.mesh.size: 2: auto or two lengths [x, y]"),
        ("mesh: {cells: [¶3, 4]}", "scene.mesh.cells[0]: 3: a whole number from 4 to"),
        ("mesh: {cells: [¶8.5, 4]}", "scene.mesh.cells[0]: 8.5: a whole number from 4 to"),
        ("mesh: {cells: [4, ¶99999]}", "scene.mesh.cells[1]: 99999: a whole number from 4 to"),
        ("tolerance: {normal: ¶0}", "scene.tolerance.normal: 0: a number above 0 and below 1"),
        ("tolerance: {tangential: ¶1}", "scene.tolerance.tangential: 1: a number above 0 and below 1"),
        ("spin_point: ¶0.6", "scene.spin_point: 0.6: a number from -0.5 to 0.5"),
        ("creepage: {spin: ¶x}", "scene.creepage.spin: x: a number from -1000 to 1000, in rad/mm"),
        ("creepage: {lateral: ¶2}", "scene.creepage.lateral: 2: a number from -1 to 1"),
        ("creepage: ¶off", "scene.creepage: off: the word none, or {longitudinal, lateral, spin}"),
        ("counterbody: ¶soft", "scene.counterbody: soft: rigid or {E, nu}"),
        ("¶counterbody: {E: 1}", "scene.counterbody.nu: missing: a number from 0 to 0.5"),
        ("coupling: ¶both", "scene.coupling: both: one of one-way, full"),
        ("method: ¶fem", "scene.method: fem: one of newton, paper-cg"),
        ("discretisation: ¶shifted", "scene.discretisation: shifted: one of kalker, aligned"),
        ("layers: ¶{}", "scene.layers: {}: a list of at most 50 layers"),
        ("layers: [¶1]", "scene.layers[0]: 1: a mapping with keys E, nu, thickness"),
        ("layers: [¶{E: 1, nu: 0.3}]", "scene.layers[0].thickness: missing: a number above 0, in mm"),
        ("layers: [{E: 1, nu: ¶1, thickness: -2}]", "scene.layers[0].nu: 1: a number from 0 to 0.5"),
        ("layers: [{E: ¶1 a, nu: 0, thickness: 1}]", "scene.layers[0].E: 1 a: a number above 0, in MPa"),
        ("¶frictoin: 1", "scene.frictoin: unknown key: did you mean friction?"),
        (
            "¶coating: {thickness: 1}",
            "scene.coating: unknown key: a coating belongs to a grid or a case of its list, a",
        ),
        (
            "counterbody: {E: 1, nu: 0.3, ¶layers: []}",
            "scene.counterbody.layers: unknown key: layers are a key of the scene, they lie on the substrate; allowed:",
        ),
        (
            "creepage: {¶label: a, spin: 0.1}",
            "scene.creepage.label: unknown key: a label belongs to values of an axis and to cases of a list; allowed:",
        ),
        (
            "¶modulus: 1",
            "scene.modulus: unknown key: a coating belongs to a grid or a case of its list, a scene has la",
        ),
        ("load: 1, ¶load: 2", "scene.load: given twice, first at line 8, column 15"),
    ],
)
def test_each_bad_value_is_named_with_its_place(refused, scene, words):
    """The place is marked with a pilcrow."""
    line = f"  g: {{scene: {{{scene}}}, axes: {{friction: [1]}}}}\n"
    found = refused(BASE + line.replace("¶", ""))
    assert any(one.startswith(f"s.yaml:8:{line.index('¶') + 1}: grids.g.{words}") for one in found), found


def test_cases_of_a_list_are_offered_what_they_take(refused):
    """A label and a coating, too; keys of a coating stand inside it."""
    found = refused(BASE + "  g: {cases: [{label: a, thickness: 1, lod: 2}]}\n")
    assert [line.partition("allowed: ")[0] for line in found] == [
        "s.yaml:8:26: grids.g.cases[0].thickness: unknown key: did you mean coating: {thickness: ...}? ",
        "s.yaml:8:40: grids.g.cases[0].lod: unknown key: did you mean load? ",
    ]
    assert all("allowed: label, coating, substrate, layers, " in line for line in found)


def test_ends_of_an_axis_are_offered_what_it_takes(refused):
    """A multiple of a scale was offered for creepages, too."""
    assert refused(BASE + "  g: {axes: {creepage.spin: {first: 1 a, last: x, count: 3}}}\n") == [
        "s.yaml:8:37: grids.g.axes.creepage.spin.first: 1 a: a number",
        "s.yaml:8:48: grids.g.axes.creepage.spin.last: x: a number",
    ]


@pytest.mark.parametrize(("key", "meant"), [("e", "E"), ("Nu", "nu"), ("NU", "nu")])
def test_keys_in_the_wrong_case(refused, key, meant):
    found = refused(BASE.replace(f"{meant}:", f"{key}:") + "  g: {axes: {load: [100]}}\n")
    assert any(line.endswith(f"substrate.{key}: unknown key: did you mean {meant}? allowed: E, nu") for line in found)


@pytest.mark.parametrize(("label", "shown"), [('""', '""'), ('"  "', '"  "'), ("", "(nothing)")])
def test_labels_of_nothing(refused, label, shown):
    (line,) = refused(BASE + f"  g: {{cases: [{{label: {label}}}]}}\n")
    assert line.endswith(f": grids.g.cases[0].label: {shown}: a label of 1 to 100 printable characters")


def test_units_are_explained(refused):
    (line,) = refused(BASE + "  g: {axes: {load: [100 N]}}\n")
    assert line == (
        "s.yaml:8:21: grids.g.axes.load[0]: 100 N: a number above 0, in N; "
        "numbers are written without units: lengths in mm, forces in N, moduli in MPa, spin in rad/mm"
    )


@pytest.mark.parametrize(
    "number", ["1e400", "-1e400", "1e-400", "-.05E-400", "1" * 400, "1" * 5000, "1.0" + "0" * 9 + "e+999"]
)
def test_numbers_out_of_range_are_called_so(refused, number):
    """They were refused by a rule that they satisfy; labels may be any text, and zero is a number."""
    reason = ": beyond the range of floating-point numbers: a number "
    grid = (
        f"  g: {{cases: [{{label: {number[:99]}, friction: {number}, creepage: {{spin: 0e5, lateral: {number}}}}}]}}\n"
    )
    found = refused(BASE + grid)
    assert found[0].endswith(f": grids.g.cases[0].friction: {shorten(number, 60)}{reason}above 0")
    if "-400" in number.lower():  # zero may be meant where it is allowed
        assert len(found) == 1
    else:
        assert found[1].endswith(f"{reason}from -1 to 1 (a plain ratio, not per cent)")
    (line,) = refused(BASE + f"  g: {{coating: {{modulus: 1 Es}}, axes: {{thickness: [{number} a, 1 a]}}}}\n")
    assert f"{reason}above 0, in mm" in line


@pytest.mark.parametrize("number", ["1e3", "100", "-.5"])
def test_numbers_in_quotes_are_called_so(refused, number):
    """With an exponent they were said to have a unit."""
    (line,) = refused(BASE + f"  g: {{axes: {{load: ['{number}']}}}}\n")
    assert (
        line
        == f's.yaml:8:21: grids.g.axes.load[0]: "{number}": a number above 0, in N; numbers are written without quotes'
    )


@pytest.mark.parametrize(
    ("scene", "words"),
    [
        ("load: 100# N", "load: 100# N: a number above 0, in N"),
        ("friction: .5#", "friction: .5#: a number above 0"),
        ("mesh: {margin: 2#}", "mesh.margin: 2#: a number from 1.05 to 10"),
    ],
)
def test_comments_need_a_space(refused, scene, words):
    text = BASE + f"  g:\n    scene:\n      {scene}\n    axes: {{spin_point: [0]}}\n"
    (line,) = refused(text.replace("2#}", "2#\n      }"))
    assert line.partition(": ")[2] == f"grids.g.scene.{words}; a comment has a space before its #"


@pytest.mark.parametrize(
    ("grid", "line"),
    [
        (
            "axes: {thickness: [0.1, -1], modulus: [1 Es]}",
            "8:31: grids.g.axes.thickness[1]: -1: a number above 0, in mm",
        ),
        (
            "coating: {thickness: 1, modulus: 1, layer_nu: ~}, axes: {load: [1]}",
            "8:53: grids.g.coating.layer_nu: ~: a number from 0 to 0.5",
        ),
        (
            "coating: {thickness: 1, modulus: 1, layer_count: true}, axes: {load: [1]}",
            "8:56: grids.g.coating.layer_count: true: a whole number from 0 to 50",
        ),
        ("axes: {load: []}", "8:20: grids.g.axes.load: []: a list of at least one value"),
        ("axes: {load: 3}", "8:20: grids.g.axes.load: 3: a list of at least one value"),
        ("axes: {load: {}}", "8:20: grids.g.axes.load: {}: a list of at least one value, or {first, last, count, sp"),
        ("axes: {load: {first: 1}}", "8:14: grids.g.axes.load.last: missing: a number"),
        ("axes: {load: {first: 1, last: 2, count: 1}}", "8:47: grids.g.axes.load.count: 1: a whole number from 2"),
        (
            "axes: {load: {first: 1, last: 1, count: 3}}",
            "8:37: grids.g.axes.load.last: 1: must be different from first",
        ),
        (
            "axes: {load: {first: 1, last: 1.0000000000000002, count: 90}}",
            "8:37: grids.g.axes.load.last: 1.0000000000000002: must be farther from first: 90 values between them",
        ),
        ("axes: {load: {first: 1 N, last: 2, count: 3}}", "8:28: grids.g.axes.load.first: 1 N: a number; numbers are"),
        (
            "axes: {thickness: {first: 1 mm, last: 2, count: 3}}",
            "8:33: grids.g.axes.thickness.first: 1 mm: a number, or one of the form '0.5 a' or '2 Es'; numbers are",
        ),
        (
            "axes: {creepage: [{labl: x, longitudinal: 0.01}]}",
            "8:26: grids.g.axes.creepage[0].labl: unknown key: did you mean label? allowed: label, longitudinal, ",
        ),
        (
            "axes: {counterbody: [{lable: x, E: 1, nu: 0}, {label: y, E: 1, mu: 0}]}",
            "8:29: grids.g.axes.counterbody[0].lable: unknown key: did you mean label? allowed: label, E, nu",
        ),
        ("axes: {load: {first: 1, last: 2, cuont: 3}}", "8:40: grids.g.axes.load.cuont: unknown key: did you mean c"),
        (
            "axes: {load: {first: -1, last: 2, count: 3, spacing: log}}",
            "8:60: grids.g.axes.load.spacing: log: must be linear, unless first and last are both above 0",
        ),
        (
            "axes: {creepage.spin: {first: 0, last: 2, count: 3, spacing: log}}",
            "8:68: grids.g.axes.creepage.spin.spacing: log: must be linear, unless first and last are both above 0",
        ),
        (
            "axes: {thickness: {first: 1 a, last: 2, count: 3}, modulus: [1 Es]}",
            "8:44: grids.g.axes.thickness.last: 2: must be a multiple of a, as first is",
        ),
        (
            "axes: {modulus: {first: 1 a, last: 2 a, count: 3}, thickness: [1]}",
            "8:23: grids.g.axes.modulus[0]: 1 a: a number above 0, in MPa, or of the substrate's",
        ),
        ("axes: {load: {first: -3, last: 3, count: 3}}", "8:20: grids.g.axes.load[0]: -3: a number above 0, in N"),
        (
            "axes: {method: {first: 1, last: 2, count: 3}}",
            "8:22: grids.g.axes.method: {first: 1, last: 2, count: 3}: a list of at least one value",
        ),
        (
            "axes: {creepage: {longitudinal: [0.001, 0.002]}}",
            "8:24: grids.g.axes.creepage: {longitudinal: ...}: did you mean creepage.longitudinal: [0.001, 0.002], "
            "an axis of its own? allowed: a list of at least one value",
        ),
        (
            "axes: {creepage: {lateral: {first: 0.1, last: 0.2, count: 3}, spin: [1, 2]}}",
            "8:24: grids.g.axes.creepage: {lateral: ..., spin: ...}: did you mean creepage.lateral: "
            "{first: 0.1, last: 0.2, count: 3}, creepage.spin: [1, 2], axes of their own? allowed: a list of at",
        ),
        (
            "axes: {mesh: {size: [1, 1], cells: [[8, 8], [9, 9]]}}",
            "8:20: grids.g.axes.mesh: {size: ..., cells: ...}: did you mean mesh.cells: [..., ...], an axis of its ",
        ),
        (
            "axes: {mesh: {size: [1, 1], cells: [8, 8]}}",
            "8:20: grids.g.axes.mesh: {size: ..., cells: ...}: a list of at least one value",
        ),
        (
            "cases: [{label: x, creepage.spin: 0.1}]",
            "8:26: grids.g.cases[0].creepage.spin: unknown key: did you mean creepage: {spin: ...}? allowed: label, c",
        ),
        (
            "cases: [{label: x, coating.thickness: 0.1}]",
            "8:26: grids.g.cases[0].coating.thickness: unknown key: did you mean coating: {thickness: ...}? allowed: ",
        ),
        (
            "scene: {mesh.size: auto}, axes: {load: [1]}",
            "8:15: grids.g.scene.mesh.size: unknown key: did you mean mesh: {size: ...}? allowed: substrate, layers",
        ),
        ("axes: {}", "8:13: grids.g.axes: {}: a mapping of at least one axis to its values"),
        (  # ended with a traceback beside a coating
            "scene: 5, coating: {thickness: 1, modulus: 1}, axes: {load: [1]}",
            "8:14: grids.g.scene: 5: a mapping of scene keys",
        ),
        ("axes: {laod: [1]}", "8:14: grids.g.axes.laod: unknown axis: did you mean load?"),
        (
            "axes: {load: [100, 1e2]}",
            "8:26: grids.g.axes.load[1]: 1e2: must be a value of its own; the one at line 8, column 21",
        ),
        (  # aliases have the place of what they name, so the error pointed to itself
            "axes: {load: [&x 5, *x]}",
            "8:21: grids.g.axes.load[1]: 5: must be a value of its own; the one at grids.g.axes.load[0] is the same",
        ),
        (
            "cases: [&c {label: b}, *c]",
            "8:26: grids.g.cases[1].label: b: must be a label of its own; this one stands at grids.g.cases[0].label al",
        ),
        (
            "axes: {thickness: [0.1], modulus: [1 Es, 210000]}",
            "8:48: grids.g.axes.modulus[1]: 210000: must be a value of its own",
        ),
        ("axes: {creepage: [none]}", "8:25: grids.g.axes.creepage[0]: none: {label, longitudinal, lateral, spin}"),
        (
            "axes: {creepage: [{label: b, spin: 1}, {spin: 2}]}",
            "8:46: grids.g.axes.creepage[1]: {spin: 2}: must be a label of its own; the entry at line 8, column 25",
        ),
        (
            "axes: {creepage: [{label: b, spin: 1}, {label: b}]}",
            "8:54: grids.g.axes.creepage[1].label: b: must be a label of its own; this one stands at line 8, column 33",
        ),
        (
            "axes: {creepage: [{}], creepage.spin: [1]}",
            "8:30: grids.g.axes.creepage.spin: axis: two axes may not set the same key",
        ),
        (
            "axes: {substrate.E: [1], counterbody.E: [1]}",
            "8:32: grids.g.axes.counterbody.E: axis: two axes may not have the same name",
        ),
        (
            "axes: {thickness: [1], layers: [[]], modulus: [1]}",
            "8:30: grids.g.axes.layers: axis: either layers or a coat",
        ),
        ("axes: {thickness: [1]}", "8:7: grids.g.coating.modulus: missing: a number above 0, in MPa"),
        ("cases: []", "8:14: grids.g.cases: []: a list of at least one case"),
        ("cases: [{load: 1}]", "8:15: grids.g.cases[0].label: missing: a label"),
        (
            "scene: {counterbody: rigid}, axes: {counterbody.E: 5}",
            "8:58: grids.g.axes.counterbody.E: 5: a list of at least one value",
        ),
        ("cases: [{label: x}, 3]", "8:27: grids.g.cases[1]: 3: a mapping of a label and scene keys"),
        (
            "axes: {layers: [{label: x, E: 3}]}",
            "8:23: grids.g.axes.layers[0]: {label: x, E: 3}: a list of layers, or {label, layers}",
        ),
        ("cases: [{label: x}, {label: x}]", "8:35: grids.g.cases[1].label: x: must be a label of its own"),
        ("cases: [{label: x}], axes: {load: [1]}", "8:3: grids.g: both axes and cases: exactly one of axes and cases"),
        ("description: x", "8:3: grids.g: neither axes nor cases: exactly one of axes and cases"),
        (
            "coating: {thickness: 0}, axes: {modulus: [1], load: [1]}",
            "8:28: grids.g.coating.thickness: 0: a number above",
        ),
        (
            "coating: {thickness: 1, modulus: 1}, cases: [{label: x, layers: [{E: 1, nu: 0, thickness: 1}]}]",
            "8:52: grids.g.cases[0]: layers and coating are both given",
        ),
        (
            "axes: {layer_count: [50], thickness: [1], modulus: [1e300]}",
            "8:3: grids.g: modulus too extreme for so many",
        ),
        ("axes: {counterbody.E: [5]}", "8:30: scene.counterbody.nu: missing: a number from 0 to 0.5"),
        (
            "coating: {modulus: 1}, axes: {thickness: [0.1, 1e-12 a]}",
            "8:3: grids.g: a layer of 2.5329e-13 mm: must not be thinner than 1e-09 of the Hertz radius",
        ),
        (
            "coating: {modulus: 1, thickness: 1e150}, axes: {load: [100]}",
            "8:3: grids.g: a layer of 1e+150 mm: must not be thicker than 1e+100 mm (case load=100)",
        ),
        (
            "scene: {layers: [{E: 1, nu: 0, thickness: 1e150}]}, axes: {load: [100]}",
            "8:23: grids.g.scene.layers: [...]: a layer of 1e+150 mm: must not be thicker than 1e+100 mm",
        ),
        (  # the window had no area, by which `plan` divided
            "scene: {mesh: {size: auto}}, axes: {radius: [1e300]}",
            "8:3: grids.g: materials, radius or load too extreme for a window to be fitted to the contact",
        ),
        ("axes: {radius: [1e-200], load: [1e-300]}", "8:3: grids.g: radius, load and moduli too extreme"),
    ],
)
def test_bad_grids(refused, grid, line):
    found = refused(BASE + f"  g: {{{grid}}}\n")
    assert any(one.startswith(f"s.yaml:{line}") for one in found), found


LAYERS = "[{E: 1, nu: 0, thickness: 1}]"
BOTH = "layers and coating are both given: only one of them may be"


@pytest.mark.parametrize(
    ("grid", "line"),
    [
        (f"coating: {{thickness: 1}}, axes: {{layers: [{LAYERS}]}}", f"8:7: grids.g.coating: {BOTH}"),
        (f"coating: {{thickness: 1}}, axes: {{layers: [[], {LAYERS}]}}", f"8:7: grids.g.coating: {BOTH}"),
        (f"scene: {{layers: {LAYERS}}}, axes: {{thickness: [1]}}", f"8:55: grids.g.coating: {BOTH}"),
        (
            f"coating: {{thickness: 1}}, cases: [{{label: x, layers: {LAYERS}}}]",
            f"8:7: grids.g.coating: {BOTH}",
        ),
        (
            "coating: {thickness: 1, modulus: 1}, cases: [{label: x, layers: [], coating: {layer_count: 2}}]",
            f"8:75: grids.g.cases[0].coating: {BOTH}",
        ),
        (
            "scene: {layers: []}, coating: {thickness: 1, modulus: 1}, axes: {load: [1]}",
            f"8:28: grids.g.coating: {BOTH}",
        ),
        (
            f"axes: {{layers: [[], {LAYERS}], thickness: [1]}}",
            "8:59: grids.g.axes.thickness: axis: either layers or a coating (layer_count, thickness, ...)",
        ),
    ],
)
def test_layers_beside_a_part_of_a_coating(refused, grid, line):
    """What the coating lacks was said to be missing, and layers that are none were overlooked."""
    assert refused(BASE + f"  g: {{{grid}}}\n") == [f"s.yaml:{line}"]


def test_a_case_without_layers_beside_a_coating_of_its_grid(tmp_path):
    """It had the coating, without a word; a `layers` of the shared scene has nothing to say on that."""
    path = tmp_path / "s.yaml"
    text = BASE.replace("grids:", "  layers: []\ngrids:")
    cases = "[{label: coated}, {label: bare, layers: []}, {label: none, coating: {layer_count: 0}}]"
    path.write_text(f"{text}  g: {{coating: {{thickness: 1, modulus: 5}}, cases: {cases}}}\n")
    grid = load_study(path).grids[-1]
    assert [len(grid.scene((k,)).layers) for k in range(3)] == [1, 0, 0]


@pytest.mark.parametrize(
    ("scene", "grid", "path"),
    [
        ("load: [1, 2]", "axes: {friction: [1]}", "load"),
        ("load: 1", "axes: {creepage: [{longitudinal: [0.1, 0.2]}]}", "creepage.longitudinal"),
        ("load: 1", "scene: {coupling: [one-way, full]}, axes: {friction: [1]}", "coupling"),
        ("load: 1", "coating: {thickness: 1, modulus: [1, 2]}, axes: {friction: [1]}", "modulus"),
        ("load: 1", "axes: {load: [[1, 2]]}", ""),
        ("load: 1", "scene: {mesh: {size: [1, 2, 3]}}, axes: {load: [[1, 2]]}", "mesh.size"),
    ],
)
def test_several_values_where_one_stands_are_told_of_axes(refused, scene, grid, path):
    found = refused(BASE.replace("load: 100", scene) + f"  g: {{{grid}}}\n")
    hint = f"; several values are given as an axis: axes: {{{path}: [...]}}"
    assert sum(line.endswith(hint) for line in found) == bool(path)
    assert sum("given as an axis" in line for line in found) == bool(path)


def test_no_axes_are_mentioned_where_there_are_none():
    with pytest.raises(UserError) as error:
        scene_from_mapping({**SCENE, "load": [1, 2]})
    assert str(error.value) == "load: [1, 2]: a number above 0, in N"


@pytest.mark.parametrize(
    "axes",
    [
        "creepage.spin: [0, 0.01], creepage: [{spin: 1}]",
        "mesh: [{cells: [8, 8], size: [2, 2]}], mesh.cells: [[8, 8], [9, 9]]",
    ],
)
def test_axes_that_set_the_same_have_no_other_error(refused, axes):
    """The values of one were put into those of the other, and said to be all the same."""
    (line,) = refused(BASE + f"  g: {{axes: {{{axes}}}}}\n")
    assert "axis: two axes may not set the same key; axis" in line


def test_bad_ends_of_an_axis_have_no_other_error(refused):
    (line,) = refused(BASE + "  g: {axes: {thickness: {first: 1 a, last: 2, count: 3}, modulus: [1 Es]}}\n")
    assert line == "s.yaml:8:44: grids.g.axes.thickness.last: 2: must be a multiple of a, as first is"


def test_all_errors_are_found_at_once_in_the_order_of_the_file(refused):
    text = BASE.replace("load: 100", "load: -100") + (
        "  g: {axes: {friction: [0], creepage: [{spin: x}]}, colour: red}\n"
        "  h: {axes: {method: [fem]}}\n"
        "  pressure: {axes: {friction: [1]}}\n"
        "  'a b': {axes: {friction: [1]}}\n"
    )
    assert [line.split(": ")[:2] for line in refused(text)] == [
        ["s.yaml:5:9", "scene.load"],
        ["s.yaml:8:25", "grids.g.axes.friction[0]"],
        ["s.yaml:8:47", "grids.g.axes.creepage[0].spin"],
        ["s.yaml:8:53", "grids.g.colour"],
        ["s.yaml:9:23", "grids.h.axes.method[0]"],
        ["s.yaml:10:3", "grids.pressure"],
        ["s.yaml:11:3", "grids.a b"],
    ]


def test_names_of_the_cube_are_named_where_a_grid_may_not_have_them(refused):
    for name in ("spin", "load", "pressure"):
        (line,) = refused(BASE + f"  {name}: {{axes: {{friction: [1]}}}}\n")
        own = f"another name, as the cube has its own {name}; its names are "
        start = f"s.yaml:8:3: grids.{name}: name of a grid: {own}"
        assert line.startswith(start)
        assert name in line.removeprefix(start)


@pytest.mark.parametrize("place", ["description: TEXT\n", "  g: {description: TEXT, axes: {friction: [1]}}\n"])
def test_longest_description(load, refused, place):
    text = BASE + place if place.startswith(" ") else f"{place}{BASE}  g: {{axes: {{friction: [1]}}}}\n"
    load(text.replace("TEXT", "x" * 20000))
    (line,) = refused(text.replace("TEXT", "x" * 20001))
    assert line.endswith("text of at most 20000 characters, none a control character")


def test_contact_larger_than_the_window(refused):
    found = refused(BASE + "  g: {axes: {load: [100, 20000], friction: [1, 2]}}\n")
    # a = (3 P R / 4 E*)^(1/3) = 1.481 mm at 20 kN
    size = "for load 20000 N, radius 50 mm and E 210000 MPa is about 2.962 mm along x"
    words = f"must be larger than the contact, which {size} (case load=20000)"
    assert found == [f"s.yaml:6:16: scene.mesh.size: [2, 2]: {words}"]


@pytest.mark.parametrize(
    ("scene", "given"),
    [
        ("radius: [50, 200]", "load 20000 N, radius 50 x 200 mm and E 210000 MPa"),
        ("counterbody: {E: 2 Es, nu: 0.3}", "load 20000 N, radius 50 mm and E 210000 MPa (counterbody 420000 MPa)"),
        ("substrate: {E: 210}", "load 20000 N, radius 50 mm and E 210 MPa"),
        (
            "layers: [{E: 2 Es, nu: 0.3, thickness: 0.1}]",
            "load 20000 N, radius 50 mm, E 210000 MPa and its layers",
        ),
    ],
)
def test_what_the_size_of_a_contact_follows_from_is_told(refused, scene, given):
    (line,) = refused(BASE + f"  g: {{scene: {{load: 20000, {scene}}}, axes: {{friction: [1]}}}}\n")
    assert f"must be larger than the contact, which for {given} is about " in line


@pytest.mark.parametrize(("most", "more"), [(10_000, "3"), (6, "at least 1")])
def test_cases_that_are_not_listed_are_counted(refused, monkeypatch, most, more):
    """Five of eight were listed without a word that there are others."""
    monkeypatch.setattr(grids, "_MAX_COUNTED", most)
    loads = ", ".join(f"{k}0000" for k in range(2, 10))
    found = refused(BASE + f"  g: {{axes: {{load: [100, {loads}], friction: [1, 2]}}}}\n")
    words = [line.rpartition(" (case ")[2] for line in found]
    assert words[:-1] == [f"load={k}0000)" for k in range(2, 7)]
    assert words[-1] == f"s.yaml:6:16: grids.g: ... and {more} more errors in cases of this grid"


CLASH = BASE.replace(
    "grids:", "  method: paper-cg\n  coupling: full\n  discretisation: aligned\n  creepage: {spin: 1}\ngrids:"
)


@pytest.mark.parametrize(
    "grid", ["axes: {load: [100, 200]}", "cases: [{label: a}, {label: b, load: 200}, {label: c, method: newton}]"]
)
def test_settings_that_clash_are_all_told_where_they_stand(refused, grid):
    """The first of them was told, at the grid."""
    assert refused(CLASH + f"  g: {{{grid}}}\n") == [
        "s.yaml:8:13: scene.coupling: full: method paper-cg is for coupling one-way only",
        "s.yaml:9:19: scene.discretisation: aligned: method paper-cg is for discretisation kalker only",
    ]


def test_full_coupling_clashes_with_no_method_where_only_the_pressure_is_wanted():
    scene = {
        "substrate": {"E": 210000, "nu": 0.3},
        "radius": 50,
        "load": 100,
        "mesh": {"size": [1, 1], "cells": [8, 8]},
    }
    stated = scene_from_mapping({**scene, "method": "paper-cg", "coupling": "full"})
    assert stated.conflicts == {} and not stated.is_coupled
    assert set(replace(stated, creepage=Creepage()).conflicts) == {"coupling"}


def test_settings_that_clash_in_some_cases_are_told_with_those(refused):
    found = refused(CLASH + "  g: {axes: {coupling: [one-way, full]}}\n")
    assert [line.partition(": ")[0] for line in found] == ["s.yaml:9:19", "s.yaml:12:3"]
    assert found[1].endswith("grids.g: method paper-cg is for coupling one-way only (case coupling=full)")
    found = refused(BASE + "  g: {cases: [{label: a, method: paper-cg, discretisation: aligned}]}\n")
    assert found == ["s.yaml:8:15: grids.g.cases[0]: method paper-cg is for discretisation kalker only (case a)"]


TOO_THIN = "a layer of 1e-12 mm: must not be thinner than 1e-09 of the Hertz radius, 2.5e-10 mm"
TOO_MANY = "modulus too extreme for so many layers"


@pytest.mark.parametrize(
    ("grid", "lines"),
    [
        ("thickness: [1e-12, 0.2], modulus: [100, 200]", [f"{TOO_THIN} (case thickness=1e-12)"]),
        ("modulus: [100, 200], thickness: [1e-12, 0.2], layer_nu: [0.1, 0.2]", [f"{TOO_THIN} (case thickness=1e-12)"]),
        ("thickness: [1e-12], modulus: [100, 200]", [f"{TOO_THIN} (case thickness=1e-12)"]),
        ("thickness: [0.1, 0.2], modulus: [1e300], layer_count: [50]", None),
        (
            "thickness: [0.1, 0.2], modulus: [1, 1e200, 1e300], layer_count: [1, 50]",
            [f"{TOO_MANY} (case modulus=1e+200, layer_count=50)", f"{TOO_MANY} (case modulus=1e+300, layer_count=50)"],
        ),
    ],
)
def test_a_case_that_cannot_be_built_is_named_by_what_makes_it_so(refused, grid, lines):
    """It was told once for each value of every other axis."""
    lines = lines or [f"{TOO_MANY} (case modulus=1e+300, layer_count=50)"]
    assert refused(BASE + f"  g: {{axes: {{{grid}}}}}\n") == [f"s.yaml:8:3: grids.g: {line}" for line in lines]


def test_window_is_checked_for_every_combination(refused):
    text = BASE + '  g: {axes: {radius: [50, [50, 800]], load: [100, 1000], mesh.size: [[2, 2], ["8 a", 2]]}}\n'
    found = refused(text)
    assert [line.split(": ")[0] for line in found] == ["s.yaml:8:70", "s.yaml:8:78"]
    assert all("along y (case radius=50 x 800, load=1000)" in line for line in found)


def test_window_of_contacts_that_differ_in_their_layers_alone(refused):
    """One line was repeated with other numbers, and no case was named; equal reasons are given once."""
    grid = "  g: {coating: {modulus: 0.25 Es}, axes: {thickness: [50, 100], load: [9000, 9001], friction: [1, 2]}}\n"
    text = BASE.replace("size: [2, 2]", "size: [1, 1]")
    found = refused(text + "  g: {coating: {thickness: 0.5 a}, axes: {modulus: [0.5 Es, 2 Es], load: [5000]}}\n")
    assert [line.rpartition(" (case ")[2] for line in found] == [
        "modulus=0.5 Es, load=5000)",
        "modulus=2 Es, load=5000)",
    ]
    found = refused(text + grid)
    assert [line.rpartition(" (case ")[2] for line in found] == ["thickness=50, load=9000)", "thickness=50, load=9001)"]


def test_window_of_a_contact_between_moduli_of_both_kinds(load):
    """A layer softer in shear but stiffer in volume than the substrate: neither bounds the contact by itself."""
    grid = "{layers: [{E: 0.75 Es, nu: 0.5, thickness: 0.15}], mesh: {size: [0.4979, 0.4979], cells: [64, 64]}"
    load(BASE + f"  g: {{scene: {grid}, substrate: {{nu: 0}}}}, axes: {{friction: [1]}}}}\n")


def test_contact_smaller_than_a_cell(refused):
    (line,) = refused(BASE + "  g: {axes: {mesh.size: [[2, 2], [200, 2]]}}\n")
    assert line.startswith(
        "s.yaml:6:31: scene.mesh.cells: [32, 32]: must be more: each smaller than the contact, which is about 0.5066 mm"
    )


def test_windows_and_layers_that_are_just_enough(load):
    """Cells three quarters as large as the contact of radius 0.2533 mm; a layer of two billionths of that radius."""
    load(BASE + "  g: {axes: {mesh.size: [[2, 2], [12, 2]]}}\n")
    load(BASE + "  g: {coating: {thickness: 5.0e-10, modulus: 2 Es}, axes: {friction: [1]}}\n")


def test_too_many_cases(refused):
    numbers = ", ".join(str(k) for k in range(1, 1501))
    (line,) = refused(BASE + f"  g: {{axes: {{load: [{numbers}], friction: [{numbers}]}}}}\n")
    assert line == f"s.yaml:8:3: grids.g: 2250000 cases so far: at most {MAX_CASES} cases in a study"


# scenes from Python


def test_scene_from_mapping_takes_numpy_and_tuples():
    scene = scene_from_mapping(
        {
            **SCENE,
            "radius": np.array([50.0, 60.0]),
            "load": np.float64(80),
            "mesh": {"size": (2, 3), "cells": (np.int64(8), 16)},
            "creepage": {"longitudinal": np.float32(0.5)},
        }
    )
    assert scene.radius == (50.0, 60.0)
    assert scene.load == 80.0
    assert scene.mesh.cells == (8, 16)
    assert scene.creepage == Creepage(0.5, 0.0, 0.0)
    assert type(scene.load) is float


def test_scene_from_mapping_names_every_bad_key():
    bad = {**SCENE, "layers": [{"E": 1, "nu": 0.9, "thickness": 1}], "laod": 3, "load": True, "coating": {}}
    with pytest.raises(UserError) as error:
        scene_from_mapping(bad)
    assert [line.split(": ")[:2] for line in str(error.value).splitlines()] == [
        ["layers[0].nu", "0.9"],
        ["load", "True"],
        ["laod", "unknown key"],
        ["coating", "unknown key"],
    ]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"load": 1e6}, r"mesh\.size: \[2, 2\]: must be larger than the contact"),
        ({"load": 1e-300, "radius": 1e-200}, "too extreme"),
        ({"radius": 1e300, "load": 1e300}, "radius, load and moduli too extreme"),
        # the largest pressure is so small that it becomes 0
        ({"substrate": {"E": 1e-300, "nu": 0.3}, "radius": 1e100, "load": 1e-200}, "radius, load and moduli too"),
        ({"mesh": {}}, r"mesh\.size: missing"),
        (
            {"method": "paper-cg", "coupling": "full", "discretisation": "aligned", "creepage": {"spin": 1}},
            "^coupling: full: method .* is for coupling .* only\ndiscretisation: aligned: method .* kalker only$",
        ),
    ],
)
def test_scene_from_mapping_refuses(change, words):
    with pytest.raises(UserError, match=words):
        scene_from_mapping({**SCENE, **change})


def test_scene_from_mapping_of_no_mapping():
    with pytest.raises(UserError, match="a scene is a mapping, not list"):
        scene_from_mapping([])
    inside = {}
    inside["substrate"] = inside
    with pytest.raises(UserError, match="nested more than"):
        scene_from_mapping(inside)


@pytest.mark.parametrize(
    ("grid", "words"),
    [
        ("scene: {load: }, axes: {friction: [1]}", "8:15: grids.g.scene.load: (nothing): a number above 0, in N"),
        (
            "scene: {substrate: {E: 1e300}, mesh: {size: auto}}, axes: {friction: [1]}",
            "8:3: grids.g: materials, radius or load too extreme for a window to be fitted to the contact",
        ),
        (
            "scene: {layers: [{E: 1e-17 Es, nu: 0.5, thickness: 1e-8}], mesh: {size: auto}}, axes: {friction: [1]}",
            "8:3: grids.g: materials, radius or load too extreme for a window to be fitted to the contact",
        ),
        (
            "scene: {creepage: {spin: 1}}, axes: {method: [newton, paper-cg], coupling: [one-way, full]}",
            "8:3: grids.g: method paper-cg is for coupling one-way only (case method=paper-cg, coupling=full)",
        ),
        (
            "axes: {method: [newton, paper-cg], discretisation: [kalker, aligned]}",
            "8:3: grids.g: method paper-cg is for discretisation kalker only (case method=paper-cg, "
            "discretisation=aligned)",
        ),
    ],
)
def test_what_was_found_too_late(refused, grid, words):
    """Places of what is not there, tracebacks of extremes, and methods that do not go together."""
    assert refused(f"{BASE}  g: {{{grid}}}\n") == [f"s.yaml:{words}"]


@pytest.mark.parametrize("margin", [1.04, 10.1])
def test_margins_of_windows(tmp_path, margin):
    found = refusal(tmp_path, BASE + f"  g: {{scene: {{mesh: {{margin: {margin}}}}}, axes: {{friction: [1]}}}}\n")
    assert found[0].endswith(f"scene.mesh.margin: {margin}: a number from 1.05 to 10"), found


def test_as_many_axes_as_a_file_can_hold(tmp_path):
    """Each of one value; seventeen are one too many."""
    axes = {
        "friction": 1, "load": 100, "radius": 50, "coupling": "full", "method": "newton", "discretisation": "kalker",
        "spin_point": 0, "layer_count": 1, "thickness": 0.1, "modulus": 1000, "layer_nu": 0.3,
        "creepage.longitudinal": 0, "creepage.lateral": 0, "creepage.spin": 0, "tolerance.normal": 0.1,
        "tolerance.tangential": 0.1, "mesh.margin": 1.2,
    }  # fmt: skip
    words = ", ".join(f"{path}: [{value}]" for path, value in axes.items())
    found = refusal(tmp_path, BASE + f"  g: {{axes: {{{words}}}}}\n")
    assert any("17 axes: at most 16 axes in a grid" in line for line in found), found


@pytest.mark.parametrize(("written", "value"), [("1/6", 1 / 6), ("-1/4", -0.25), (" 1/3 ", 1 / 3), ("0/7", 0.0)])
def test_spin_points_may_be_fractions(written: str, value: float) -> None:
    """They are written so in the field: 1/6 is CONTACT's."""
    assert scene_from_mapping(SCENE | {"spin_point": written}).spin_point == value
    for wrong in ("1/0", "2/3", "1/6/2", "1.5/9", "1/6 a", "/6"):
        with pytest.raises(UserError, match=r"a number from -0\.5 to 0\.5, in cells; also a fraction such as 1/6"):
            scene_from_mapping(SCENE | {"spin_point": wrong})
    with pytest.raises(UserError, match=r"friction: 1/6: a number above 0"):
        scene_from_mapping(SCENE | {"friction": "1/6"})


@pytest.mark.parametrize("text", ["- 1\n", "3\n", "grids: 3\n", "grids: [1]\n", "grids: {g: 3}\n", "grids: {}\n", "\t"])
def test_of_a_text_that_is_no_study_no_grid_is_known(text):
    """As that in a cube may be, of which figures and tables are made all the same."""
    assert written_grid(text, "g") is None
    assert starting_scene(text, "g") == (None, frozenset())
    assert labelled_scenes(text, "g", "case", ["x"]) == {}


def test_so_many_cases_are_allowed_and_no_more(tmp_path, refused, monkeypatch):
    monkeypatch.setattr("rcstudy.study.MAX_CASES", 3)
    text = f"{BASE}  g: {{axes: {{load: [1, 2]}}}}\n  h: {{axes: {{load: [LOADS]}}}}\n"
    assert len(expand(load_text(tmp_path, text.replace("LOADS", "3"))).cases) == 3
    (line,) = refused(text.replace("LOADS", "3, 4"))
    assert line == "s.yaml:9:3: grids.h: 4 cases so far: at most 3 cases in a study"
