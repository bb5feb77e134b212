"""YAML files as trees of :mod:`rcstudy.studyfile.yamltree`.

Loads data only: the tree is built from ruamel.yaml's parser events, so no tag ever constructs an object. Tags, further
documents, duplicate keys, self-containing aliases, and aliases, values, nesting or files beyond a bound are refused.
"""

from __future__ import annotations

import math
import re
import unicodedata
from pathlib import Path
from typing import Any

from rcstudy.errors import UserError
from rcstudy.studyfile.yamltree import (
    MAX_DEPTH,
    REFUSED,
    Node,
    OutOfRange,
    Problems,
    child_path,
    is_out_of_range,
    shorten,
)

MAX_BYTES = 4_000_000
MAX_ALIASED = 100_000  # values that aliases may add, in all
MAX_VALUES = 250_000  # written in a file, keys included; reading so many takes half a minute

_CORE = "tag:yaml.org,2002:"
_UNSIGNED = re.compile(r"[-+]?\.[0-9]+[eE][0-9]+")  # numbers in YAML 1.2, but text to ruamel.yaml
_NO_SPACE = re.compile(r"([\w.]+):[^\s/]")  # a key and its value without a space in between
_WITH_VALUE = re.compile(r"( *)[\w.]+: +[^\s#|>]")  # a key and its value
_ODD = r"[^\S \t\r\n]|[\u200b\u2060\ufeff]"  # characters that look like a space or are invisible; no spaces to YAML
# YAML 1.2 has tabs between the tokens of a line, too, but the parser has not
_TABS = "tabs are allowed only in quotes, brackets and comments: use spaces"
_ODD_KEY = re.compile(_ODD)
_ODD_LINE = re.compile(rf" *(?:[\w.]+:)?(?P<odd>{_ODD})")  # at the beginning of a line, or behind its key


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
    """The tree of the one document in `text`; `whole` says what is expected, in the error for an empty one.

    Values that are not allowed (tags, duplicate keys) are reported to `problems` and the rest is still read; UserError
    for text that is not YAML at all, empty, more than one document, or beyond the bounds above.
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
        line, column, reason = _fault(error, text.splitlines())
        problems.at(line + 1, column + 1, "" if reason == _TABS else "not YAML", "", shorten(reason, 250))
        problems.check()  # what the rest of the file lacks is not known
    except ReaderError as error:
        before = text[: error.position]
        line, column = before.count("\n") + 1, len(before.rsplit("\n", 1)[-1]) + 1
        problems.at(line, column, "not YAML", f"character {error.character!r}", "printable characters")
    except Exception as error:
        # the parser raises all kinds of errors on hostile text ("\UFFFFFFFF": OverflowError or, from Python 3.13 on,
        # ValueError); it only ever reads, so whatever it is, the text is at fault
        problems.at(1, 1, "not YAML", "", shorten(f"{type(error).__name__}: {error}", 200))
    if builder.root is None:
        if not problems.found:
            problems.at(1, 1, "the file is empty", "", whole)
        problems.check()
    assert builder.root is not None
    return builder.root


def _fault(error: Any, lines: list[str]) -> tuple[int, int, str]:
    """Line and column, from 0, at which these `lines` are not YAML, and the reason.

    The parser reports where it gave up, which may be far behind the fault; the place of the fault itself is given as
    far as it can be found.
    """
    mark = error.problem_mark or error.context_mark
    line, column = (mark.line, mark.column) if mark else (0, 0)
    before = "".join(lines[line : line + 1])[: column + 1]
    if before.endswith("\t") or ("\t" in before and not before.strip(" \t")):
        return line, before.rindex("\t"), _TABS
    for k in range(max(line - 1, 0), line + 1):
        if odd := _ODD_LINE.match("".join(lines[k : k + 1])):
            return k, odd.start("odd"), _not_a_space(odd["odd"])
    began = error.context_mark
    if error.context == "while scanning a simple key" and began:  # the parser gives up in the line below
        word = "".join(lines[began.line : began.line + 1])[began.column :].strip()
        return began.line, began.column, _no_key(word)
    written = [k for k in range(line) if lines[k].strip() and not lines[k].lstrip().startswith("#")]
    if written and _NO_SPACE.match(word := lines[written[-1]].strip()):
        return written[-1], lines[written[-1]].index(word), _no_key(word)
    if misplaced := _misplaced(error, lines, line, column, written):
        return misplaced
    since = ""
    if began and (began.line, began.column) != (line, column):
        since = f"begun at line {began.line + 1}, column {began.column + 1}"
    reason = ", ".join(part for part in (error.context, since, error.problem) if part)
    if error.problem == "mapping values are not allowed here":
        reason += "; a space follows the ':' of a key, in the line before too; text with ': ' in it needs quotes"
    return line, column, reason


def _misplaced(error: Any, lines: list[str], line: int, column: int, written: list[int]) -> tuple[int, int, str] | None:
    """Place and reason of an error by indentation, or by a line that is no part of the document; None of others.

    `written`: lines before this one that are neither empty nor comments.
    """
    problem, began = str(error.problem), error.context_mark
    directives = [k for k, text in enumerate(lines[: line + 1]) if text.startswith("%")]
    if "<document start>" in problem and directives:
        return directives[-1], 0, "a line that begins with % is a directive of YAML, no part of a study"
    if began and "expected <block end>" in problem:
        if "'?'" in problem:
            return line, column, f"a key where the next item ('- ...') of the list at line {began.line + 1} is expected"
        there = f"line {began.line + 1}, column {began.column + 1}"
        return line, column, f"indented otherwise than the keys or items that it stands among, which begin at {there}"
    if problem == "mapping values are not allowed here" and written:
        depth = len(lines[line]) - len(lines[line].lstrip())
        above = _WITH_VALUE.match(lines[written[-1]])
        if above and len(above[1]) < depth:
            return line, depth, f"indented deeper than line {written[-1] + 1}, whose key has a value already"
    return None


def _no_key(word: str) -> str:
    key = _NO_SPACE.match(word)
    hint = f": a space must follow the ':' of {key[1]}" if key else ""
    return f"{shorten(word, 60)} is no key with a value{hint}"


def _not_a_space(character: str) -> str:
    name = unicodedata.name(character, "no character").lower()
    return f"U+{ord(character):04X} ({name}) is not allowed here: use spaces"


class _Builder:
    """Builds the tree from the parser's events, without recursion, so that no nesting can exhaust the stack."""

    def __init__(self, resolver: Any, problems: Problems) -> None:
        from ruamel.yaml import events, nodes

        self._events, self._scalar_node = events, nodes.ScalarNode
        self._resolver, self._problems = resolver, problems
        self._open: list[Node] = []
        self._keys: list[tuple[str, int, int] | None] = []  # of each open mapping: the key awaiting its value
        self._refused: set[tuple[str, int, int]] = set()  # keys that were reported: nothing more is said about them
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
        if event.style is None and _ODD_KEY.match(word):  # meant as indentation: levels are not as they look
            self._fatal(line, column, "not YAML", "", _not_a_space(word[0]))
        if event.ctag is not None or self._tag(event) not in ("str", "timestamp", "value"):
            problem = "a key is a word"
            if self._tag(event) == "merge":
                problem = (
                    "merge keys are not part of YAML 1.2; a grid takes over the shared scene by itself, "
                    "and *name alone gives a whole mapping again"
                )
            elif self._tag(event) in ("int", "float"):  # the 3 of `nu: 0,3` in braces
                problem += " (numbers have a decimal point and no thousands separators)"
            self._refused.add((word, line, column))
            self._problems.at(line, column, child_path(parent.path, word), "" if word else "(nothing)", problem)
        elif word in parent.value:
            first = parent.value[word]
            problem = f"given twice, first at line {first.key_line}, column {first.key_column}"
            self._problems.at(line, column, child_path(parent.path, word), "", problem)
        self._keys[-1] = (word, line, column)

    def _tag(self, event: Any) -> str:
        if event.style is None and _UNSIGNED.fullmatch(event.value):
            return "float"
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
            _, line, column = key  # an empty value is located at its key
        node = Node(self._scalar(event), path, event.value, line, column)
        if event.anchor:
            self._anchors[event.anchor] = node
            self._open_anchors.pop(event.anchor, None)
        return node

    def _scalar(self, event: Any) -> Any:
        tag, text = self._tag(event), event.value
        bare = text.lower()
        if tag in ("int", "float") and ("_" in text or bare.lstrip("+-").startswith("0b")):
            return text  # numbers in YAML 1.1, but text in YAML 1.2
        if tag == "int":
            try:
                return int(bare, 0) if bare.lstrip("+-")[:2] in ("0x", "0o") else int(bare)
            except ValueError:  # more digits than Python converts
                return OutOfRange(math.inf)
        if tag == "float":
            number = float(bare.replace(".inf", "inf").replace(".nan", "nan"))
            return OutOfRange(number) if is_out_of_range(bare, number) else number
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
            if key in self._refused:
                node.value = REFUSED
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
