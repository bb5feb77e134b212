"""Records: a result as bytes and back, what is kept of it, and bytes that are no record."""

from __future__ import annotations

import math
import struct
import zlib
from collections.abc import Iterator, Sequence

import numpy as np
import pytest
import synthetic

from rcstudy.mechanics.scene import Scene
from rcstudy.result import Result, Status
from rcstudy.storage.deflate import compress, decompress
from rcstudy.storage.record import FIELDS, SCALARS, DamagedRecord, Form, Keep, Packer, Packing, contact_box, parse

CELLS = synthetic.MESH.cells


def packed(keep: Keep | None = None, result: Result | None = None) -> bytes:
    return Packer(keep or Keep()).pack(result or synthetic.made_up_result(synthetic.SCENE), CELLS).body


def test_there_and_back_bit_for_bit() -> None:
    result = synthetic.made_up_result(synthetic.SCENE)
    result.scalars |= {"moment_z": -0.0, "force_x": 1e-310, "force_y": math.inf, "slip_area": math.nan}
    record = parse(packed(result=result))
    assert (record.status, record.reason, record.cells) == (Status.SOLVED, "", CELLS)
    assert record.region == (0, CELLS[0], 0, CELLS[1])
    finite = {name: value for name, value in result.scalars.items() if math.isfinite(value)}
    assert record.scalars == finite
    assert math.copysign(1.0, record.scalars["moment_z"]) == -1.0
    assert set(record.fields) == set(result.fields)
    for name, values in result.fields.items():
        assert record.values(name).tobytes() == values.tobytes()
        assert zlib.decompress(record.fields[name].stream) == values.tobytes()


def test_cropped_fields_lose_nothing() -> None:
    result = synthetic.made_up_result(synthetic.SCENE)
    record = parse(packed(Keep(crop=True)))
    assert record.region == contact_box(result.fields.values())
    assert record.shape < CELLS
    assert record.contact() == record.region == parse(packed()).contact()
    whole = (0, CELLS[0], 0, CELLS[1])
    for name, values in result.fields.items():
        np.testing.assert_array_equal(record.cut(name, whole), values)
        part = (3, 17, 9, 24)  # across the edge of the contact
        np.testing.assert_array_equal(record.cut(name, part), values[3:17, 9:24])
        i0, _, j0, _ = record.region
        for beside in ((0, i0 - 2, 0, CELLS[1]), (0, CELLS[0], 0, j0 - 2)):
            assert not record.cut(name, beside).any()


def test_what_is_kept() -> None:
    result = synthetic.made_up_result(synthetic.SCENE)
    record = parse(packed(Keep(precision="float32")))
    assert {name: f.dtype for name, f in record.fields.items()} == {
        **dict.fromkeys(("pressure", "traction_x", "traction_y", "slip_x", "slip_y"), "f4"),
        "state": "i1",
    }
    np.testing.assert_array_equal(record.values("pressure"), result.fields["pressure"].astype("f4"))
    assert parse(packed(Keep(fields=False))).fields == {}
    failed = parse(packed(result=Result(Status.REFUSED, "too small — größer")))
    assert (failed.status, failed.reason, failed.scalars, failed.fields) == (
        Status.REFUSED,
        "too small — größer",
        {},
        {},
    )
    assert failed.contact() == (0, 0, 0, 0)


@pytest.mark.parametrize(
    ("have", "wanted", "covered"),
    [
        (Keep(), Keep(fields=False), True),
        (Keep(), Keep(precision="float32", crop=True), True),
        (Keep(crop=True), Keep(), True),
        (Keep(precision="float32"), Keep(), False),
        (Keep(fields=False), Keep(), False),
        (Keep(fields=False, precision="float32"), Keep(fields=False), True),
    ],
)
def test_what_serves_for_what(have: Keep, wanted: Keep, covered: bool) -> None:
    assert have.covers(wanted) == covered


def test_a_shared_pressure_is_told_from_another() -> None:
    """Even if a solver uses one array again and again."""
    packer = Packer(Keep())
    result = synthetic.made_up_result(synthetic.SCENE)
    bodies = []
    for factor in (1.0, 1.0, 2.0, -0.0):
        result.fields["pressure"] *= factor
        bodies.append((packer.pack(result, CELLS).body, result.fields["pressure"].copy()))
    for body, pressure in bodies:
        assert parse(body).values("pressure").tobytes() == pressure.tobytes()


