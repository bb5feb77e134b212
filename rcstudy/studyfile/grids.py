"""Reading of a study's grids: they are expanded to trees whose nodes keep their place in the file, and validated.

Each value of an axis is validated within a complete scene, all other axes at their first value. Then every combination
that can make a difference is built and its window checked, so that errors are found here and not during the sweep.
"""

from __future__ import annotations

import itertools
import math
from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from rcstudy.settings import LENGTH
from rcstudy.studyfile.axis_labels import default_label
from rcstudy.studyfile.build import (
    BOTH_COATINGS,
    COATING_KEYS,
    BuildError,
    Parts,
    build,
    keys_to,
    part,
    parts_of,
    scene_hertz,
    window_problem,
)
from rcstudy.studyfile.grid_plan import AxisPlan, GridPlan
from rcstudy.studyfile.quantities import Quantity
from rcstudy.studyfile.ranges import spread
from rcstudy.studyfile.spec import (
    CoatingSpec,
    GridSpec,
    SceneSpec,
    by_meaning,
    known_keys,
    label_problem,
    lacks,
    refused,
    report_missing,
    submodel,
    takes_relative,
    validate,
)
from rcstudy.studyfile.yamltree import (
    Node,
    Problems,
    child_path,
    closest,
    find,
    merge,
    show,
    suggest,
    with_entry,
    without,
)

MAX_AXES = 16  # of one grid: HDF5 allows 32 dimensions
# errors in combinations of values that are valid one by one: how many of one grid are reported, and at most counted
_MAX_CASE_PROBLEMS, _MAX_COUNTED = 5, 10_000

# keys whose value is a mapping or list, so that an axis over them needs labels
_LABELLED = ("creepage", "counterbody", "substrate", "mesh", "tolerance", "layers")
# keys whose value is not a single real number, so that an axis over them cannot be given as a range
_NO_RANGE = (*_LABELLED, "layer_count", "coupling", "method", "discretisation", "mesh.size", "mesh.cells")
# axes that matter neither to the size of the contact nor to how a scene is built
_HARMLESS = ("creepage", "friction", "spin_point", "tolerance")
_HERTZ = ("substrate", "counterbody", "radius", "load")  # axes that the uncoated contact depends on
_LAYERED = ("layers", *COATING_KEYS)  # those that only a contact with layers depends on


def _axis_paths() -> tuple[str, ...]:
    paths = list(COATING_KEYS)
    for name in SceneSpec.model_fields:
        paths.append(name)
        inner = submodel(SceneSpec, name)
        if inner is not None and name != "layers":
            paths.extend(f"{name}.{key}" for key in inner.model_fields)
    return tuple(paths)


AXIS_PATHS = _axis_paths()


@dataclass
class _Entry:
    """One value of an axis: its label ("" if it has none of its own), where it stands, and its tree."""

    label: str
    place: Node
    value: Node


