"""Files that are no study, hostile ones among them: always a message with a place, never a traceback."""

import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st
from studies import BASE, CONFIGS, load_text, refusal

from rcstudy.cases import expand
from rcstudy.errors import UserError
from rcstudy.study import Study, load_study
from rcstudy.studyfile import yamlfile, yamltree
from rcstudy.studyfile.spec import StudySpec, allowed_at

PAPERS = "paper.yaml", "paper_fine.yaml"


@pytest.fixture
def refused(tmp_path):
    """Lines of the refusal of a text."""
    return lambda text: refusal(tmp_path, text)


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("", "1:1: the file is empty"),
        ("# nothing\n", "1:1: the file is empty"),
        ("- 1\n", "1:1: [1]: a mapping with keys study,"),
        ("text\n", "1:1: text: a mapping with keys study,"),
        (BASE + "  g: {cases: [{label: a, load 3}]}\n", "8:26: grids.g.cases[0].load 3: unknown key: a ': ' is"),
        (BASE + "  g: {scene: {load 3}}\n", "8:15: grids.g.scene.load 3: unknown key: a ': ' is missing after"),
        (BASE + "---\n" + BASE, "8:1: second document: one document a file"),
        ("%YAML 1.1\n---\nstudy: s\n", "2:1: %YAML directive: YAML 1.2"),
        ("study: a: b\n", "1:9: not YAML: mapping values are not allowed here"),
        ("study: s\n\tscene: 1\n", "2:1: tabs are allowed only in"),
        ('study: "\\UFFFFFFFF"\n', "1:1: not YAML:"),  # OverflowError, from Python 3.13 on ValueError
        ("study: s\nx: \x07\n", "2:4: not YAML: character 7: printable characters"),
        (b"study: s\nscene: \xff\n", "2:8: byte 0xff: the file must be UTF-8 text"),
        ("study: s\xe9\nx: \xe9".encode("latin-1"), "1:9: byte 0xe9: the file must be UTF-8 text"),
        ("[" * 100_000, "1:33: nesting: at most 32 deep"),
        ("study: ../../etc\n", "1:8: study: ../../etc: a name of at most 100 letters, digits"),
        ("study: _s\n", "1:8: study: _s: a name of at most 100 letters, digits, '_', '-' and '.', the first"),
        ("study: 1\n", f"1:8: study: 1: {allowed_at(StudySpec, 'study')}; a number in quotes"),
        ("study: s\nscene: 1\n", "2:8: scene: 1: a mapping of scene keys"),
        ("study: s\nscene: {load: 1}\ngrids: {}\n", "3:8: grids: {}: a mapping of at least one named grid"),
        ("study: s\noutputs: {fields: 1}\n", "2:19: outputs.fields: 1: true or false"),
        ("study: s\noutputs: {precision: f8}\n", "2:22: outputs.precision: f8: one of float64, float32"),
        ("study: s\ndescription: \"\\0\"\n", "2:14: description: \\x00: text of at most 20000 characters"),
        ("study: s\n1: x\n", "2:1: 1: a key is a word"),
        ("study: s\n: x\n", "2:1: (nothing): a key is a word"),
        ("study: s\n[a]: x\n", "2:1: an alias, list or mapping as key: a key is a word"),
        ("study: s\n<<: {a: 1}\n", "2:1: <<: merge keys are not part of YAML 1.2"),
        ("study: &a [*a]\n", "1:12: study[0]: *a: an alias cannot stand inside its own anchor"),
        ("study: *a\n", "1:8: study: *a: no anchor &a stands before it"),
    ],
)  # fmt: skip
def test_bad_files(refused, text, line):
    found = refused(text)
    assert any(one.startswith(f"s.yaml:{line}") for one in found), found


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("study: 's\nscene:\n", "3:1: not YAML: while scanning a quoted scalar, begun at line 1, column 8, found"),
        ("scene: {load: 1\ngrids: 2\n", "2:6: not YAML: while parsing a flow mapping, begun at line 1, column 8, exp"),
        ("load: [1\ngrids: 2\n", "2:6: not YAML: while parsing a flow sequence, begun at line 1, column 7, expected"),
        ("study: @\n", "1:8: not YAML: while scanning for the next token, found character '@'"),
        ("scene:\n  radius:50\n  load: 1\n", "2:3: not YAML: radius:50 is no key with a value: a space must follow"),
        ("scene:\n\tload: 1\n", "2:1: tabs are allowed only in quotes, brackets and comments: use spaces"),
        ("scene:\n  a: 1\n  \tload: 1\n", "3:3: tabs are allowed only in quotes, brackets and comments: use spaces"),
        ("scene: s\n  \tload: 1\n", "2:3: tabs are allowed only in quotes, brackets and comments: use spaces"),
        ("scene:\n  load: \t1\n", "2:9: tabs are allowed only in quotes, brackets and comments: use spaces"),
        ("load: 100\t# N\n", "1:10: tabs are allowed only in quotes, brackets and comments: use spaces"),
        ("load:\t100\n", "1:6: tabs are allowed only in quotes, brackets and comments: use spaces"),
        ("scene: {\n\ta: 1\n\tb: 2}\n", "3:2: not YAML: while parsing a flow mapping, begun at line 1, column 8, exp"),
        ("scene:\n\u00a0 load: 1\n", "2:1: not YAML: U+00A0 (no-break space) is not allowed here: use spaces"),
        ("scene:\n  \u200bload: 1\n", "2:3: not YAML: U+200B (zero width space) is not allowed here: use spaces"),
        ("scene:\n  load:\u00a01\n  a: 2\n", "2:8: not YAML: U+00A0 (no-break space) is not allowed here: use"),
    ],
)  # fmt: skip
def test_what_is_not_yaml_is_told_where_it_began(refused, text, line):
    """The parser says where it gave up: of a quote that is not closed that is the end of the file."""
    (found,) = refused(text)
    assert found.startswith(f"s.yaml:{line}"), found


