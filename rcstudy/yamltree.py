"""YAML text as a tree in which every value knows its line, column and dotted path; problems collected as they come.

Loads data only: the tree is built from ruamel.yaml's parser events, so no tag ever constructs an object. Tags, further
documents, duplicate keys, self-containing aliases, and aliases, values, nesting or files beyond a bound are refused.
"""

from __future__ import annotations

import difflib
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from rcstudy.errors import UserError

MAX_BYTES = 4_000_000
MAX_DEPTH = 32
MAX_ALIASED = 100_000  # values that aliases may add, in all
MAX_VALUES = 250_000  # written in a file; reading so many takes half a minute
MAX_REPORTED = 40

_CORE = "tag:yaml.org,2002:"


class _Refused:
    """Stands for a value that was reported already: nothing more is said about it."""

    def __repr__(self) -> str:
        return "<refused>"


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
    text = shorten(node.text, 60) or "(nothing)"
    return f'"{text}"' if isinstance(node.value, str) and _needs_quotes(node.value) else text


def _needs_quotes(text: str) -> bool:
    """Whether `text` looks like a number, true or false, so that only its quotes tell that it is none."""
    if text in ("true", "false"):
        return True
    try:
        float(text)
    except ValueError:
        return False
    return True


def suggest(word: str, allowed: Iterable[str]) -> str:
    """What is allowed instead of `word`, the closest first if there is one close."""
    words = list(allowed)
    close = difflib.get_close_matches(word, words, n=1, cutoff=0.6)
    hint = f"did you mean {close[0]}? " if close else ""
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
    """`base` overridden key by key, at every depth, by `over`; anything but two mappings: `over`."""
    if not (base.is_mapping and over.is_mapping):
        return over
    merged = dict(base.value)
    for key, node in over.value.items():
        merged[key] = merge(merged[key], node) if key in merged else node
    return _with_value(over, merged)


def without(node: Node, keys: Iterable[str]) -> Node:
    """The mapping `node` less `keys`, at the same place."""
    drop = set(keys)
    return _with_value(node, {k: v for k, v in node.value.items() if k not in drop})


def with_entry(node: Node, path: Sequence[str], entry: Node) -> Node:
    """`node` with `entry` put at the keys `path`; mappings missing on the way arise at the place of `entry`."""
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
    """A mapping given from Python as a tree; NumPy scalars and arrays and tuples are taken as numbers and lists."""
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


def read_text(path: str | Path) -> str:
    """The text of the file `path`; UserError if it is missing, unreadable, too large or not UTF-8."""
    source = Path(path)
    try:
        with source.open("rb") as stream:
            data = stream.read(MAX_BYTES + 1)
    except (OSError, ValueError) as error:  # ValueError: a name with a NUL
        reason = getattr(error, "strerror", None) or str(error)
        raise UserError(f"{shorten(str(path), 400)}: cannot be read: {reason}") from error
    if len(data) > MAX_BYTES:
        raise UserError(f"{path}: larger than {MAX_BYTES // 1_000_000} MB, the most a study file may be")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        before = data[: error.start]
        line = before.count(b"\n") + 1
        column = len(before.rsplit(b"\n", 1)[-1].decode("utf-8", "replace")) + 1
        raise UserError(
            f"{path}:{line}:{column}: byte 0x{data[error.start]:02x}: the file must be UTF-8 text"
        ) from error


