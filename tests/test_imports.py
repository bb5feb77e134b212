"""Data flows one way: every module imports only from modules below it."""

import ast
import re
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parent.parent / "rcstudy"

# From the bottom up: a module may import only from entries above its own in this list (and, inside a package, from its
# sister modules). A new module gets its place here.
ORDER = [
    "rcstudy.errors",
    "rcstudy.threads",
    "rcstudy.streams",
    "rcstudy.progress",
    "rcstudy.result",
    "rcstudy.settings",
    "rcstudy.mechanics",
    "rcstudy.studyfile",
    "rcstudy.study",
    "rcstudy.cases",
    "rcstudy.plan",
    "rcstudy.bars",
    "rcstudy.solve",
    "rcstudy.provenance",
    "rcstudy.storage",
    "rcstudy.store",
    "rcstudy.assemble",
    "rcstudy.cube",
    "rcstudy.workers",
    "rcstudy.sweep",
    "rcstudy.merge",
    "rcstudy.status",
    "rcstudy.failures",
    "rcstudy.structure",
    "rcstudy.check",
    "rcstudy.scales",
    "rcstudy.tolerances",
    "rcstudy.compare",
    "rcstudy.show",
    "rcstudy.report",
    "rcstudy.figures",
    "rcstudy.tables",
    "rcstudy.accuracy",
    "rcstudy",
    "rcstudy.options",
    "rcstudy.cli",
    "rcstudy.__main__",
]
PACKAGES = tuple(f"rcstudy.{name}" for name in ("mechanics", "studyfile", "bars", "storage", "workers", "report"))


def modules():
    return sorted(PACKAGE.rglob("*.py"))


def name_of(path):
    parts = path.relative_to(PACKAGE.parent).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def imports(path):
    """Every module of this package that the file imports, wherever in it: at the top, in functions, for type checks."""
    known = {name_of(p) for p in modules()}
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name.split(".")[0] == "rcstudy")
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path.name}:{node.lineno}: relative import"
            if node.module and node.module.split(".")[0] == "rcstudy":
                for alias in node.names:
                    inner = f"{node.module}.{alias.name}"
                    yield inner if inner in known else node.module


def entry_of(name):
    """The entry of ORDER that `name` belongs to."""
    return next((package for package in PACKAGES if name == package or name.startswith(f"{package}.")), name)


def wrong_imports(path):
    """Imports of the file that do not come from below."""
    own = entry_of(name_of(path))
    for imported in imports(path):
        entry = entry_of(imported)
        if entry not in ORDER or own not in ORDER or (entry != own and ORDER.index(entry) > ORDER.index(own)):
            yield imported


@pytest.mark.parametrize("path", modules(), ids=name_of)
def test_imports_come_from_below(path):
    assert entry_of(name_of(path)) in ORDER, "a new module: give it a place in ORDER"
    assert list(wrong_imports(path)) == []


# What mechanics may import of others: libraries of numbers, and what the language itself is made of.
OUTSIDE = {"numpy", "scipy", "numba", "pyfftw"} | {"__future__", "collections", "copy", "dataclasses", "functools"}
OUTSIDE |= {"itertools", "math", "operator", "threading", "typing"}
# Files are of compiled kernels only, which are kept on the disk; imports by name only those that are put off.
OUTSIDE_OF = {
    "collecting.py": {"contextlib", "gc"},
    "jit.py": {"contextlib", "fcntl", "hashlib", "logging", "os", "pathlib", "pickle", "sys", "time"},
    "later.py": {"contextlib", "importlib", "sys", "types"},
    "turns.py": {"contextlib", "os"},
}


def outside(path):
    """What the file imports of others, by their first names, and built-in functions that open files or run code."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name.split(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield (node.module or "").split(".")[0]
        elif isinstance(node, ast.Name) and node.id in {"open", "__import__", "exec", "eval"}:
            yield node.id


def test_mechanics_knows_nothing_of_files_studies_or_plots():
    seen = set()
    for path in (PACKAGE / "mechanics").rglob("*.py"):
        assert {entry_of(name) for name in imports(path)} <= {"rcstudy.mechanics"}, path.name
        others = set(outside(path)) - {"rcstudy"}
        assert others - OUTSIDE <= OUTSIDE_OF.get(path.name, set()), path.name
        seen |= others
    assert seen == OUTSIDE.union(*OUTSIDE_OF.values())


def test_what_mechanics_may_not_import_is_seen(tmp_path):
    path = tmp_path / "bad.py"
    path.write_text(
        "import numpy as np\n\ndef f():\n    import matplotlib.pyplot\n    from h5py import File\n    open('x')\n"
    )
    assert set(outside(path)) - OUTSIDE == {"matplotlib", "h5py", "open"}


def without_circles(edges):
    """Raises unless the graph, sets of targets by source, has no circle."""
    # take away what imports nothing that is left, until none is left
    while edges:
        free = {name for name, targets in edges.items() if not targets & edges.keys()}
        assert free, f"a circle among {sorted(edges)}"
        edges = {name: targets for name, targets in edges.items() if name not in free}


def test_no_module_imports_itself_by_way_of_others():
    without_circles({name_of(path): set(imports(path)) - {name_of(path)} for path in modules()})


def test_rooms_of_mechanics_import_one_way():
    """Each of its folders counts as one."""
    edges = {}
    for path in (PACKAGE / "mechanics").rglob("*.py"):
        room = ".".join(name_of(path).split(".")[:3])
        edges.setdefault(room, set()).update(".".join(name.split(".")[:3]) for name in imports(path))
    without_circles({room: targets - {room} for room, targets in edges.items()})


def test_numerics_know_nothing_of_contact():
    below = {"rcstudy.mechanics." + name for name in ("numerics", "kernels", "jit")}
    for path in (PACKAGE / "mechanics" / "numerics").glob("*.py"):
        assert {".".join(name.split(".")[:3]) for name in imports(path)} <= below, path.name


def test_order_has_no_module_that_is_gone():
    assert set(ORDER) - {entry_of(name_of(path)) for path in modules()} == set()


def test_imports_are_seen_wherever_they_stand(tmp_path, monkeypatch):
    monkeypatch.setitem(globals(), "PACKAGE", tmp_path / "rcstudy")
    (tmp_path / "rcstudy" / "mechanics").mkdir(parents=True)
    (tmp_path / "rcstudy" / "cli.py").touch()
    bad = tmp_path / "rcstudy" / "mechanics" / "bad.py"
    bad.write_text("from rcstudy import cli\nimport os\n\ndef f():\n    from rcstudy.study import Study\n")
    assert list(imports(bad)) == ["rcstudy.cli", "rcstudy.study"]
    assert list(wrong_imports(bad)) == ["rcstudy.cli", "rcstudy.study"]


def test_the_documented_order_is_this_one():
    """The rows of the table in mechanics.md, modules in any order within one; it had a module below what it imports."""
    text = (PACKAGE.parent / "docs" / "mechanics.md").read_text(encoding="utf-8")
    table = text.partition("| where | what |")[2].partition("\n\n")[0]
    left = [name for name in ORDER if name != "rcstudy"]
    for row in table.splitlines()[2:]:
        words = re.findall(r"`(?:rcstudy/)?(\w+)(?:\.py)?`", row.split("|")[1])
        expected, left = left[: len(words)], left[len(words) :]
        assert {f"rcstudy.{word}" for word in words} == set(expected)
    assert left == []
