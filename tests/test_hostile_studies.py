"""Hostile studies through `rcstudy plan`: exit code 0 or 2, no traceback, no hang, no memory to speak of, no file."""

from __future__ import annotations

import copy
import json
import sys
import time
import tracemalloc
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from ruamel.yaml import YAML
from studies import BASE, CONFIGS, load_text, refusal

from rcstudy import cli
from rcstudy.errors import UserError
from rcstudy.study import scene_from_mapping
from rcstudy.studyfile import yamlfile

SHORT = [CONFIGS / name for name in ("small.yaml", "paper.yaml", "accuracy.yaml")]


def plan(path: Path) -> int:
    """Exit code of `rcstudy plan`; whatever else the command raises comes through."""
    try:
        cli.app(["plan", str(path)])
    except SystemExit as left:
        return int(left.code or 0)
    return 0


def checked_plan(folder: Path, text: bytes, capsys: pytest.CaptureFixture[str]) -> int:
    """Exit code for the study `text`: 0, or 2 with a message that names the file, within seconds."""
    path = folder / "s.yaml"
    path.write_bytes(text)
    begun = time.monotonic()
    code = plan(path)
    said = capsys.readouterr()
    assert time.monotonic() - begun < 120  # a hang is what is looked for; the machine may be busy
    assert "Traceback" not in said.out + said.err
    if code == 2:
        assert said.err.startswith(str(path))
    else:
        assert code == 0
        assert said.out.startswith("study ")
    assert [entry.name for entry in folder.iterdir()] == ["s.yaml"]
    return code


# what stands for a number, text or mapping where there was another; raw ones are put into the text as they are
RAW = [
    "1e400",
    "-.inf",
    ".nan",
    "10**5000",
    "9" * 5000,
    "0x" + "f" * 400,
    "1_0",
    "1:2:3",
    "2001-01-01",
    "~",
    "*a",
    "!!t",
]
HOSTILE: list[Any] = [
    *(None, True, 0, -1, 1e-320, 1e308, 5e-324, 2**63, 10**400, "", " ", "a", "Es", "0.25 a", "1e400 a", "1e-400 Es"),
    *(
        "../../x",
        "/etc/x",
        "a\0b",
        "\x1b[2J",
        "x" * 30_000,
        "\ud7ff",
        "ﷺ" * 90,
        "pressure",
        "x",
        "grid",
        "auto",
        "rigid",
    ),
    *([], {}, [[]], [None], {"": ""}, [0] * 200, {"label": "b"}, {"label": ["b"], "E": {}}, [[[[[[1]]]]]]),
    *(f"raw:{k}" for k in range(len(RAW))),
]
KEYS = ["", "layers", "axes", "cases", "scene", "case", "x", "../x", "mesh.size", "layers[0]", "E", "\0", "raw:0"]


