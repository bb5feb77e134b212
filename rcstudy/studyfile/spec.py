"""Shape of a study file: pydantic models of every key, with what is allowed for each in words.

`validate` turns a positioned tree into a model and reports each error at its place in the file.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import cache
from typing import Annotated, Any, Literal, TypeVar, get_args, get_origin

from pydantic import BaseModel, BeforeValidator, ConfigDict, PlainValidator, StrictBool, ValidationError

from rcstudy.mechanics.scene import Coupling, Creepage, Discretisation, Method, Scene, Tolerance
from rcstudy.result import VARIABLES
from rcstudy.settings import LENGTH, MODULUS, unit_of
from rcstudy.studyfile.quantities import Passing, Quantity, Real, Relative, Whole, Words, between, positive, refusal
from rcstudy.studyfile.yamltree import (
    REFUSED,
    Node,
    Problems,
    child_path,
    closest,
    find,
    plain,
    suggest,
    with_entry,
    without,
)

MAX_LAYERS = 50
MAX_CELLS = 4096
MAX_TEXT = 20_000
MAX_NAME = 100  # of a study

# names used in a cube besides those of the variables; a grid of such a name would hide what is stored under it
_OWN_NAMES = (
    "grid",
    "entry",
    "label",
    "case",
    "case_key",
    "x",
    "y",
    "layer",
    "friction",
    "load",
    "hertz_radius",
    "hertz_pressure",
    "longitudinal",
    "lateral",
    "spin",
    "layer_modulus",
    "layer_nu",
    "layer_thickness",
)
RESERVED_NAMES = frozenset(VARIABLES) | frozenset(_OWN_NAMES)

_IDENTIFIER = re.compile(r"[A-Za-z][A-Za-z0-9_]*", re.ASCII)
_FILE_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]*", re.ASCII)


def _storable(text: str) -> bool:
    """True if `text` has no control characters (tab and line ends apart) and can be encoded."""
    return not any((ord(c) < 32 and c not in "\t\n\r") or 0xD800 <= ord(c) <= 0xDFFF or c == "\x7f" for c in text)


class _Pair:
    """Validator of two values along x and y; one that passes `single` is taken for both; `word` is read as None."""

    def __init__(self, allowed: str, single: Real | None = None, word: str | None = None) -> None:
        self.allowed, self._single, self._word = allowed, single, word

    def __call__(self, value: Any) -> Any:
        if isinstance(value, str) and value == self._word:
            return None
        if isinstance(value, list) and len(value) == 2:
            return value
        if self._single and not isinstance(value, list | dict):
            return [self._single(value)] * 2
        raise refusal(self.allowed)


class _WordOr:
    """Validator of a mapping, which the model takes, or of `word`, which is read as None."""

    def __init__(self, word: str, allowed: str) -> None:
        self.allowed, self._word = allowed, word

    def __call__(self, value: Any) -> Any:
        if value == self._word and isinstance(value, str):
            return None
        if not isinstance(value, dict):
            raise refusal(self.allowed)
        return value


def _filled(kind: type, allowed: str) -> Passing:
    """A mapping or a list that is not empty; what is in it is validated later, entry by entry."""
    return Passing(allowed, lambda value: isinstance(value, kind) and bool(value))


Modulus = Annotated[
    Quantity,
    PlainValidator(Relative(f"a number above 0, in {unit_of('E')}, or of the substrate's such as '2 Es'", MODULUS)),
]
Length = Annotated[
    Quantity,
    PlainValidator(
        Relative(f"a number above 0, in {unit_of('thickness')}, or of the Hertz radius such as '0.25 a'", LENGTH)
    ),
]
AbsoluteModulus = Annotated[float, PlainValidator(positive(f", in {unit_of('E')} ('Es' is this very modulus)"))]
PoissonRatio = Annotated[float, PlainValidator(between(0, 0.5))]
_NOT_RELATIVE = "('a' follows from it)"
_RADIUS_OR_TWO = f", in {unit_of('radius')}, or two [Rx, Ry]"
Radius = Annotated[float, PlainValidator(positive(f", in {unit_of('radius')} {_NOT_RELATIVE}"))]
Cells = Annotated[int, PlainValidator(Whole(4, MAX_CELLS))]
Slide = Annotated[float, PlainValidator(between(-1, 1, " (a plain ratio, not per cent)"))]
_SPIN_POINT = between(-0.5, 0.5, ", in cells; also a fraction such as 1/6", fractions=True)
Spin = Annotated[float, PlainValidator(between(-1000, 1000, f", in {unit_of('spin')}"))]
Fraction = Annotated[float, PlainValidator(positive(below=1))]
Text = Annotated[
    str, PlainValidator(Words(f"text of at most {MAX_TEXT} characters, none a control character", _storable, MAX_TEXT))
]
LayerCount = Annotated[int, PlainValidator(Whole(0, MAX_LAYERS))]


class Spec(BaseModel):
    """Base of all models: unknown keys are refused."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class SubstrateSpec(Spec):
    """Material of the substrate."""

    E: AbsoluteModulus
    nu: PoissonRatio


