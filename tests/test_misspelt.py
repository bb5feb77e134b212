"""One mistake in a study is told once: a misspelt key is not missing besides, a missing one not once for each case."""

import pytest
from studies import refusal

SCENE = "{substrate: {E: 210000, nu: 0.3}, radius: 50, load: 100, mesh: {size: [2, 2], cells: [16, 16]}}"
GRIDS = """\
grids:
  g1: {cases: [{label: a}, {label: b, load: 50}]}
  g2: {cases: [{label: a}, {label: b, load: 50}]}
  g3: {axes: {load: [50, 100], friction: [0.1, 0.2]}}
"""
TEXT = f"study: s\nscene: {SCENE}\n{GRIDS}"
KEYS = (
    "substrate, layers, counterbody, radius, load, friction, creepage, mesh, coupling, method, discretisation, "
    "spin_point, tolerance"
)
LENGTHS = "missing: a number above 0, in mm, or two [Rx, Ry]"


@pytest.fixture
def refused(tmp_path):
    """Lines of the refusal of a text, without what is allowed besides what was meant."""
    return lambda text: [line.partition(" allowed: ")[0] for line in refusal(tmp_path, text)]


def test_a_misspelt_key_of_the_shared_scene_is_told_in_one_line(tmp_path):
    """There were six, the last five on what cases and grids lacked."""
    assert refusal(tmp_path, TEXT.replace("radius:", "raduis:")) == [
        f"s.yaml:2:42: scene.raduis: unknown key: did you mean radius? allowed: {KEYS}"
    ]


@pytest.mark.parametrize(
    ("right", "wrong", "line"),
    [
        ("E: 210000", "e: 210000", "2:21: scene.substrate.e: unknown key: did you mean E?"),
        ("study: s", "Study: s", "1:1: Study: unknown key: did you mean study?"),
        ("substrate:", "Substrate:", "2:9: scene.Substrate: unknown key: did you mean substrate?"),
        ("scene:", "Scene:", "2:1: Scene: unknown key: did you mean scene?"),
        ("grids:", "Grids:", "3:1: Grids: unknown key: did you mean grids?"),
        ("radius: 50", "radius 50", "2:42: scene.radius 50: unknown key: a ': ' is missing after radius"),
        ("cells:", "cell:", "2:86: scene.mesh.cell: unknown key: did you mean cells?"),
        ("g1: {cases:", "g1: {case:", "4:8: grids.g1.case: unknown key: did you mean cases?"),
        ("g3: {axes:", "g3: {axis:", "6:8: grids.g3.axis: unknown key: did you mean axes?"),
        (
            "g2: {cases: [{label:",
            "g2: {cases: [{lable:",
            "5:17: grids.g2.cases[0].lable: unknown key: did you mean label?",
        ),
    ],
)
def test_a_misspelt_key_is_not_missing(refused, right, wrong, line):
    assert TEXT.count(right) == 1
    assert refused(TEXT.replace(right, wrong)) == [f"s.yaml:{line}"]


@pytest.mark.parametrize(
    ("grid", "line"),
    [
        ("cases: [{label: a, raduis: 50}]", "3:32: grids.g.cases[0].raduis: unknown key: did you mean radius?"),
        ("scene: {raduis: 50}, axes: {load: [1, 2]}", "3:21: grids.g.scene.raduis: unknown key: did you mean radius?"),
        ("axes: {raduis: [50, 60]}", "3:20: grids.g.axes.raduis: unknown axis: did you mean radius?"),
    ],
)
def test_a_key_of_the_scene_that_is_misspelt_in_a_grid(refused, grid, line):
    bare = SCENE.replace("radius: 50, ", "")
    assert refused(f"study: s\nscene: {bare}\ngrids: {{g: {{{grid}}}}}\n") == [f"s.yaml:{line}"]


@pytest.mark.parametrize(
    ("grid", "line"),
    [
        (
            "coating: {thicknes: 1, modulus: 2}, cases: [{label: a}, {label: b, coating: {layer_count: 2}}]",
            "grids.g.coating.thicknes: unknown key: did you mean thickness?",
        ),
        ("axes: {thicknes: [1], modulus: [2]}", "grids.g.axes.thicknes: unknown axis: did you mean thickness?"),
        ("axes: {load: {first: 1, last: 2, cuont: 3}}", "grids.g.axes.load.cuont: unknown key: did you mean count?"),
        (
            "scene: {counterbody: {e: 1, nu: 0}}, axes: {load: [1]}",
            "grids.g.scene.counterbody.e: unknown key: did you mean E?",
        ),
    ],
)
def test_other_misspelt_keys(refused, grid, line):
    (found,) = refused(f"study: s\nscene: {SCENE}\ngrids: {{g: {{{grid}}}}}\n")
    assert found.partition(": ")[2] == line


