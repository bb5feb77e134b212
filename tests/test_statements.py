"""Which way each of the paper's statements is judged: on made-up cubes where all hold, where none does, and between.

Which cases a cube gives, and how comparisons become verdicts, is tested in test_report.py and test_judge.py.
"""

from __future__ import annotations

import re
from typing import NamedTuple

import numpy as np
import pytest
from synthetic import RADIUS, SUBSTRATE, TABLE_2, Synthetic, paper, synthetic_tree

from rcstudy.mechanics.scene import Scene
from rcstudy.report.paper import PaperCase, paper_cases
from rcstudy.report.paper_statements import STATEMENTS
from rcstudy.report.statements import comparisons_table, judged, verdict
from rcstudy.report.views import grids
from rcstudy.result import ESTIMATED, CellState

UNTESTABLE = {1, 7, 8, 16}
"""Numbers of the statements that no cube decides."""

CONTRADICTS = 44
"""Number of the statement that says of slip under stiff layers the opposite of others, such as the last one."""

ALWAYS = 6
"""Number of the statement that holds wherever errors are small."""

MUCH = {4, 15, 26, 36, 37, 49}
"""Numbers of the statements for which a little is not enough: `much smaller`, `significant`."""

RIVALS = {6, 9, 10, 13, 14, 17, 19, 20, 22, 23, 24, 25, 28, 30, 35, 49}
"""Numbers of the statements with a rival reading."""


class World(NamedTuple):
    """How strongly numbers, and which way maps, depend on layers and creepages: 1 as the paper says, -1 the opposite.

    `significant`: how strongly forces and ratios of slip do where the paper calls that significant; `error`: of all
    numbers, over their values.
    """

    numbers: float
    maps: float
    significant: float
    error: float = 1e-9


WORLDS = {
    "as the paper says": World(1.0, 1.0, 1.0),
    "the opposite": World(-1.0, -1.0, -0.05),
    "hardly": World(0.05, 1.0, 0.05),
    "coarse": World(1.0, 1.0, 1.0, error=0.2),
}


def kind(scene: Scene) -> float:
    """1 with a compliant layer at the surface, -1 with a stiff one, 0 with none."""
    return float(np.sign(SUBSTRATE.E - scene.layers[0].E)) if scene.layers else 0.0


def depth(scene: Scene) -> float:
    """Thickness of each layer over Hertz's radius, up to 1."""
    return scene.layers[0].thickness / RADIUS if scene.layers else 0.0


def numbers_of(scene: Scene, world: World) -> dict[str, float]:
    """Scalars whose order is the world's."""
    k, t = kind(scene), depth(scene)
    radius = 0.3 * float(np.exp(world.numbers * k * (0.1 + 0.1 * t)))
    made = {
        "contact_radius": radius,
        "contact_area": np.pi * radius**2,
        "pressure_max": 1000.0 * float(np.exp(-world.numbers * k * (0.2 + 0.1 * t))),
    }
    if (c := scene.creepage) is not None:
        much = c.longitudinal / 0.01
        ratio = 0.5 - world.numbers * k * (0.3 - 0.2 * t) + world.numbers * (10.0 * c.lateral + 2.0 * abs(c.spin))
        force = np.exp(-world.significant * k * (0.1 + 0.2 * t) + max(world.significant, 0.0) * 0.3 * much)
        made |= {
            "slip_area": ratio * (0.8 + max(world.significant, 0.0) * 0.2 * much) * made["contact_area"],
            "traction_max": 200.0 * float(np.exp(-world.numbers * k * t)),
            "force_x": 30.0 * float(force),
            "force_y": 0.0,
        }
    return made | {f"{name}_error": world.error * abs(made[name]) for name in ESTIMATED if name in made}


def map_of(scene: Scene, world: World) -> dict[str, np.ndarray]:
    """State and tractions on a disk of 56 cells across: slip at the trailing ends of rows, stick elsewhere.

    As the paper says, slip is as deep in all rows without spin, and with spin deeper at y > 0 and less so at y < 0.
    The opposite: with spin deeper at y < 0; without spin the rows at y < 0 slip at their leading ends, too; and all
    that is mirrored under stiff layers.
    """
    c = scene.creepage
    assert c is not None
    x, y = (np.arange(n) - (n - 1) / 2 for n in scene.mesh.cells)
    half = np.sqrt(np.clip(28.0**2 - y**2, 0.0, None))
    upwards = np.where(y > 0, 1.0, -1.0) * world.maps
    if world.maps < 0 and kind(scene) < 0:
        upwards = -upwards
    lines = not c.lateral and not c.spin  # of these, slip on the x-axis is compared
    deep = 0.5 - world.maps * kind(scene) * (0.4 - 0.3 * depth(scene)) if lines else 0.3 + 20.0 * c.spin * upwards
    place = (x[:, None] + half) / np.where(half > 0, 2.0 * half, 1.0)  # 0 to 1 along each row
    slips = place < deep
    odd = world.maps * (1 if c.spin else -1) > 0
    if world.maps < 0 and not c.spin and not lines:
        slips |= (place > 0.7) & (upwards > 0)
    inside = np.abs(x[:, None]) < half
    state = np.where(inside, np.where(slips, CellState.SLIP, CellState.STICK), CellState.EXTERIOR)
    size = inside * np.where(odd & (y < 0), 0.4, 1.0)
    # lateral creepage is no mirror image of itself: only the magnitudes of tractions are
    return {"state": state.astype("i1"), "traction_x": size, "traction_y": size if world.maps > 0 else 0.0 * size}