class GridReader:
    """Reads one grid: expands it to trees whose nodes keep their place in the file, and validates these."""

    def __init__(self, name: str, node: Node, shared: Node, problems: Problems) -> None:
        self.name, self.node, self.problems = name, node, problems
        inside = by_meaning(GridSpec, node) if node.is_mapping else {}
        over = inside.get("scene")
        over = over if over is not None and over.is_mapping else None
        self.scene = merge(shared, over) if over is not None else shared
        self.coating: Node | None = inside.get("coating")
        self._beside_coating = self.coating is not None and over is not None and "layers" in over.value
        self.axes: Node | None = self._with_ranges(inside.get("axes"))
        self.cases: Node | None = inside.get("cases")
        self.lacking: list[tuple[str | int, ...]] = []  # locations of what its scene lacks, and every case
        self.trees = 0  # of scenes that were validated
        self._lacks: dict[tuple[str | int, ...], list[Node]] = {}  # those that lack a key, by its location
        self._unsuitable: set[tuple[Any, ...]] = set()  # meshes that were reported, with the reason

    def _with_ranges(self, axes: Node | None) -> Node | None:
        """`axes` with every range {first, last, count, spacing} replaced by the list of its values."""
        if axes is None or not axes.is_mapping:
            return axes
        ranged = {
            path: spread(
                node,
                self.problems,
                plain=not takes_relative(CoatingSpec if path in COATING_KEYS else SceneSpec, path.split(".")),
            )
            for path, node in axes.value.items()
            if node.is_mapping and node.value and path in AXIS_PATHS and path not in _NO_RANGE
        }
        return merge(axes, replace(axes, value=ranged)) if ranged else axes

    def count(self) -> int:
        """Number of cases as written."""
        if self.axes is not None and self.axes.is_mapping:
            return math.prod(len(axis.value) for axis in self.axes.value.values() if axis.is_list)
        return len(self.cases.value) if self.cases is not None and self.cases.is_list else 0

    def read(self) -> GridPlan | None:
        """The grid; None if it is not valid, with its errors among the problems, `lacking` apart."""
        before = len(self.problems.found)
        spec = validate(GridSpec, self.node, self.problems)
        # also by themselves: settings that an axis overrides must be valid too
        for model, key in ((SceneSpec, "scene"), (CoatingSpec, "coating")):
            given = self.node.value.get(key) if self.node.is_mapping else None
            if given is not None and given.is_mapping:
                validate(model, given, self.problems, partial=True)
        if self.node.is_mapping and (self.axes is None) == (self.cases is None):
            both = "both axes and cases" if self.axes is not None else "neither axes nor cases"
            self.problems.add(self.node.at_key(), "exactly one of axes and cases", value=both)
            return None
        plan = None
        sound = self.coating is None or (self.coating.is_mapping and self.coating.value)  # else each case told of it
        if sound and self.axes is not None and self.axes.is_mapping and self.axes.value:
            plan = self._product(spec)
        elif sound and self.cases is not None and self.cases.is_list:
            plan = self._list(spec)
        self._tell_lacks()
        return plan if len(self.problems.found) == before else None

    def _tell_lacks(self) -> None:
        """Report keys that scenes of the grid lack, but for those that its own scene lacks and no case gives."""
        for location, trees in self._lacks.items():
            if len(trees) == self.trees and lacks(self.scene, location):
                self.lacking.append(location)
                continue
            # a mapping that several values of an axis are put into is one place
            for tree in {find(tree, location).path: tree for tree in reversed(trees)}.values():
                report_missing(SceneSpec, tree, location, self.problems)

    def _parts(self, scene: Node, coating: Node | None, *, both: bool = False) -> Parts | None:
        """Validated settings of one expanded tree. `both`: layers are given beside a coating, even if they are none."""
        lacking: list[tuple[str | int, ...]] = []
        valid = validate(SceneSpec, scene, self.problems, lacking=lacking)
        self.trees += 1
        for location in lacking:
            self._lacks.setdefault(location, []).append(scene)
        coated = None
        if coating is not None:
            layers = scene.value.get("layers") if scene.is_mapping else None
            both |= layers is not None and layers.is_list and (self._beside_coating or bool(layers.value))
            both |= self.axes is not None and self.axes.is_mapping and "layers" in self.axes.value
            # beside layers it is of no interest what the coating lacks
            coated = validate(CoatingSpec, coating, self.problems, partial=both)
            if both and (coated is None or not (layers and layers.value)):  # else `build` finds it
                self.problems.add(coating.at_key(), BOTH_COATINGS, value="")
        if valid is None or (coating is not None and coated is None):
            return None
        return parts_of(valid, coated)

    # explicit lists

    def _list(self, spec: GridSpec | None) -> GridPlan | None:
        assert self.cases is not None
        seen: dict[str, Node] = {}
        labels: list[str] = []
        values: list[Parts] = []
        for case in self.cases.value:
            if not case.is_mapping:
                self.problems.add(case, "a mapping of a label and scene keys")
                continue
            node = known_keys(case, self.problems)
            label = self._label(node, seen, required=True)
            scene = merge(self.scene, without(node, ("label", "coating")))
            own, layers = node.value.get("coating"), node.value.get("layers")
            bare = layers is not None and layers.value == []  # without layers, whatever coating the grid has
            coating = own if self.coating is None else self.coating if own is None else merge(self.coating, own)
            parts = self._parts(scene, None if bare and own is None else coating, both=bare)
            if parts is None or label is None:
                continue
            words = {what: [label] for what in ("uncoated", "mesh")}
            for reason in self._check_case(parts, scene, words, node.value, self.problems):
                self.problems.add(node, reason + _in_case([label]), value="")
            labels.append(label)
            values.append(parts)
        if spec is None or len(values) < len(self.cases.value):
            return None
        axis = AxisPlan("case", "case", tuple(labels), tuple(values))
        return GridPlan(self.name, spec.description, (axis,), {})

    def _label(self, node: Node, seen: dict[str, Node], *, required: bool) -> str | None:
        """The label of the mapping `node`: None if it is not valid, "" if there is none and none is required."""
        given = node.value.get("label")
        if given is None:
            if required:
                self.problems.add(node, label_problem(""), key=child_path(node.path, "label"), value="missing")
                return None
            return ""
        # a label that is a number, such as 0.002, is taken as it was written
        label = given.text if isinstance(given.value, str | int | float) and not isinstance(given.value, bool) else ""
        if reason := label_problem(label):
            self.problems.add(given, reason)
            return None
        if label in seen:
            there = _place(seen[label], given)
            self.problems.add(given, f"must be a label of its own; this one stands at {there} already")
            return None
        seen[label] = given
        return label

    # products

    def _product(self, spec: GridSpec | None) -> GridPlan | None:
        assert self.axes is not None
        known: dict[str, Node] = {}
        meant: dict[str, _Entry] = {}  # by axes that are refused: nothing is said of what the scene lacks of them
        for path, node in self.axes.value.items():
            if path not in AXIS_PATHS:
                self.problems.add(node.at_key(), suggest(path, AXIS_PATHS), value="unknown axis")
                meant[closest(path, AXIS_PATHS)] = _Entry("", node, refused(node))
            elif not node.is_list or not node.value:
                more = "" if path in _NO_RANGE else ", or {first, last, count, spacing}"
                self.problems.add(node, f"{_inner_axes(path, node)}a list of at least one value{more}")
                meant[path] = _Entry("", node, refused(node))
            else:
                known[path] = node
        for path in self._overlapping(known):
            del known[path]  # else its values, set by the other axis too, would be reported as equal to each other
        entries = {path: self._entries(path, node) for path, node in known.items()}
        firsts = {path: found[0] for path, found in entries.items() if found}
        # not beside what stands there already: with a refused value all other axes would go unchecked
        firsts |= {path: one for path, one in meant.items() if path and path not in known and not self._gives(path)}
        base = self._expanded(firsts)
        axes = []
        for path, found in entries.items():
            axis = self._axis(path, known[path], found, firsts)
            if axis is not None:
                axes.append(axis)
        if spec is None or base is None or len(axes) < len(self.axes.value):
            return None
        plan = GridPlan(self.name, spec.description, tuple(axes), base)
        self._check_product(plan, entries)
        return plan

    def _gives(self, path: str) -> bool:
        """Whether the grid's own scene or coating has a value where the axis `path` puts its values."""
        head, *rest = keys_to(path)
        place, keys = (self.coating, rest) if head == "coating" else (self.scene, [head, *rest])
        for key in keys:
            place = place.value.get(key) if place is not None and place.is_mapping else None
        return place is not None

    def _overlapping(self, axes: Mapping[str, Node]) -> set[str]:
        """The axes that set a part of what another axis sets, and those of a coating beside an axis of layers.

        Reports these and other axes that exclude each other.
        """
        assert self.axes is not None
        found = set()
        if len(axes) > MAX_AXES:
            self.problems.add(self.axes.at_key(), f"at most {MAX_AXES} axes in a grid", value=f"{len(axes)} axes")
        for one, other in itertools.combinations(axes, 2):
            place = axes[other].at_key()
            keys, others = keys_to(one), keys_to(other)
            if keys[: len(others)] == others or others[: len(keys)] == keys:
                self.problems.add(place, f"two axes may not set the same key; axis {one} already sets it", value="axis")
                found.add(max(one, other, key=lambda path: len(keys_to(path))))
            elif one.split(".")[-1] == other.split(".")[-1]:
                name = one.split(".")[-1]
                self.problems.add(
                    place, f"two axes may not have the same name; axis {one} is already named {name}", value="axis"
                )
            elif "layers" in (one, other) and (one in COATING_KEYS or other in COATING_KEYS):
                self.problems.add(place, "either layers or a coating (layer_count, thickness, ...)", value="axis")
                found.add(one if one in COATING_KEYS else other)
        return found

    def _entries(self, path: str, node: Node) -> list[_Entry]:
        """The values of an axis, with labels where the file gives them; invalid ones are reported and left out."""
        entries = []
        seen: dict[str, Node] = {}
        for entry in node.value:
            label: str | None = ""
            value = entry
            if path in _LABELLED and entry.is_mapping:
                label = self._label(entry, seen, required=False)
                value = without(entry, ("label",))
                if path == "layers":
                    if set(value.value) != {"layers"}:
                        self.problems.add(entry, "a list of layers, or {label, layers}")
                        continue
                    value = value.value["layers"]
            elif path == "creepage":
                self.problems.add(entry, "{label, longitudinal, lateral, spin}; use a separate grid for pressure only")
                continue
            if label is not None:
                entries.append(_Entry(label, entry, value))
        return entries

    def _expanded(self, chosen: Mapping[str, _Entry]) -> Parts | None:
        """Validated settings of the case with the values `chosen` of the axes, by path; None if they are not valid."""
        scene, coating = self.scene, self.coating
        for path, entry in chosen.items():
            keys = keys_to(path)
            if keys[0] != "coating":
                scene = with_entry(scene, keys, entry.value)
                continue
            if coating is None:
                place = self.axes.at_key() if self.axes is not None else self.node
                coating = Node({}, child_path(self.node.path, "coating"), "", place.line, place.column)
            coating = with_entry(coating, keys[1:], entry.value)
        return self._parts(scene, coating)

    def _axis(self, path: str, node: Node, entries: list[_Entry], firsts: Mapping[str, _Entry]) -> AxisPlan | None:
        labels: list[str] = []
        values: list[Any] = []
        seen_values: dict[str, Node] = {}
        seen_labels: dict[str, Node] = {}
        for i, entry in enumerate(entries):
            parts = self._expanded({**firsts, path: entry})
            if parts is None:
                continue
            value = part(parts, path)
            # the words rigid and auto are read as None: the word itself becomes the label
            label = entry.label or (entry.value.text if value is None else default_label(value, i))
            first = seen_values.setdefault(_identity(value, parts), entry.place)
            if first is not entry.place:
                there = _place(first, entry.place)
                self.problems.add(entry.place, f"must be a value of its own; the one at {there} is the same")
                continue
            first = seen_labels.setdefault(label, entry.place)
            if first is not entry.place:
                there = _place(first, entry.place)
                self.problems.add(entry.place, f"must be a label of its own; the entry at {there} is {label} too")
                continue
            labels.append(label)
            values.append(value)
        if len(values) < len(node.value):
            return None
        return AxisPlan(path, path.split(".")[-1], tuple(labels), tuple(values))

    def _check_product(self, plan: GridPlan, entries: Mapping[str, list[_Entry]]) -> None:
        """Build every case, harmless axes at their first value, and check that its window holds the contact."""
        found, unbuilt = Problems(), Problems()
        reasons: dict[str, dict[tuple[int | None, ...], None]] = {}  # why cases cannot be built: their indices
        heads = [axis.path.split(".")[0] for axis in plan.axes]
        matters = [head not in _HARMLESS for head in heads]
        at_least = ""
        ranges = [range(n if used else 1) for n, used in zip(plan.shape, matters, strict=True)]
        for index in itertools.product(*ranges):
            if len(found.found) + sum(map(len, reasons.values())) >= _MAX_COUNTED:
                at_least = "at least "
                break
            mesh = self.scene
            words: dict[str, list[str]] = {"uncoated": [], "mesh": []}
            for axis, head, i, used in zip(plan.axes, heads, index, matters, strict=True):
                if used and head != "mesh":
                    word = f"{axis.name}={axis.labels[i]}"
                    if head in _HERTZ:
                        words["uncoated"].append(word)
                    if head in _HERTZ + _LAYERED:
                        words["mesh"].append(word)
                if head == "mesh":
                    mesh = with_entry(mesh, axis.path.split("."), entries[axis.path][i].value)
            named = tuple(
                i if used and head != "mesh" else None for i, head, used in zip(index, heads, matters, strict=True)
            )
            for reason in self._check_case(plan.parts(index), mesh, words, heads, found):
                reasons.setdefault(reason, {})[named] = None
        for reason, cases in reasons.items():
            for case in _merged(cases, plan.shape):
                values = [
                    f"{axis.name}={axis.labels[i]}" for axis, i in zip(plan.axes, case, strict=True) if i is not None
                ]
                unbuilt.add(self.node.at_key(), reason + _in_case(values), value="")
        every = list(unbuilt.found | found.found)
        shown = every[:_MAX_CASE_PROBLEMS]
        self.problems.found.update(dict.fromkeys(shown))
        if more := len(every) - len(shown):
            line, column = max(problem[:2] for problem in shown)  # problems are sorted by place: this comes last
            self.problems.at(
                line, column, self.node.path, "", f"... and {at_least}{more} more errors in cases of this grid"
            )

    def _check_case(
        self,
        parts: Parts,
        scene: Node,
        words: Mapping[str, list[str]],
        varied: Collection[str],
        problems: Problems,
    ) -> list[str]:
        """Why the case cannot be built; reports a mesh in the tree `scene` that does not suit the contact.

        `words` name the case of a product in messages, by the values that affect the size of its contact, with layers
        ("mesh") or without ("uncoated"). `varied`: keys of the scene that differ from case to case. Conflicts of other
        keys are reported once, where the keys stand in the file, and so is a mesh that is unsuitable for the same
        reason in several cases that differ in their layers alone.
        """
        try:
            built = build(parts)
            key, reason = window_problem(parts, built)
        except BuildError as error:
            if not error.conflicts:
                return [str(error)]
            varying = [key for key in error.conflicts if {"method", key} & set(varied)]
            for key, reason in error.conflicts.items():
                if key not in varying:
                    problems.add(find(scene, (key,)), reason)
            return [error.conflicts[key] for key in varying]
        if reason:
            node = find(scene, ("mesh", key))
            problem = (node.line, node.column, reason, *words["uncoated"])
            if problem not in self._unsuitable:
                self._unsuitable.add(problem)
                problems.add(node, reason + _in_case(words["mesh" if built.layers else "uncoated"]))
        return []


