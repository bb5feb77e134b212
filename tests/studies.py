"""Studies written as text by the tests of the study file, cases and plan."""

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