def cube_of(world: World) -> Synthetic:
    """The paper's grids with the numbers and maps of a world."""
    made = paper((64, 64), TABLE_2)  # cells of the size that the paper calls representative
    for case, result in made.results:
        result.scalars |= numbers_of(case.scene, world)
        if case.scene.creepage is not None:
            result.fields |= map_of(case.scene, world)
    return made


@pytest.fixture(scope="module")
def cases(tmp_path_factory: pytest.TempPathFactory) -> dict[str, list[PaperCase]]:
    """The cases of each world."""
    found = {}
    for name, world in WORLDS.items():
        with synthetic_tree(tmp_path_factory.mktemp("world"), cube_of(world)) as tree:
            found[name] = paper_cases(grids(tree.load()))
    return found


def answers(cases: list[PaperCase], *, rival: bool = False) -> dict[int, str]:
    """Whether all comparisons of each statement that has any, or of its `rival` reading, hold ("yes") or none does."""
    found = {}
    for number, one in enumerate(STATEMENTS, 1):
        compared = list((one.instead if rival else one.judge)(cases))
        if compared:
            n = len(compared)
            words = {f"borne out ({n} of {n})": "yes", f"not borne out (0 of {n})": "no"}
            found[number] = words.get(verdict(compared), verdict(compared))
    return found


def expected(others: str, **apart: set[int]) -> dict[int, str]:
    """`others` for all statements that can be tested but for those named `apart`, such as `no={44}`."""
    found = dict.fromkeys(sorted(set(range(1, 53)) - UNTESTABLE), others)
    return found | {number: answer for answer, numbers in apart.items() for number in numbers}


def test_statements_hold_as_the_paper_says(cases: dict[str, list[PaperCase]]) -> None:
    assert len(STATEMENTS) == 52
    assert {number for number, one in enumerate(STATEMENTS, 1) if one.untestable} == UNTESTABLE
    assert answers(cases["as the paper says"]) == expected("yes", no={CONTRADICTS})


def test_statements_are_judged_by_the_layers_that_their_criteria_name(cases: dict[str, list[PaperCase]]) -> None:
    checked = 0
    for one in STATEMENTS:
        named = set(re.findall(r"compliant|stiff|no layer", one.criterion))
        kinds = {case.kind for compared in one.judge(cases["as the paper says"]) for case in compared.cases}
        if named and kinds:
            assert kinds == {"none" if word == "no layer" else word for word in named}, one.quote
            checked += 1
    assert checked > 30


def test_statements_do_not_hold_the_other_way_round(cases: dict[str, list[PaperCase]]) -> None:
    assert answers(cases["the opposite"]) == expected("no", yes={CONTRADICTS, ALWAYS})


def test_statements_of_much_need_much(cases: dict[str, list[PaperCase]]) -> None:
    assert answers(cases["hardly"]) == expected("yes", no={CONTRADICTS} | MUCH)


def test_a_mesh_is_not_representative_by_large_errors(cases: dict[str, list[PaperCase]]) -> None:
    """Nor is it said not to be: the error may be less than its estimate."""
    assert answers(cases["coarse"])[ALWAYS] == answers(cases["coarse"], rival=True)[ALWAYS] == "undecided (112 of 112)"


def test_rival_readings(cases: dict[str, list[PaperCase]]) -> None:
    """Some say the opposite of what they rival; one is of pairs of which only those with the same spin are alike."""
    paper_says, opposite, hardly = (
        answers(cases[name], rival=True) for name in ("as the paper says", "the opposite", "hardly")
    )
    other_half = {22, 23, 24, 35}
    no = dict.fromkeys({17} | other_half, "no")
    assert paper_says == dict.fromkeys(RIVALS, "yes") | no | {25: "borne out in 6 of 30 cases"}
    assert opposite == dict.fromkeys(RIVALS, "no") | dict.fromkeys(other_half | {ALWAYS, 49}, "yes")
    assert hardly[49] == "no"


def test_every_rival_reading_has_a_name() -> None:
    """Its verdict in the remark stood behind a colon alone."""
    assert {n for n, statement in enumerate(STATEMENTS, 1) if statement.instead_of} == RIVALS


@pytest.mark.parametrize(("name", "holds"), [("as the paper says", ("no", "yes")), ("the opposite", ("yes", "no"))])
def test_contradicting_sentences_get_opposite_verdicts(
    cases: dict[str, list[PaperCase]], name: str, holds: tuple[str, str]
) -> None:
    """Each comparison of the one is one of the other, too, and holds for one of both."""
    assert STATEMENTS[CONTRADICTS - 1].quote.startswith("The slip zone ratios are decreasing with decreasing layer")
    assert STATEMENTS[51].quote.startswith("For hard coating layers, the slip zone ratios are increasing with decreas")
    _, _, rows = comparisons_table(judged(STATEMENTS, cases[name]))
    one, other = ({row["cases"]: row["holds"] for row in rows if row["number"] == n} for n in (CONTRADICTS, 52))
    assert len(one) == 12
    assert {(held, other[pair]) for pair, held in one.items()} == {holds}
