"""A tree of values each of which knows its line, column and dotted path; problems collected as they are found.

:mod:`rcstudy.studyfile.yamlfile` makes one from a file, `from_python` from a mapping.
"""

from __future__ import annotations

import difflib
import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

from rcstudy.errors import UserError

MAX_DEPTH = 32
MAX_REPORTED = 40


class OutOfRange(float):
    """Stands for a written number that floating point has not, too large or too close to zero: infinite, or zero."""


class _Refused:
    """Stands for a value that was reported already: nothing more is said about it."""


REFUSED = _Refused()


@dataclass(slots=True)
class Node:
    """One value: a dict of nodes, a list of nodes or a scalar; `text` is a scalar as written.

    Lines and columns count from 1; 0 means that the value did not come from a file. `path` is dotted, such as
    `scene.layers[0].nu`. `size` counts the values in it, itself included.
    """

    value: Any
    path: str = ""
    text: str = ""
    line: int = 0
    column: int = 0
    key_line: int = 0
    key_column: int = 0
    size: int = 1

    @property
    def is_mapping(self) -> bool:
        """True for a mapping of keys to values."""
        return isinstance(self.value, dict)

    @property
    def is_list(self) -> bool:
        """True for a list of values."""
        return isinstance(self.value, list)

    def place(self) -> str:
        """Where it stands, in words."""
        return f"line {self.line}, column {self.column}"

    def at_key(self) -> Node:
        """This node, located where its key stands rather than its value."""
        return Node(self.value, self.path, self.text, self.key_line or self.line, self.key_column or self.column)


@dataclass
class Problems:
    """Everything wrong with one input; `source` is the file's name, "" for a mapping given from Python."""

    source: str = ""
    found: dict[tuple[int, int, str, str, str], None] = field(default_factory=dict)

    def add(self, node: Node, allowed: str, *, key: str | None = None, value: str | None = None) -> None:
        """Report `node`: its position and path (or `key`), its value (or `value`), and what is allowed."""
        if node.value is REFUSED:
            return
        shown = show(node) if value is None else value
        self.found[(node.line, node.column, shorten(node.path if key is None else key), shown, allowed)] = None

    def at(self, line: int, column: int, key: str, value: str, allowed: str) -> None:
        """Report a place that has no node."""
        self.found[(line, column, shorten(key), value, allowed)] = None

    def check(self) -> None:
        """Raise UserError, one line a problem, in the order of the file; nothing if there is none."""
        if not self.found:
            return
        lines = []
        for line, column, key, value, allowed in sorted(self.found, key=lambda p: p[:2])[:MAX_REPORTED]:
            place = f"{self.source}:{line}:{column}" if line else self.source
            lines.append(": ".join(part for part in (place, key, value, allowed) if part))
        if len(self.found) > MAX_REPORTED:
            place = f"{self.source}: " if self.source else ""
            lines.append(f"{place}... and {len(self.found) - MAX_REPORTED} more errors")
        raise UserError("\n".join(lines))


def is_out_of_range(text: str, number: float) -> bool:
    """Whether `text` is a number that floating point has not, of which `number`, infinite or zero, was made."""
    digits = text.lower().partition("e")[0]
    return any(map(str.isdigit, digits)) if math.isinf(number) else number == 0.0 and bool(re.search("[1-9]", digits))


def shorten(text: str, width: int = 80) -> str:
    """`text` fit for one line of a message: escapes for what cannot be printed, the middle left out if long."""
    if not text.isprintable():
        text = ascii(text)[1:-1]
    return text if len(text) <= width else f"{text[: width - 23]} ... {text[-18:]}"


def show(node: Node) -> str:
    """The value of `node` in a message: a scalar as written, the start of anything larger."""
    if node.is_mapping:
        inside = ", ".join(f"{k}: {show(v) if v.size == 1 else '...'}" for k, v in list(node.value.items())[:6])
        return shorten(f"{{{inside}}}", 60)
    if node.is_list:
        return shorten(f"[{', '.join(show(v) if v.size == 1 else '...' for v in node.value[:6])}]", 60)
    text = shorten(node.text, 60)
    return f'"{text}"' if isinstance(node.value, str) and _needs_quotes(node.value) else text or "(nothing)"