class MaterialSpec(Spec):
    """Material whose modulus may be relative to the substrate's."""

    E: Modulus
    nu: PoissonRatio


class LayerSpec(MaterialSpec):
    """One bonded layer."""

    thickness: Length


class CreepageSpec(Spec):
    """Creepages (-) and spin (rad/mm)."""

    longitudinal: Slide = Creepage.longitudinal
    lateral: Slide = Creepage.lateral
    spin: Spin = Creepage.spin


class MeshSpec(Spec):
    """Window and cells."""

    size: Annotated[
        tuple[Length, Length] | None,
        BeforeValidator(_Pair(f"auto or two lengths [x, y], in {unit_of('size')} or such as '8 a'", word="auto")),
    ]
    cells: Annotated[tuple[Cells, Cells], BeforeValidator(_Pair(f"two whole numbers [x, y] from 4 to {MAX_CELLS}"))]
    margin: Annotated[float, PlainValidator(between(1.05, 10))] = 1.25


class ToleranceSpec(Spec):
    """Stopping tolerances."""

    normal: Fraction = Tolerance.normal
    tangential: Fraction = Tolerance.tangential


class SceneSpec(Spec):
    """One rolling contact as written in a study."""

    substrate: SubstrateSpec
    layers: Annotated[
        tuple[LayerSpec, ...],
        BeforeValidator(
            Passing(
                f"a list of at most {MAX_LAYERS} layers {{E, nu, thickness}}, [] for none",
                lambda value: isinstance(value, list) and len(value) <= MAX_LAYERS,
            )
        ),
    ] = ()
    counterbody: Annotated[MaterialSpec | None, BeforeValidator(_WordOr("rigid", "rigid or {E, nu}"))] = None
    radius: Annotated[
        tuple[Radius, Radius],
        BeforeValidator(_Pair(positive(_RADIUS_OR_TWO).allowed, single=positive(f"{_RADIUS_OR_TWO} {_NOT_RELATIVE}"))),
    ]
    load: Annotated[float, PlainValidator(positive(f", in {unit_of('load')}"))]
    friction: Annotated[float, PlainValidator(positive())] = Scene.friction
    creepage: Annotated[
        CreepageSpec | None, BeforeValidator(_WordOr("none", "the word none, or {longitudinal, lateral, spin}"))
    ] = None
    mesh: MeshSpec
    coupling: Coupling = Scene.coupling
    method: Method = Scene.method
    discretisation: Discretisation = Scene.discretisation
    spin_point: Annotated[float, PlainValidator(_SPIN_POINT)] = Scene.spin_point
    tolerance: ToleranceSpec = ToleranceSpec()


class CoatingSpec(Spec):
    """Coating builder: `layer_count` layers of `thickness` each, with moduli in a constant ratio from layer to layer.

    With m = modulus/Es the layer next to the substrate has E = m Es, the one above it m^2 Es, and so on.
    `layer_nu` is the substrate's unless given.
    """

    layer_count: LayerCount = 1
    thickness: Length
    modulus: Modulus
    layer_nu: Annotated[float | None, PlainValidator(between(0, 0.5))] = None


class OutputsSpec(Spec):
    """What the cube holds: `fields` or scalars only; `precision` of stored fields.

    `crop`: fields of the whole window ("none"), or cut to the cells that any case of the grid touches ("contact").
    """

    fields: StrictBool = True
    crop: Literal["none", "contact"] = "none"
    precision: Literal["float64", "float32"] = "float64"


class GridSpec(Spec):
    """A named grid: a product of `axes` or a list of `cases`."""

    description: Text = ""
    scene: Annotated[
        dict[str, Any], PlainValidator(Passing("a mapping of scene keys", lambda value: isinstance(value, dict)))
    ] = {}
    coating: Annotated[
        dict[str, Any] | None, PlainValidator(_filled(dict, "a mapping of layer_count, thickness, modulus, layer_nu"))
    ] = None
    axes: Annotated[
        dict[str, Any] | None, PlainValidator(_filled(dict, "a mapping of at least one axis to its values"))
    ] = None
    cases: Annotated[list[Any] | None, PlainValidator(_filled(list, "a list of at least one case"))] = None


