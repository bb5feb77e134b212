"""A command starts quickly: what a sweep does not use is not loaded."""

import subprocess
import sys
from pathlib import Path

SMALL = Path(__file__).parent.parent / "configs" / "small.yaml"


def run_python(code):
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120, check=True)
    return done.stdout.split()


def test_the_solver_loads_no_data_frames_and_no_arrays_of_others():
    loaded = run_python("import sys, rcstudy.solve; print(*sorted(sys.modules))")
    assert "rcstudy.solve" in loaded
    assert {"dask", "xarray", "pandas", "matplotlib", "scipy.special", "scipy.fft"}.isdisjoint(loaded)


def test_the_error_of_the_package_is_there_without_what_solves():
    code = """
import sys, rcstudy
print(rcstudy.UserError.__module__, issubclass(rcstudy.UserError, Exception), *sorted(sys.modules))
"""
    where, is_error, *loaded = run_python(code)
    assert (where, is_error) == ("rcstudy.errors", "True")
    assert {"numpy", "xarray", "pydantic", "rcstudy.solve"}.isdisjoint(loaded)


def test_pyfftw_keeps_its_interfaces_for_those_who_ask():
    code = """
import sys
import rcstudy.mechanics.numerics.fftw
assert "pyfftw.interfaces" not in sys.modules
import pyfftw
print(pyfftw.interfaces.numpy_fft.rfft([1.0, 2.0])[0].real, type(sys.modules["pyfftw.interfaces"].cache).__name__)
import pyfftw.interfaces.scipy_fft
print(pyfftw.interfaces is sys.modules["pyfftw.interfaces"])
"""
    assert run_python(code) == ["3.0", "module", "True"]


def test_pyfftw_that_is_loaded_already_stays_as_it_is():
    code = """
import pyfftw.interfaces
before = pyfftw.interfaces
import rcstudy.mechanics.numerics.fftw
print(pyfftw.interfaces is before, rcstudy.mechanics.numerics.fftw.pyfftw is pyfftw)
"""
    assert run_python(code) == ["True", "True"]


def test_what_is_put_off_is_loaded_when_it_is_used():
    code = """
import sys
from rcstudy.mechanics.numerics.later import deferred_import
with deferred_import("wave"):
    import wave
    print("wave" in sys.modules, hasattr(wave, "__file__"))
print("wave" in sys.modules)
with deferred_import("chunk_of_nothing"):
    import chunk_of_nothing
try:
    chunk_of_nothing.anything
except ModuleNotFoundError as error:
    print(error.name)
with deferred_import("wave"):
    import wave
    print(wave.open is sys.modules["wave"].open, sys.modules["wave"].__file__ is not None)
with deferred_import("wave"):
    import wave
    print(wave is sys.modules["wave"])
"""
    assert run_python(code) == ["True", "True", "True", "chunk_of_nothing", "True", "True", "True"]


def test_kernels_from_the_disk_are_loaded_without_what_numba_compiles_with():
    code = """
import sys
import numpy as np
from rcstudy.mechanics.kernels.arrays import bounds
print(*bounds(np.ones((2, 3), dtype=bool)), *sorted(sys.modules))
"""
    run_python(code)  # now it is on the disk
    loaded = run_python(code)
    assert loaded[:4] == ["0", "2", "0", "3"]
    assert {
        "scipy.linalg",
        "numba.np.linalg",
        "numba.typed.dictobject",
        "numba.np.random.generator_methods",
    }.isdisjoint(loaded)


def test_a_process_that_hands_all_cases_to_others_loads_no_compiler(tmp_path):
    """Its workers do, while it makes the study ready."""
    code = f"""
import sys
from rcstudy import sweep
from rcstudy.study import load_study
done = sweep.run(load_study({str(SMALL)!r}), {str(tmp_path / "c.nc")!r}, workers=2)
print(done.failed, *sorted(sys.modules))
"""
    failed, *loaded = run_python(code)
    assert failed == "0"
    assert {"numba", "pyfftw", "scipy", "rcstudy.solve"}.isdisjoint(loaded)


def test_a_worker_loads_what_solves_and_no_more():
    code = """
import sys
import rcstudy.workers.pool
from rcstudy.workers.batch import solve_batch
from rcstudy.storage.record import Keep, Packing
print(list(Packing(solve_batch, Keep())([])), *sorted(sys.modules))
"""
    results, *loaded = run_python(code)
    assert results == "[]"
    assert "rcstudy.solve" in loaded
    others = {"h5py", "pydantic", "ruamel.yaml", "typer", "xarray", "rcstudy.sweep", "rcstudy.studyfile.spec"}
    assert others.isdisjoint(loaded)