def _needs_quotes(text: str) -> bool:
    """Whether `text` looks like a number, true, false or nothing, so that only quotes show that it is text."""
    if not text.strip() or text in ("true", "false"):
        return True
    if "_" in text or not any(map(str.isdigit, text)):  # 1_000, NaN: numbers to Python alone
        return False
    try:
        float(text)
    except ValueError:
        return False
    return True


@lru_cache(maxsize=4096)  # a misspelt key of the shared scene is met in every case
def closest(word: str, allowed: tuple[str, ...]) -> str:
    """The one of `allowed` that `word` is taken for; "" if none is close."""
    in_lower_case = {one.lower(): one for one in reversed(allowed)}
    close = difflib.get_close_matches(word.lower(), in_lower_case, n=1, cutoff=0.6)
    return in_lower_case[close[0]] if close else ""


def suggest(word: str, allowed: Iterable[str]) -> str:
    """What is allowed instead of `word`, the closest first if there is one close."""
    words = tuple(allowed)
    close = closest(word, words)
    hint = f"did you mean {close}? " if close else ""
    return f"{hint}allowed: {', '.join(words)}"


def child_path(path: str, key: str | int) -> str:
    """Dotted path of entry `key` of the value at `path`."""
    if isinstance(key, int):
        return f"{path}[{key}]"
    return f"{path}.{key}" if path else key


def plain(node: Node) -> Any:
    """The tree as plain dicts, lists and scalars."""
    if node.is_mapping:
        return {k: plain(v) for k, v in node.value.items()}
    if node.is_list:
        return [plain(v) for v in node.value]
    return node.value


def find(node: Node, location: Sequence[str | int]) -> Node:
    """The node at `location` (keys and indices), or the deepest one on the way that exists."""
    for token in location:
        inside = node.value
        within = (
            token in inside if isinstance(inside, dict) else isinstance(inside, list) and token in range(len(inside))
        )
        if not within:
            break
        node = inside[token]
    return node


def merge(base: Node, over: Node) -> Node:
    """`base` overridden key by key, at every depth, by `over`; just `over` unless both are mappings."""
    if not (base.is_mapping and over.is_mapping):
        return over
    merged = dict(base.value)
    for key, node in over.value.items():
        merged[key] = merge(merged[key], node) if key in merged else node
    return _with_value(over, merged)


def without(node: Node, keys: Iterable[str]) -> Node:
    """The mapping `node` without `keys`, at the same place."""
    drop = set(keys)
    return _with_value(node, {k: v for k, v in node.value.items() if k not in drop})


def with_entry(node: Node, path: Sequence[str], entry: Node) -> Node:
    """A copy of `node` with `entry` at the keys `path`; mappings missing on the way get the place of `entry`."""
    inside = dict(node.value) if node.is_mapping else {}
    head, *rest = path
    if rest:
        below = inside.get(head)
        if below is None or not below.is_mapping:
            below = Node({}, child_path(node.path, head), "", entry.line, entry.column)
        entry = with_entry(below, rest, entry)
    inside[head] = entry
    return _with_value(node, inside)


def _with_value(node: Node, value: dict[str, Node]) -> Node:
    size = 1 + sum(v.size for v in value.values())
    return Node(value, node.path, "", node.line, node.column, node.key_line, node.key_column, size)


def from_python(value: Any, path: str = "", depth: int = 0) -> Node:
    """A mapping given from Python as a tree; NumPy scalars and arrays and tuples are taken as numbers and lists.

    UserError if it is nested more than MAX_DEPTH deep.
    """
    if depth > MAX_DEPTH:
        raise UserError(f"{shorten(path)}: nested more than {MAX_DEPTH} deep")
    if isinstance(value, Mapping):
        inside = {str(k): from_python(v, child_path(path, str(k)), depth + 1) for k, v in value.items()}
        return Node(inside, path, size=1 + sum(n.size for n in inside.values()))
    if hasattr(value, "tolist"):  # NumPy array or scalar
        value = value.tolist()
    if isinstance(value, list | tuple):
        items = [from_python(v, child_path(path, i), depth + 1) for i, v in enumerate(value)]
        return Node(items, path, size=1 + sum(n.size for n in items))
    return Node(value, path, value if isinstance(value, str) else repr(value))