def test_what_a_misspelt_key_holds_is_read(refused):
    """All errors are found at once."""
    text = (
        TEXT.replace("scene:", "Scene:").replace("load: 100", "load: 0").replace("cases: [{label: a}", "case: [{}", 1)
    )
    assert refused(text) == [
        "s.yaml:2:1: Scene: unknown key: did you mean scene?",
        "s.yaml:2:60: Scene.load: 0: a number above 0, in N",
        "s.yaml:4:8: grids.g1.case: unknown key: did you mean cases?",
        "s.yaml:4:15: grids.g1.case[0].label: missing: a label of 1 to 100 printable characters",
    ]


@pytest.mark.parametrize("more", ["", "  g4: {scene: {friction: 0.5}, axes: {load: [1]}}\n"])
def test_what_the_scene_lacks_is_told_once(refused, more):
    """It was told for each case, and for each grid with a scene of its own."""
    text = TEXT.replace("radius: 50, ", "") + more
    assert refused(text) == [f"s.yaml:2:1: scene.radius: {LENGTHS}"]


def test_keys_that_no_other_stands_for_are_missing_once(refused):
    assert refused(TEXT.replace("nu: 0.3", "poisson: 0.3")) == [
        "s.yaml:2:9: scene.substrate.nu: missing: a number from 0 to 0.5",
        "s.yaml:2:32: scene.substrate.poisson: unknown key:",
    ]


@pytest.mark.parametrize(
    ("grids", "places"),
    [
        ("g: {cases: [{label: a, radius: 50}, {label: b}, {label: c}]}", ["grids.g.cases[1]", "grids.g.cases[2]"]),
        ("f: {axes: {radius: [50]}}, g: {cases: [{label: a}, {label: b}]}", ["scene"]),
        (
            "f: {axes: {radius: [50]}}, g: {scene: {friction: 1}, cases: [{label: a}, {label: b}]}",
            ["grids.g.scene"],
        ),
    ],
)
def test_what_some_cases_or_grids_lack_is_told_of_these(refused, grids, places):
    bare = SCENE.replace("radius: 50, ", "")
    found = refused(f"study: s\nscene: {bare}\ngrids: {{{grids}}}\n")
    assert [line.partition(": ")[2] for line in found] == [f"{place}.radius: {LENGTHS}" for place in places]


def test_mappings_of_cases_and_values_that_lack_a_key_are_told_one_by_one(refused):
    grids = (
        "g: {cases: [{label: a, counterbody: {E: 1}}, {label: b, counterbody: {E: 1}}]}, "
        "h: {axes: {counterbody: [{E: 1}, {nu: 0}]}}"
    )
    found = refused(f"study: s\nscene: {SCENE}\ngrids: {{{grids}}}\n")
    assert [line.split(": ")[1] for line in found] == [
        "grids.g.cases[0].counterbody.nu",
        "grids.g.cases[1].counterbody.nu",
        "grids.h.axes.counterbody[0].nu",
        "grids.h.axes.counterbody[1].E",
    ]


def test_a_mapping_that_the_values_of_an_axis_make_lacks_a_key_once(refused):
    bare = SCENE.replace(", mesh: {size: [2, 2], cells: [16, 16]}", "")
    text = f"study: s\nscene: {bare}\ngrids: {{g: {{axes: {{mesh.cells: [[8, 8], [9, 9]]}}}}}}\n"
    assert refused(text) == [
        "s.yaml:3:33: scene.mesh.size: missing: auto or two lengths [x, y], in mm or such as '8 a'"
    ]


COATING = "coating: {layer_count: 1, modulus: 1000}"


@pytest.mark.parametrize(
    ("grid", "line"),
    [
        *(
            (f"{COATING}, axes: {{thickness: {value}}}", f"axes.thickness: {shown}: a list of at least one value, or")
            for value, shown in [
                ("0.1", "0.1"),
                ("[]", "[]"),
                ("{}", "{}"),
                ("", "(nothing)"),
                ('"0.1, 0.2"', "0.1, 0.2"),
            ]
        ),
        (f"{COATING}, axes: {{thickness: *undefined}}", "axes.thickness: *undefined: no anchor &undefined stands"),
        ("axes: {load: []}", "axes.load: []: a list of at least one value, or"),
        ("axes: {load: 100, friction: [0.1, 0.2]}", "axes.load: 100: a list of at least one value, or"),
    ],
)
def test_what_an_axis_that_is_no_list_gives_is_not_missing(tmp_path, grid, line):
    bare = SCENE.replace("load: 100, ", "") if "load" in grid else SCENE
    (found,) = refusal(tmp_path, f"study: s\nscene: {bare}\ngrids: {{g: {{{grid}}}}}\n")
    assert found.partition(": ")[2].startswith(f"grids.g.{line}")


@pytest.mark.parametrize("axis", ["load: []", "laod: [1]"])
def test_other_axes_are_checked_beside_one_that_is_refused(refused, axis):
    found = refused(f"study: s\nscene: {SCENE}\ngrids: {{g: {{axes: {{{axis}, friction: [0.1, 0.1]}}}}}}\n")
    assert [line.split(": ")[1] for line in found] == [f"grids.g.axes.{axis[:4]}", "grids.g.axes.friction[1]"]