class StudySpec(Spec):
    """The whole file."""

    study: Annotated[
        str,
        PlainValidator(
            Words(
                f"a name of at most {MAX_NAME} letters, digits, '_', '-' and '.', the first a letter or digit",
                lambda v: bool(_FILE_NAME.fullmatch(v)),
                MAX_NAME,
            )
        ),
    ]
    description: Text = ""
    scene: Annotated[
        dict[str, Any], PlainValidator(Passing("a mapping of scene keys", lambda value: isinstance(value, dict)))
    ]
    outputs: OutputsSpec = OutputsSpec()
    grids: Annotated[dict[str, Any], PlainValidator(_filled(dict, "a mapping of at least one named grid"))]


Model = TypeVar("Model", bound=Spec)


def grid_name_problem(name: str) -> str:
    """What is wrong with `name` as the name of a grid; "" if nothing."""
    if not _IDENTIFIER.fullmatch(name) or len(name) > 64:
        return "a grid's name is at most 64 letters, digits and '_', the first a letter"
    if name in RESERVED_NAMES:
        variables = "those of its variables, such as pressure and force_x"
        return f"another name, as the cube has its own {name}; its names are {', '.join(_OWN_NAMES)} and {variables}"
    return ""


def label_problem(label: str) -> str:
    """What is wrong with `label` as the label of a case or axis value; "" if nothing."""
    if not label.isprintable() or not label.strip() or len(label) > 100:
        return "a label of 1 to 100 printable characters"
    return ""


@cache
def keys_of(model: type[Spec]) -> tuple[str, ...]:
    """The keys that `model` takes."""
    return tuple(model.model_fields)


@cache
def allowed_at(model: type[Spec], key: str) -> str:
    """What is allowed for `key` of `model`, in words."""
    info = model.model_fields[key]
    if info.annotation is bool:
        return "true or false"
    if get_origin(info.annotation) is Literal:
        return f"one of {', '.join(get_args(info.annotation))}"
    for mark in info.metadata:
        words = getattr(getattr(mark, "func", None), "allowed", "")
        if words:
            return str(words)
    for argument in (info.annotation, *get_args(info.annotation)):
        for mark in getattr(argument, "__metadata__", ()):
            if hasattr(mark, "func"):
                return str(mark.func.allowed)
    inner = submodel(model, key)
    return f"a mapping with keys {', '.join(keys_of(inner))}" if inner else "a value"


@cache
def submodel(model: type[Spec], key: str) -> type[Spec] | None:
    """The model of the value (or of the entries of the list) at `key` of `model`; None if it has none."""
    queue: list[Any] = [model.model_fields[key].annotation]
    while queue:
        kind = queue.pop()
        if isinstance(kind, type) and issubclass(kind, Spec):
            return kind
        queue.extend(get_args(kind))
    return None


def _model_at(model: type[Spec], location: Sequence[str | int]) -> tuple[type[Spec], str]:
    """The model that holds the last key of `location`, and that key."""
    key = ""
    for token in location:
        if isinstance(token, str):
            if key:
                model = submodel(model, key) or model
            key = token
    return model, key


def takes_relative(model: type[Spec], location: Sequence[str]) -> bool:
    """Whether the number at `location` of `model` may be a multiple of a scale."""
    owner, key = _model_at(model, location)
    return any(isinstance(getattr(mark, "func", None), Relative) for mark in owner.model_fields[key].metadata)


_OF_AXIS = re.compile(r"\.axes\.\w+\[\d+\]\.[^.]+$")  # path of a key in a value of an axis, which may have a label


def validate(
    model: type[Model],
    node: Node,
    problems: Problems,
    *,
    partial: bool = False,
    lacking: list[tuple[str | int, ...]] | None = None,
) -> Model | None:
    """`node` as `model`; None, with every error in `problems`, if it is not. `partial`: missing keys are no error.

    A key for which an unknown one stands, by its name, is not said to be missing, too. Where `lacking` is given, the
    locations (keys and indices) of missing keys are added to it instead of being reported.
    """
    if not node.is_mapping:
        problems.add(node, f"a mapping with keys {', '.join(keys_of(model))}")
        return None
    try:
        return model.model_validate(plain(node))
    except ValidationError as error:
        found = error.errors(include_url=False, include_input=False)
    unknown = {}
    for location in (one["loc"] for one in found if one["type"] == "extra_forbidden"):
        own = ("label",) if _OF_AXIS.search(find(node, location).path) else ()
        unknown[location] = _unknown(_model_at(model, location)[0], str(location[-1]), own)
    meant = {(*location[:-1], key) for location, (key, _) in unknown.items()}
    merged = {location[:-1] for location in unknown if location[-1] == "<<"}  # a merge key has whatever is missing
    for one in found:
        location = one["loc"]
        at = find(node, location)
        if location in unknown:
            problems.add(at.at_key(), unknown[location][1], value="unknown key")
        elif one["type"] == "missing":
            if partial or location in meant or location[:-1] in merged:
                continue
            if lacking is None:
                report_missing(model, node, location, problems)
            else:
                lacking.append(location)
        elif one["type"] == "allowed":
            problems.add(at, one["msg"] + _axis_hint(model, location, at))
        else:
            owner, key = _model_at(model, location)
            words = allowed_at(owner, key)
            if location and isinstance(location[-1], int) and (inner := submodel(owner, key)):
                words = f"a mapping with keys {', '.join(keys_of(inner))}"
            problems.add(at, words + _axis_hint(model, location, at))
    return None