def test_a_solver_whose_results_are_not_proper() -> None:
    def solve(scenes: Sequence[Scene]) -> Iterator[Result]:
        yield Result(Status.SOLVED, fields={"pressure": np.zeros((2, 2))})
        yield Result(Status.SOLVED, scalars={"shoe": 1.0})
        yield synthetic.made_up_result(scenes[2])

    first, second, third = Packing(solve, Keep())([synthetic.SCENE] * 3)
    assert [r.status for r in (first, second, third)] == [Status.ERROR, Status.ERROR, Status.SOLVED]
    assert "pressure has shape (2, 2)" in parse(first.body).reason
    assert "unknown variables ['shoe']" in parse(second.body).reason


def test_numbers_that_single_precision_has_not() -> None:
    """Infinite in the cube, they were a solution."""
    result = synthetic.made_up_result(synthetic.SCENE)
    result.fields["pressure"] = result.fields["pressure"] * 1e40
    for precision, status in (("float32", Status.ERROR), ("float64", Status.SOLVED)):
        (packed,) = Packing(lambda scenes: iter([result]), Keep(precision=precision))([synthetic.SCENE])
        assert packed.status == status.value
        assert (status == Status.ERROR) == ("pressure has numbers beyond 3.4e+38" in parse(packed.body).reason)


def test_bytes_that_are_no_record() -> None:
    """Cut anywhere, or with a byte changed: an error of our own or, in numbers and streams, other values at most."""
    body = packed()
    for size in (*range(0, 400, 7), len(body) - 1):
        with pytest.raises(DamagedRecord):
            parse(body[:size])
    with pytest.raises(DamagedRecord):
        parse(body + b"x")
    rng = np.random.default_rng(5)
    for _ in range(400):
        bad = bytearray(body)
        bad[rng.integers(0, 300)] ^= 1 << rng.integers(0, 8)
        try:
            record = parse(bytes(bad))
            for name in record.fields:
                record.values(name)
        except DamagedRecord:
            pass
    cells = struct.pack("<2I", *CELLS)
    for other in ((32, 4), (2**16, 2**16)):
        with pytest.raises(DamagedRecord, match="mesh"):
            parse(body.replace(cells, struct.pack("<2I", *other), 1))


def test_records_of_another_version() -> None:
    """Scalars in another order, one of them unknown here; a field that is unknown here."""
    record = parse(packed())
    names = (*reversed(SCALARS[1:]), "of_tomorrow")
    other = parse(packed(), Form(names))
    assert other.scalars == {
        name: x for name, x in zip(names, record.numbers, strict=True) if name in SCALARS and not math.isnan(x)
    }
    assert other.fields == record.fields
    with pytest.raises(DamagedRecord, match="field"):
        parse(packed(), Form(fields=(*FIELDS[:-1], "of_tomorrow")))
    with pytest.raises(DamagedRecord):
        parse(packed(), Form(SCALARS[1:]))


def test_a_reason_that_is_no_proper_text() -> None:
    assert parse(packed(result=Result(Status.ERROR, "x\ud800y"))).reason == "x\\ud800y"


def test_streams() -> None:
    data = np.arange(1000, dtype="f8")
    data[300:700] = 0.0
    stream = compress(data)
    assert len(stream) < 4900
    assert decompress(stream, 8000) == data.tobytes()
    for size in (7999, 8001):
        with pytest.raises(ValueError, match="not the bytes"):
            decompress(stream, size)
    for bad in (stream[:-1], stream + b"x", stream[:50] + bytes([stream[50] ^ 4]) + stream[51:], b"", b"xy"):
        with pytest.raises(ValueError, match=r".+"):
            decompress(bad, 8000)


def test_only_solutions_contradict_each_other() -> None:
    def differ(status: Status, other: Status) -> str:
        results = synthetic.made_up_result(synthetic.SCENE, status), synthetic.made_up_result(synthetic.SCENE, other)
        results[1].scalars["approach"] *= 2.0
        one, two = (parse(packed(result=result)) for result in results)
        return one.contradicts(two)

    assert differ(Status.SOLVED, Status.SOLVED) == "approach"
    assert differ(Status.NOT_CONVERGED, Status.NOT_CONVERGED) == ""
    assert differ(Status.SOLVED, Status.NOT_CONVERGED) == differ(Status.NOT_CONVERGED, Status.SOLVED) == ""


def test_contradictions_are_told_in_the_coarser_precision() -> None:
    """Single precision has seven digits: what it rounds off is none, on either side."""
    ours = parse(packed(Keep(precision="float32")))
    for factor, told in ((1.0 + 1e-12, ""), (1.0 + 1e-5, "pressure")):
        result = synthetic.made_up_result(synthetic.SCENE)
        result.fields["pressure"] *= factor
        theirs = parse(packed(Keep(crop=True), result))
        assert ours.contradicts(theirs) == theirs.contradicts(ours) == told
