"""Studies written as text by the tests of the study file, cases and plan, and of sweeps."""

import os
from pathlib import Path

import pytest

from rcstudy.errors import UserError
from rcstudy.study import load_study

CONFIGS = Path(__file__).parent.parent / "configs"

# grids follow from line 8 on
BASE = """\
study: s
scene:
  substrate: {E: 210000, nu: 0.3}
  radius: 50
  load: 100
  mesh: {size: [2, 2], cells: [32, 32]}
grids:
"""

# 14 cases in 6 normal problems
SWEPT = """
study: swept
scene:
  substrate: {E: 210000, nu: 0.3}
  radius: 50
  mesh: {size: [1, 1], cells: [24, 20]}
  load: 100
grids:
  loads:
    axes:
      load: [20, 40, 60, 80]
      creepage:
        - {label: a, longitudinal: 0.001}
        - {label: b, lateral: 0.002}
        - {label: c, spin: 0.01}
  bare:
    axes: {radius: [30, 40]}
"""
CASES = 14

OLD = b"\x89HDF\r\n\x1a\nold case_key status_reason hertz_radius"  # a cube, of which a disk has left little


def load_text(folder, text):
    """The study of a text (str or bytes), written to s.yaml in `folder`."""
    path = folder / "s.yaml"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return load_study(path)


def refusal(folder, text):
    """Lines of the message that refuses a text; the folder is left out of them."""
    with pytest.raises(UserError) as error:
        load_text(folder, text)
    return str(error.value).replace(f"{folder}{os.sep}", "").splitlines()