@pytest.mark.parametrize(
    ("old", "new", "at"),
    [
        ("nu: 0.3", "nu: 0,3", "3:32: scene.substrate.3"),
        ("E: 210000", "E: 210,000", "3:22: scene.substrate.000"),
        ("load: 100", "load: 100\n  7: 1", "6:3: scene.7"),
        ("  g:", "  7:", "8:3: grids.7"),
    ],
)
def test_a_number_as_a_key_is_told_once(refused, old, new, at):
    """Most are what a comma leaves of a number; they were called unknown keys, too."""
    text = (BASE + "  g: {axes: {load: [100]}}\n").replace(old, new)
    words = "a key is a word (numbers have a decimal point and no thousands separators)"
    assert refused(text) == [f"s.yaml:{at}: {words}"]


@pytest.mark.parametrize(
    "value", ["!!python/object/apply:os.mkdir [hit]", "!!python/name:os.system x", "!!str x", "!mine {a: 1}", "! x"]
)
def test_tags_are_refused_and_construct_nothing(refused, value, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    found = refused(f"study: s\ndescription: {value}\n")
    (line,) = (line for line in found if line.endswith("a plain value: tags are not allowed"))
    assert line.startswith("s.yaml:2:14: description: !")
    assert [path.name for path in tmp_path.iterdir()] == ["s.yaml"]


def test_aliases_that_multiply_are_refused(refused):
    text = "a: &a [1, 1, 1, 1, 1, 1, 1, 1, 1, 1]\n"
    for k in range(1, 20):
        text += f"{chr(97 + k)}: &{chr(97 + k)} [{', '.join(['*' + chr(96 + k)] * 10)}]\n"
    assert "aliases may add 100000 values in all, no more" in refused(text)[-1]


def test_aliases_cannot_nest_beyond_the_bound(refused):
    text = "".join(f"k{k}: &k{k} [[[[[[[[*k{k - 1}]]]]]]]]\n" if k else "k0: &k0 [1]\n" for k in range(6))
    assert refused(text)[-1].endswith("nesting at most 32 deep")


def test_files_that_cannot_be_read(tmp_path, monkeypatch):
    for path in (tmp_path / "missing.yaml", tmp_path, "a\0b"):
        with pytest.raises(UserError, match="cannot be read"):
            load_study(path)
    monkeypatch.setattr(yamlfile, "MAX_BYTES", 100)
    (tmp_path / "s.yaml").write_text(BASE)
    with pytest.raises(UserError, match="larger than"):
        load_study(tmp_path / "s.yaml")


def test_many_errors_are_counted_not_all_listed(refused):
    found = refused(BASE + f"  g: {{axes: {{load: [{', '.join('x' * k for k in range(1, 101))}]}}}}\n")
    assert len(found) == yamltree.MAX_REPORTED + 1
    assert found[-1] == "s.yaml: ... and 60 more errors"


def test_the_papers_fine_study_is_the_papers_but_for_its_cells():
    """Three lines and a comment: whatever reading is taken in one is taken in the other."""
    paper, fine = ((CONFIGS / name).read_text(encoding="utf-8").splitlines() for name in PAPERS)
    changed = {
        "study: paper": "study: paper_fine",
        "  mesh: {size: [2, 2], cells: [64, 64]}": "  mesh: {size: [2, 2], cells: [256, 256]}",
        "  discretisation: kalker": "  discretisation: aligned",
    }
    assert changed.keys() <= set(paper)
    expected = [changed.get(line, line) for line in paper]
    first = next(k for k, (one, other) in enumerate(zip(expected, fine, strict=False)) if one != other)
    added = len(fine) - len(expected)
    assert fine[:first] + fine[first + added :] == expected
    assert all(line.startswith("#") for line in fine[first : first + added])


# no traceback, whatever the bytes

PAPER = (CONFIGS / PAPERS[0]).read_bytes()
FRAGMENTS = [
    *(bytes([c]) for c in b"{}[]'\"#->~@`?:0|&*!%,\\"),
    *(b"true", b"*a", b"1e999", b".nan", b".inf"),
    *(b"&a ", b"!!python/object:x ", b": ", b"- ", b"? ", b"<<: ", b"1 Es", b"1 a", b"9" * 21),
    *(b"\t", b"\n", b"\r", b"|\n", b"---\n", b"...\n", b"%YAML 9.9\n"),
    *(b"\xff", b"\x00", b"\xef\xbb\xbf", b"\xe2\x80\xa8"),
]

edits = st.lists(
    st.tuples(st.integers(0, len(PAPER)), st.integers(0, 40), st.sampled_from(FRAGMENTS) | st.binary(max_size=6)),
    min_size=1,
    max_size=4,
)


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(edits)
@example([(0, len(PAPER), b"")])
@example([(PAPER.index(b"0.25 a"), 6, b"1e-320 a")])
@example([(PAPER.index(b"50\n"), 2, b"[1e300, 1e-300]")])
def test_mutated_study_is_a_study_or_a_user_error(tmp_path, changes):
    data = PAPER
    for start, length, put in changes:
        data = data[:start] + put + data[start + length :]
    path = tmp_path / "mutated.yaml"
    path.write_bytes(data)
    try:
        study = load_study(path)
    except UserError as error:
        assert str(error).startswith(str(path))
        assert "Traceback" not in str(error)
    else:
        assert isinstance(study, Study)
        assert len(expand(study).cases) == study.size


@pytest.mark.parametrize(
    ("text", "line"),
    [
        (
            "study: s\nscene:\n  radius: 50\n  load:100\n  friction: 1\n",
            "4:3: not YAML: load:100 is no key with a value",
        ),
        ("study: s\nload:100\n", "2:1: not YAML: load:100 is no key with a value"),
        ("study: s\nscene:\n  load:100\n\n  # more\n  friction: 1\n", "3:3: not YAML: load:100 is no key with a value"),
    ],
)
def test_a_space_that_is_missing_is_told_where_it_is(refused, text, line):
    """It was told of in the next line, as a simple key being scanned."""
    assert refused(text) == [f"s.yaml:{line}: a space must follow the ':' of load"]


def test_a_line_that_is_no_key(refused):
    assert refused("study: s\nnonsense\nscene: 1\n") == ["s.yaml:2:1: not YAML: nonsense is no key with a value"]


OTHERWISE = "indented otherwise than the keys or items that it stands among, which begin at"


@pytest.mark.parametrize(
    ("text", "line"),
    [
        (
            "scene:\n  radius: 50\n   load: 1\n",
            "3:4: not YAML: indented deeper than line 2, whose key has a value already",
        ),
        (
            "scene:\n  substrate:\n    E: 2\n   radius: 50\n",
            f"4:4: not YAML: {OTHERWISE} line 2, column 3",
        ),
        (
            "cases:\n  - {load: 1}\n - {load: 2}\n",
            f"3:2: not YAML: {OTHERWISE} line 1, column 1",
        ),
        (
            "axes:\n  - load: [1]\n  friction: [1]\n",
            "3:3: not YAML: a key where the next item ('- ...') of the list at line 2 is expected",
        ),
        (
            "study: s\n%grids:\n  a: 1\n",
            "2:1: not YAML: a line that begins with % is a directive of YAML, no part of a study",
        ),
    ],
)
def test_wrong_indentation_is_called_so(refused, text, line):
    """It was a block mapping whose end was expected, or a space behind the ':' of a key; and keys were missing."""
    assert refused(text) == [f"s.yaml:{line}"]


def test_a_merge_key_stands_for_the_keys_that_are_missing(refused):
    """They were told of, too, one by one."""
    scene = BASE.removesuffix("grids:\n") + "  counterbody: {<<: {E: 1, nu: 0}}\n"
    (told,) = refused(f"{scene}grids: {{g: {{axes: {{load: [1]}}}}}}\n")
    assert "scene.counterbody.<<: merge keys are not part of YAML 1.2" in told
    assert "*name alone gives a whole mapping" in told


def test_an_empty_list_may_be_an_alias(tmp_path):
    text = BASE.replace("  load: 100\n", "  load: 100\n  layers: &none []\n")
    study = load_text(tmp_path, text + "  g: {scene: {layers: *none}, axes: {load: [1, 2]}}\n")
    assert len(study.grids) == 1


@pytest.mark.parametrize(
    ("text", "at", "hint"),
    [
        ("study: s\ndescription: one: two\n", "2:17", True),
        (BASE + "  g: {axes: {load: [1}}\n", "8:22", False),
    ],
)
def test_quotes_are_advised_where_text_is_taken_for_a_key(refused, text, at, hint):
    (line,) = refused(text)
    assert line.startswith(f"s.yaml:{at}: not YAML: ")
    assert line.endswith("; text with ': ' in it needs quotes") is hint
