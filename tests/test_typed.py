"""The public interface as a strict type checker and an editor see it."""

import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parent.parent

GOOD = """
import numpy as np
from numpy.typing import NDArray

import qddot

model: qddot.Model = qddot.load("m113")
shot: qddot.Signal = qddot.signal.pulse_train(times=[1.0], duration=0.1, impulse=605.0)
solution: qddot.Solution = qddot.simulate(model, (0, 10), method="dop853", rtol=1e-6, inputs={"F": shot})
pitch: NDArray[np.float64] = solution["pitch"]
again: qddot.Simulation = qddot.prepare(model, (0, 1), method="exact", inputs={"F": shot})
solution = again()
batch: qddot.Batch = qddot.simulate_batch(model, (0, 1), step=1e-3, output_times=11)
pitches: NDArray[np.float64] = batch["pitch"]
road: qddot.Signal = qddot.road.iso8608("E", seed=1)
inputs = qddot.drive(model, road, 5.0)
solution = qddot.simulate(model, (0, 1), step=1e-3, inputs=inputs, events=[qddot.crossing(model, "pitch")])
rest: NDArray[np.float64] = qddot.equilibrium(model)
frequencies = [mode.natural_frequency for mode in qddot.modes(model)]
study: qddot.Solution = qddot.run_study("study.toml")
"""


SLIPS = {
    "qddot.simulate(model, (0, 1), rtl=1e-3)": 'Unexpected keyword argument "rtl" for "simulate"; did you mean "rtol"?',
    "qddot.simulate_batch(model, (0, 1), refine=3)": 'Unexpected keyword argument "refine"',
    "qddot.road.iso8608('E')": 'Missing named argument "seed"',
    "qddot.simulat(model, (0, 1))": 'Module has no attribute "simulat"',
}

#: What a program gets from qddot is qddot's own and NumPy's: of other packages nothing is read, which takes longer.
SETTINGS = """
[mypy]
strict = True
ignore_missing_imports = True
follow_imports = silent
[mypy-dask.*,distributed.*,IPython.*,jinja2.*,llvmlite.*,matplotlib.*,numba.*,pint.*,rich.*,xarray.*,zarr.*]
follow_imports = skip
follow_imports_for_stubs = True
"""


def test_a_program_on_the_public_interface_passes_the_strict_checker_and_slips_do_not(tmp_path):
    """One run of the checker, which takes seconds: the slips stand behind the good program, a line each."""
    (tmp_path / "use.py").write_text(GOOD + "\n".join(SLIPS) + "\n")
    (tmp_path / "mypy.ini").write_text(SETTINGS)
    command = [sys.executable, "-m", "mypy", "--config-file", "mypy.ini"]
    command += ["--cache-dir", ROOT / ".mypy_cache" / "public", "use.py"]
    environment = os.environ | {"MYPYPATH": str(ROOT / ".types")}
    done = subprocess.run(
        command, cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=300, check=False
    )
    errors = [line for line in done.stdout.splitlines() if ": error: " in line]
    first = GOOD.count("\n") + 1
    assert len(errors) == len(SLIPS), done.stdout + done.stderr
    for number, (error, said) in enumerate(zip(errors, SLIPS.values(), strict=True)):
        assert error.startswith(f"use.py:{first + number}: ")
        assert said in error