def _in_case(words: Sequence[str]) -> str:
    """Text that names a case by `words`, to follow a reason; "" if there are none."""
    return f" (case {', '.join(words)})" if words else ""


def _merged(cases: Collection[tuple[int | None, ...]], shape: Sequence[int]) -> Collection[tuple[int | None, ...]]:
    """Indices of `cases` in a product of this `shape`, with None for axes that make no difference to which they are.

    Axes of one value keep it, as nothing shows whether it matters.
    """
    for k, count in enumerate(shape):
        others = Counter((*case[:k], None, *case[k + 1 :]) for case in cases)
        if count > 1 and set(others.values()) == {count}:
            cases = others
    return cases


def _inner_axes(path: str, node: Node) -> str:
    """A hint at axes of their own for keys that have several values in the mapping `node`, given as the axis `path`."""
    inside = {child_path(path, key): value for key, value in node.value.items()} if node.is_mapping else {}
    axes = [
        f"{inner}: {show(value)}"
        for inner, value in inside.items()
        # a list of two may be a single value of the axis
        if inner in AXIS_PATHS
        and (value.is_mapping or (value.is_list and (inner not in _NO_RANGE or any(v.is_list for v in value.value))))
    ]
    own = "an axis of its own" if len(axes) == 1 else "axes of their own"
    return f"did you mean {', '.join(axes)}, {own}? allowed: " if axes else ""


def _place(first: Node, other: Node) -> str:
    """Where `first` stands, in words: its path if `other` has the same place in the text, as aliases have."""
    return first.path if (first.line, first.column) == (other.line, other.column) else first.place()


def _identity(value: Any, parts: Parts) -> str:
    """Text that identifies a value among those of its axis; relative quantities are converted to absolute ones."""
    if isinstance(value, Quantity) and value.scale:
        try:
            scene = build(parts)
        except BuildError:
            return repr(value)
        return repr(Quantity(value.resolve(scene_hertz(scene).radius if value.scale == LENGTH else scene.substrate.E)))
    return repr(value)