def report_missing(model: type[Spec], node: Node, location: Sequence[str | int], problems: Problems) -> None:
    """Report that the tree `node` of a `model` lacks the key at `location` (keys and indices)."""
    at = find(node, location)
    owner, key = _model_at(model, location)
    problems.add(at.at_key(), allowed_at(owner, key), key=child_path(at.path, key), value="missing")


def lacks(node: Node, location: Sequence[str | int]) -> bool:
    """Whether `node` has the mapping that the last key of `location` belongs in, but not that key."""
    owner = find(node, location[:-1])
    return owner.is_mapping and (owner is not node or len(location) == 1) and location[-1] not in owner.value


def _unknown(model: type[Spec], word: str, own: Sequence[str]) -> tuple[str, str]:
    """The key that the unknown `word` stands for, "" if none is close, and what is allowed: keys of `model`, and `own`.

    It may be one of them with the colon that was forgotten.
    """
    keys = (*own, *keys_of(model))
    first, space, _ = word.partition(" ")
    if space and first in keys:
        return first, f"a ': ' is missing after {first}"
    head, _, inner = word.partition(".")
    if inner and head in keys and inner in _keys_inside(model, head):
        return head, f"did you mean {head}: {{{inner}: ...}}? {suggest('', keys)}"
    if model is SceneSpec and word in ("coating", *keys_of(CoatingSpec)):
        if "coating" in own:
            return "coating", f"did you mean coating: {{{word}: ...}}? {suggest('', keys)}"
        return "", f"a coating belongs to a grid or a case of its list, a scene has layers; {suggest('', keys)}"
    if model in (SubstrateSpec, MaterialSpec) and word == "layers":
        return "", f"layers are a key of the scene, they lie on the substrate; {suggest('', keys)}"
    if model is CreepageSpec and word == "label":  # close to lateral
        return "", f"a label belongs to values of an axis and to cases of a list; {suggest('', keys)}"
    return closest(word, keys), suggest(word, keys)


def _keys_inside(model: type[Spec], key: str) -> tuple[str, ...]:
    """The keys of the mapping at `key` of `model`, or of a case's coating; none if it is no mapping."""
    inner = CoatingSpec if key == "coating" else None if key == "layers" else submodel(model, key)
    return keys_of(inner) if inner else ()


def known_keys(node: Node, problems: Problems) -> Node:
    """The mapping `node`, a case of a list, without keys that no case has, which are reported.

    Those that they stand for are refused values in it: nothing is said of what such a case lacks, nor of its contact.
    """
    own = ("label", "coating")
    unknown = [key for key in node.value if key not in (*own, *keys_of(SceneSpec))]
    known = without(node, unknown)
    for key in unknown:
        at = node.value[key].at_key()
        meant, words = _unknown(SceneSpec, key, own)
        problems.add(at, words, value="unknown key")
        if meant and meant not in known.value:
            known = with_entry(known, (meant,), refused(at))
    return known


def refused(node: Node) -> Node:
    """A value that stands for `node`, of which enough is said."""
    return Node(REFUSED, node.path, "", node.line, node.column)


def by_meaning(model: type[Spec], node: Node) -> dict[str, Node]:
    """The entries of the mapping `node` by the keys of `model`, those of unknown keys by the keys they stand for.

    `validate` reports such unknown keys; what they hold is read all the same, so that all errors are found at once.
    """
    meant = {_unknown(model, word, ())[0]: value for word, value in node.value.items() if word not in keys_of(model)}
    return meant | node.value


def _axis_hint(model: type[Spec], location: Sequence[str | int], node: Node) -> str:
    """A hint that several values make an axis, where the refused `node` of a study's scene or coating is a list."""
    path = ".".join(map(str, location))
    # no hint for layers, which are a list, nor within the values of an axis of that name
    fits = node.is_list and len(node.value) > 1 and node.line and path != "layers" and not node.path.endswith("]")
    if not fits or model not in (SceneSpec, CoatingSpec) or any(isinstance(token, int) for token in location):
        return ""
    return f"; several values are given as an axis: axes: {{{path}: [...]}}"
