"""What README tells people to type works, and gives what README shows."""

import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from netCDF4 import Dataset
from readme import README, block
from scipy.integrate import solve_ivp

ROOT = Path(__file__).parent.parent


def qddot(*arguments, cwd):
    command = [sys.executable, "-m", "qddot", *arguments]
    return subprocess.run(command, capture_output=True, text=True, cwd=cwd, timeout=300, check=False)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("own")
    (folder / "duffing.py").write_text(block("duffing.py", "python"))
    (folder / "shaken.toml").write_text(block("shaken.toml", "toml"))
    done = qddot("generate", "duffing.py", "--into", "kernels", cwd=folder)
    assert done.returncode == 0, done.stderr
    return folder


def test_the_model_of_ones_own_runs_and_agrees_with_scipy(folder):
    done = qddot("run", "shaken.toml", cwd=folder)
    assert done.returncode == 0, done.stderr
    with Dataset(folder / "results" / "shaken.nc") as file:
        t, x = file["time"][:], file["x"][:]
    m, k, k_3, c = 2.5, 400.0, 4e4, 1.5

    def rhs(time, state):
        s = state[0] - 0.02 * np.sin(5 * np.pi * time)
        sdot = state[1] - 0.02 * 5 * np.pi * np.cos(5 * np.pi * time)
        return [state[1], -(k * s + k_3 * s**3 + c * sdot) / m]

    expected = solve_ivp(rhs, (0, 5), [0, 0], method="DOP853", rtol=1e-11, atol=1e-13, t_eval=t[t <= 5])
    assert np.abs(x[t <= 5] - expected.y[0]).max() < 1e-6


def test_the_slips_give_the_messages_shown(folder):
    study = (folder / "shaken.toml").read_text()
    model = (folder / "duffing.py").read_text()
    (folder / "slip").mkdir(exist_ok=True)
    (folder / "slip" / "duffing.py").write_text(model.replace("k_3 * s**4", 'Symbol("k_33") * s**4'))
    (folder / "unit.toml").write_text(study.replace("2500 g", "2500 mm"))
    (folder / "coarse.toml").write_text(study.replace('"rk4"', '"euler"').replace("1 ms", "50 ms"))
    found = [
        qddot("generate", "duffing.py", "--into", "kernels", cwd=folder / "slip").stderr,
        qddot("run", "unit.toml", cwd=folder).stderr.replace("unit.toml", "shaken.toml"),
        qddot("run", "coarse.toml", cwd=folder).stderr,
    ]
    shown = " ".join(README.split())
    for message in found:
        assert message.startswith("error: ")
        assert " ".join(message.split()) in shown


def test_the_commands_shown_exist():
    targets = set(re.findall(r"^([a-z]+):", (ROOT / "Makefile").read_text(), re.MULTILINE))
    assert set(re.findall(r"\bmake ([a-z]+)", README)) <= targets


def test_the_python_shown_is_the_public_interface():
    import qddot as front

    for name in set(re.findall(r"\bqddot\.([A-Za-z_]+)", README)) - {"py", "model", "runner"}:  # rooms
        assert name in front.__all__, name


def test_every_file_linked_is_there():
    for target in re.findall(r"\]\(([^)#]+)\)", README):
        assert target.startswith("http") or os.path.exists(ROOT / target), target


def test_the_generated_kernel_shown_is_the_one_checked_in():
    kernel = README.split("```python\n@njit")[1].split("```")[0]
    assert "@njit" + kernel.rstrip() in (ROOT / "generated" / "quarter_car.py").read_text()