def parse(text: str, problems: Problems, whole: str = "a study: keys study, scene and grids") -> Node:
    """The tree of the one document in `text`; `whole` says what is allowed where there is none.

    Values that cannot be taken (tags, duplicate keys) go to `problems` and the rest is still read; UserError for text
    that is not YAML at all, empty, more than one document, or beyond the bounds above.
    """
    from ruamel.yaml import YAML
    from ruamel.yaml.error import MarkedYAMLError
    from ruamel.yaml.reader import ReaderError

    loader = YAML(typ="safe", pure=True)
    builder = _Builder(loader.resolver, problems)
    try:
        for event in loader.parse(text):
            builder.take(event)
    except UserError:
        raise
    except MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        line, column = (mark.line + 1, mark.column + 1) if mark else (1, 1)
        said = ", ".join(part for part in (error.context, error.problem) if part)
        problems.at(line, column, "not YAML", "", shorten(said, 200))
    except ReaderError as error:
        before = text[: error.position]
        line, column = before.count("\n") + 1, len(before.rsplit("\n", 1)[-1]) + 1
        problems.at(line, column, "not YAML", f"character {error.character!r}", "printable characters")
    except Exception as error:
        # the parser raises all kinds of errors on hostile text (OverflowError on "\UFFFFFFFF", say); it only ever
        # reads, so whatever it is, the text is at fault
        problems.at(1, 1, "not YAML", "", shorten(f"{type(error).__name__}: {error}", 200))
    if builder.root is None:
        if not problems.found:
            problems.at(1, 1, "the file is empty", "", whole)
        problems.check()
        raise AssertionError("unreachable: check() raised")
    return builder.root


