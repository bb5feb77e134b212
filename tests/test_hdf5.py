"""Variables and attributes written by h5py's lower level: the file is the one that its upper level writes."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np
import pytest

from rcstudy.storage import hdf5

ATTRIBUTES = {
    "units": "N mm",
    "empty": "",
    "name": "Poissonzahl ν\nund 接触",
    "count": 3,
    "seconds": 0.25,
    "number": np.int32(7),
    "flag_values": np.array([-1, 0, 2], dtype="i1"),
    "_FillValue": np.array([np.nan], dtype="f4"),
}
VALUES = {
    "moduli": np.linspace(1.0, 2.0, 12).reshape(3, 4)[:, ::2],
    "alone": np.array(-2.5),
    "numbers": np.arange(5, dtype="i8"),
    "labels": np.array([["a", "", "thickness=¼ a"], ["b" * 300, "\t", "'"]], dtype=object),
}


@pytest.mark.parametrize("name", VALUES)
def test_the_file_is_that_of_the_upper_level(tmp_path: Path, name: str) -> None:
    values = VALUES[name]
    code = hdf5.TEXT if values.dtype == object else values.dtype.str
    missing = np.array([np.nan], dtype=code) if values.dtype.kind == "f" else None
    with h5py.File(tmp_path / "lower", "w") as file:
        group = file.create_group("loads")
        variable = hdf5.add_variable(group, name, values.shape, code, missing=missing)
        field = hdf5.add_variable(group, "field", (4, 6, 5), "f4", chunk=(1, 6, 5), deflate=1)
        hdf5.fill(variable, values)
        hdf5.fill(field, np.ones((4, 6, 5), dtype="f4"))
        hdf5.add_attributes(group, ATTRIBUTES)
        hdf5.add_attributes(variable, ATTRIBUTES)
        scales = [hdf5.add_variable(group, f"along {n}", (n,), ">f4") for n in field.shape]
        for scale in scales:
            scale.make_scale()
        hdf5.attach_scales(field, scales)
    with h5py.File(tmp_path / "upper", "w") as file:
        group = file.create_group("loads")
        dtype = h5py.string_dtype() if code == hdf5.TEXT else code
        options = {} if missing is None else {"fillvalue": np.nan}
        group.create_dataset(name, values.shape, dtype, **options)
        field = group.create_dataset(
            "field", (4, 6, 5), "f4", chunks=(1, 6, 5), compression="gzip", compression_opts=1, shuffle=False
        )
        group[name][...] = values
        field[...] = 1.0
        group.attrs.update(ATTRIBUTES)
        group[name].attrs.update(ATTRIBUTES)
        scales = [group.create_dataset(f"along {n}", (n,), ">f4") for n in field.shape]
        for scale in scales:
            scale.make_scale()
        for axis, scale in enumerate(scales):
            field.dims[axis].attach_scale(scale)
    assert (tmp_path / "lower").read_bytes() == (tmp_path / "upper").read_bytes()
    with h5py.File(tmp_path / "lower") as file:
        stored = file["loads"][name]
        read = stored.asstr()[...] if code == hdf5.TEXT else stored[...]
        assert np.array_equal(read, values)
        assert {key: stored.attrs[key] for key in ("units", "empty", "name")} == {
            key: ATTRIBUTES[key] for key in ("units", "empty", "name")
        }


def test_values_of_another_shape_are_refused(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "c.nc", "w") as file:
        variable = hdf5.add_variable(file, "force_x", (2, 3), "f8")
        with pytest.raises(ValueError, match=r"^/force_x: \(2, 3\), not \(3, 2\)$"):
            hdf5.fill(variable, np.ones((3, 2)))