def places(value: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Paths of all values in a tree."""
    inside = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    return [path, *(place for key, below in inside for place in places(below, (*path, key)))]


def at(tree: Any, path: tuple[Any, ...]) -> Any:
    for key in path:
        tree = tree[key]
    return tree


def mutated(tree: Any, draw: st.DrawFn) -> Any:
    """`tree` with one value replaced, dropped, renamed, wrapped, doubled or put in the place of another."""
    path = draw(st.sampled_from(places(tree)))
    kind = draw(st.sampled_from(("replace", "drop", "rename", "wrap", "double", "move")))
    if not path:
        return draw(st.sampled_from(HOSTILE)) if kind == "replace" else tree
    tree = copy.deepcopy(tree)
    parent, key = at(tree, path[:-1]), path[-1]
    if kind == "replace":
        parent[key] = draw(st.sampled_from(HOSTILE))
    elif kind == "drop":
        del parent[key]
    elif kind == "rename" and isinstance(parent, dict):
        parent[draw(st.sampled_from(KEYS))] = parent.pop(key)
    elif kind == "wrap":
        parent[key] = draw(st.sampled_from(([parent[key]], {"label": parent[key]}, [parent[key], parent[key]])))
    elif kind == "double" and isinstance(parent, list):
        parent.insert(key, copy.deepcopy(parent[key]))
    elif kind == "move":
        parent[key] = copy.deepcopy(at(tree, draw(st.sampled_from(places(tree)))))
    return tree


TREES = [YAML(typ="safe", pure=True).load(path.read_text()) for path in SHORT]


@st.composite
def hostile_studies(draw: st.DrawFn) -> bytes:
    """A study of this project, mutated one to four times as a tree, then now and then as bytes."""
    tree = draw(st.sampled_from(TREES))
    for _ in range(draw(st.integers(1, 4))):
        tree = mutated(tree, draw)
    text = json.dumps(tree)
    for k, raw in enumerate(RAW):
        text = text.replace(f'"raw:{k}"', raw)
    data = text.encode()
    if draw(st.integers(0, 3)) == 0:
        start = draw(st.integers(0, len(data)))
        data = data[:start] + draw(st.binary(max_size=4)) + data[start + draw(st.integers(0, 40)) :]
    return data


@settings(
    max_examples=120,
    deadline=None,
    derandomize=True,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow, HealthCheck.data_too_large],
)
@given(hostile_studies())
def test_mutated_trees(tmp_path: Path, capsys: pytest.CaptureFixture[str], text: bytes) -> None:
    checked_plan(tmp_path, text, capsys)


def test_the_mutations_reach_both_ends(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """As JSON the unchanged studies are studies: it is the mutations that are refused."""
    for tree in TREES:
        assert checked_plan(tmp_path, json.dumps(tree).encode(), capsys) == 0
    assert checked_plan(tmp_path, json.dumps({**TREES[0], "scene": 1}).encode(), capsys) == 2


def test_contacts_of_no_size(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Found by the mutations above: the uncoated contact has a size just so, the coated one has not."""
    for radius, modulus in (("1e-320", "2 Es"), ("1e-300", "1e300"), ("1e-300", "1e307"), ("1e300", "1e-300")):
        text = BASE.replace("radius: 50", f"radius: {radius}")
        text += f"  g: {{coating: {{layer_count: 2, thickness: 1 a, modulus: {modulus}}}, axes: {{load: [100]}}}}\n"
        assert checked_plan(tmp_path, text.encode(), capsys) == 2


# bounds


def bounded(folder: Path, text: str, seconds: float, megabytes: float) -> str:
    """The last line of the refusal of `text`, found in bounded time and memory."""
    tracemalloc.start()
    begun = time.monotonic()
    try:
        found = refusal(folder, text)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert time.monotonic() - begun < seconds
    assert peak < megabytes * 1e6, peak
    return found[-1]


def test_a_billion_laughs_are_few(tmp_path: Path) -> None:
    text = "a: &a [1, 1, 1, 1, 1, 1, 1, 1, 1, 1]\n"
    for k in range(1, 20):
        text += f"{chr(97 + k)}: &{chr(97 + k)} [{', '.join(['*' + chr(96 + k)] * 10)}]\n"
    assert "aliases may add 100000 values in all" in bounded(tmp_path, text, 20.0, 60.0)


def test_a_trillion_cases_are_refused_before_any_is_made(tmp_path: Path) -> None:
    values = ", ".join(str(1 + i / 1000) for i in range(1000))
    axes = "".join(f"      {path}: [{values}]\n" for path in ("load", "friction", "radius", "mesh.margin"))
    said = bounded(tmp_path, BASE + "  g:\n    axes:\n" + axes, 30.0, 60.0)
    assert said == "s.yaml:8:3: grids.g: 1000000000000 cases so far: at most 2000000 cases in a study"


def test_many_values_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(yamlfile, "MAX_VALUES", 1000)
    values = ", ".join(str(1 + i / 1000) for i in range(2000))
    said = refusal(tmp_path, BASE + f"  g: {{axes: {{load: [{values}]}}}}\n")
    assert said[-1].startswith("s.yaml:8:")
    assert said[-1].endswith("too long: at most 1000 keys and values in a file")
    monkeypatch.setattr(yamlfile, "MAX_VALUES", 2100)
    assert load_text(tmp_path, BASE + f"  g: {{axes: {{load: [{values}]}}}}\n").size == 2000


@pytest.mark.parametrize(
    "number", ["9" * 5000, "9" * 1_000_000, "0x" + "f" * 1_000_000, "1e400", ".nan", ".inf", "-.inf"]
)
def test_numbers_beyond_all_bounds(tmp_path: Path, number: str) -> None:
    begun = time.monotonic()
    (line,) = refusal(tmp_path, BASE + f"  g: {{axes: {{load: [{number}]}}}}\n")
    assert time.monotonic() - begun < 20
    assert line.startswith("s.yaml:8:21: grids.g.axes.load[0]: ")
    assert line.endswith(": a number above 0, in N")
    (line,) = refusal(tmp_path, BASE + f"  g: {{scene: {{mesh: {{cells: [8, {number}]}}}}, axes: {{load: [1]}}}}\n")
    assert line.endswith("a whole number from 4 to 4096")


@pytest.mark.parametrize("name", ["../x", "/x", "..", ".", "a/b", "a\\b", "x\0", "", "~/x", "$HOME", "a b", "%s", "é"])
def test_no_name_in_a_study_is_a_path(tmp_path: Path, name: str) -> None:
    """The names of study and grids are part of file names (figures, tables): they cannot lead anywhere else."""
    quoted = json.dumps(name)
    (line,) = refusal(tmp_path, BASE.replace("study: s", f"study: {quoted}") + "  g: {axes: {load: [1]}}\n")
    assert line.startswith("s.yaml:1:8: study: ")
    (line,) = refusal(tmp_path, BASE + f"  {quoted}: {{axes: {{load: [1]}}}}\n")
    assert line.startswith("s.yaml:8:3: grids")
    assert "a grid's name is at most 64 letters" in line


def test_scenes_from_python_are_bounded_too() -> None:
    inside: dict[str, Any] = {}
    inside["scene"] = inside
    with pytest.raises(UserError, match="nested more than 32 deep"):
        scene_from_mapping(inside)
    deep: Any = 1
    for _ in range(sys.getrecursionlimit() * 2):
        deep = [deep]
    with pytest.raises(UserError, match="nested more than 32 deep"):
        scene_from_mapping({"load": deep})


def test_special_files_are_no_studies(tmp_path: Path) -> None:
    for path in ("/dev/zero", "/dev/null", "/proc/self/mem"):
        if Path(path).exists():
            assert plan(Path(path)) == 2