class _Builder:
    """Builds the tree from the parser's events, without recursion, so that no nesting can exhaust the stack."""

    def __init__(self, resolver: Any, problems: Problems) -> None:
        from ruamel.yaml import events, nodes

        self._events, self._scalar_node = events, nodes.ScalarNode
        self._resolver, self._problems = resolver, problems
        self._open: list[Node] = []
        self._keys: list[tuple[str, int, int] | None] = []  # of each open mapping: the key awaiting its value
        self._anchors: dict[str, Node] = {}
        self._open_anchors: dict[str, int] = {}
        self._aliased = 0
        self._values = 0
        self._documents = 0
        self.root: Node | None = None

    def take(self, event: Any) -> None:
        """Take the next event."""
        kinds = self._events
        if isinstance(event, kinds.ScalarEvent | kinds.AliasEvent | kinds.CollectionStartEvent):
            line, column = event.start_mark.line + 1, event.start_mark.column + 1
            self._values += 1
            if self._values > MAX_VALUES:
                self._fatal(line, column, "", "too long", f"at most {MAX_VALUES} keys and values in a file")
            if self._awaits_key():
                self._take_key(event, line, column)
                return
            node = self._node(event, line, column)
            if isinstance(event, kinds.CollectionStartEvent):
                self._start(event, node)
            else:
                self._attach(node)
        elif isinstance(event, kinds.CollectionEndEvent):
            self._end()
        elif isinstance(event, kinds.DocumentStartEvent):
            self._documents += 1
            line, column = event.start_mark.line + 1, event.start_mark.column + 1
            if self._documents > 1:
                self._fatal(line, column, "", "second document", "one document a file")
            if event.version not in (None, (1, 2)):
                self._fatal(line, column, "", "%YAML directive", "YAML 1.2, or no directive")

    def _fatal(self, line: int, column: int, key: str, value: str, allowed: str) -> None:
        self._problems.at(line, column, key, value, allowed)
        self._problems.check()

    def _awaits_key(self) -> bool:
        return bool(self._open) and self._open[-1].is_mapping and self._keys[-1] is None

    def _path(self) -> str:
        """Path of the value that comes next."""
        if not self._open:
            return ""
        parent = self._open[-1]
        if parent.is_list:
            return child_path(parent.path, len(parent.value))
        key = self._keys[-1]
        return child_path(parent.path, key[0] if key else "")

    def _take_key(self, event: Any, line: int, column: int) -> None:
        parent = self._open[-1]
        if not isinstance(event, self._events.ScalarEvent):
            self._fatal(line, column, parent.path, "an alias, list or mapping as key", "a key is a word")
        word = event.value
        if event.ctag is not None or self._tag(event) not in ("str", "timestamp", "value"):
            problem = "a key is a word"
            if self._tag(event) == "merge":
                problem = "merge keys are not part of YAML 1.2; a grid takes over the shared scene by itself"
            self._problems.at(line, column, child_path(parent.path, word), "", problem)
        elif word in parent.value:
            first = parent.value[word]
            problem = f"given twice, first at line {first.key_line}, column {first.key_column}"
            self._problems.at(line, column, child_path(parent.path, word), "", problem)
        self._keys[-1] = (word, line, column)

    def _tag(self, event: Any) -> str:
        return str(self._resolver.resolve(self._scalar_node, event.value, event.implicit)).removeprefix(_CORE)

    def _node(self, event: Any, line: int, column: int) -> Node:
        kinds = self._events
        path = self._path()
        if isinstance(event, kinds.AliasEvent):
            return self._alias(event.anchor, path, line, column)
        if event.ctag is not None:
            tag = shorten(str(event.ctag).replace(_CORE, "!!"))
            self._problems.at(line, column, path, tag, "a plain value: tags are not allowed")
            if isinstance(event, kinds.ScalarEvent):
                return Node(REFUSED, path, "", line, column)
        if isinstance(event, kinds.MappingStartEvent):
            return Node({}, path, "", line, column)
        if isinstance(event, kinds.SequenceStartEvent):
            return Node([], path, "", line, column)
        if event.value == "" and event.style is None and (key := self._keys[-1] if self._keys else None) is not None:
            _, line, column = key  # what is not there has no place of its own
        node = Node(self._scalar(event), path, event.value, line, column)
        if event.anchor:
            self._anchors[event.anchor] = node
            self._open_anchors.pop(event.anchor, None)
        return node

    def _scalar(self, event: Any) -> Any:
        tag, text = self._tag(event), event.value
        bare = text.replace("_", "").lower()
        if tag == "int":
            try:
                return int(bare, 0) if bare.lstrip("+-")[:2] in ("0x", "0o", "0b") else int(bare)
            except ValueError:  # more digits than Python converts
                return math.inf
        if tag == "float":
            return float(bare.replace(".inf", "inf").replace(".nan", "nan"))
        if tag == "bool":
            return bare == "true"
        if tag == "null":
            return None
        return text

    def _alias(self, anchor: str, path: str, line: int, column: int) -> Node:
        if anchor in self._open_anchors:
            self._problems.at(line, column, path, f"*{anchor}", "an alias cannot stand inside its own anchor")
            return Node(REFUSED, path, "", line, column)
        target = self._anchors.get(anchor)
        if target is None:
            self._problems.at(line, column, path, f"*{anchor}", f"no anchor &{anchor} stands before it")
            return Node(REFUSED, path, "", line, column)
        self._aliased += target.size
        if self._aliased > MAX_ALIASED:
            self._fatal(line, column, path, f"*{anchor}", f"aliases may add {MAX_ALIASED} values in all, no more")
        if _depth(target) + len(self._open) > MAX_DEPTH:
            self._fatal(line, column, path, f"*{anchor}", f"nesting at most {MAX_DEPTH} deep")
        return _relocate(target, path)

    def _start(self, event: Any, node: Node) -> None:
        if len(self._open) >= MAX_DEPTH:
            self._fatal(node.line, node.column, "", "nesting", f"at most {MAX_DEPTH} deep")
        if event.anchor:
            self._open_anchors[event.anchor] = len(self._open)
        self._open.append(node)
        self._keys.append(None)

    def _end(self) -> None:
        node = self._open.pop()
        self._keys.pop()
        depth = len(self._open)
        closing = [name for name, level in self._open_anchors.items() if level == depth]
        for name in closing:
            del self._open_anchors[name]
            self._anchors[name] = node
        self._attach(node)

    def _attach(self, node: Node) -> None:
        if not self._open:
            self.root = node
            return
        parent = self._open[-1]
        parent.size += node.size
        if parent.is_list:
            parent.value.append(node)
            return
        key = self._keys[-1]
        self._keys[-1] = None
        if key is not None:
            name, node.key_line, node.key_column = key
            parent.value.setdefault(name, node)


def _depth(node: Node) -> int:
    if node.is_mapping:
        return 1 + max((_depth(v) for v in node.value.values()), default=0)
    if node.is_list:
        return 1 + max((_depth(v) for v in node.value), default=0)
    return 0


def _relocate(node: Node, path: str) -> Node:
    """A copy of `node` for another place in the tree; line and column stay those of the text."""
    value = node.value
    if node.is_mapping:
        value = {k: _relocate(v, child_path(path, k)) for k, v in value.items()}
    elif node.is_list:
        value = [_relocate(v, child_path(path, i)) for i, v in enumerate(value)]
    return Node(value, path, node.text, node.line, node.column, node.key_line, node.key_column, node.size)
