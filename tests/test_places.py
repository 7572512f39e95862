"""A method, a signal, a shape, a road, a metric and a command are added in one place each, as docs/house.md says."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent

#: A new file, or a function behind those that a file has.
ADDED = {
    "runner/tableaux/pages/ralston.py": '''"""Ralston's method, of the least error among those of two stages."""

from fractions import Fraction as Q

from qddot.runner.tableaux.butcher import ButcherTableau

METHOD = ButcherTableau(
    name="ralston",
    order=2,
    c=[0, Q(2, 3)],
    A=[[], [Q(2, 3)]],
    b=[Q(1, 4), Q(3, 4)],
    citation="A. Ralston, Runge-Kutta methods with minimum error bounds, Math. Comp. 16 (1962) 431-437",
)
''',
    "runner/inputs/shapes.py": '''

def swell(amplitude: Value, frequency: Frequency) -> Signal:
    """amplitude*(1 - cos(2 pi frequency t)): it begins at rest."""
    return sine(amplitude, frequency, -np.pi / 2, amplitude)
''',
    "runner/inputs/roads.py": '''

def kerb(height: Length, at: Length, top: Length = 0.3) -> Signal:
    """Up by `height` at `at`, and down again behind its top."""
    return pothole(-height, top, at)
''',
    "runner/metrics/values.py": '''

@metric("mean_square", "({})^2")
def mean_square(samples, first, stop, t0, h, p):
    """Mean of the square over the samples."""
    total = 0.0
    for i in range(first, stop):
        total += samples[i] ** 2
    return total / (stop - first)
''',
    "qddot/commands/greet.py": '''"""`qddot greet`."""

from qddot.command import Command, argument


def greet(name: str) -> int:
    """Print a greeting."""
    print(f"good day, {name}")
    return 0


COMMAND = Command(greet, "Greet somebody.", (argument("name", metavar="NAME"),))
''',
}

USED = """
import contextlib, io, sys
import numpy as np
from scipy.integrate import solve_ivp
import qddot
from qddot.command_line import main

STUDY = 'model = "quarter_car"\\nspan = [0, 1]\\n[integration]\\nmethod = "ralston"\\nstep = 1e-4\\n'
INPUT = '[inputs.z_r]\\nkind = "swell"\\namplitude = "2 cm"\\nfrequency = "1.5 Hz"\\n'
ROAD = '[road]\\nkind = "kerb"\\nheight = "5 cm"\\nat = 2\\nspeed = "36 km/h"\\n'


def by_hand(z_r, kinks):
    def rhs(t, x):
        force = 16000 * (x[0] - x[1]) + 1000 * (x[2] - x[3])
        return [x[2], x[3], -force / 250, (force - 160000 * (x[1] - z_r(t))) / 40]
    x, ends = np.zeros(4), [0.0, *kinks, 1.0]
    for t0, t1 in zip(ends, ends[1:]):
        inside = np.nextafter(t0, t1), np.nextafter(t1, t0)
        x = solve_ivp(lambda t, x: rhs(min(max(t, inside[0]), inside[1]), x), (t0, t1), x, "DOP853", rtol=1e-11,
                      atol=1e-12).y[:, -1]
    return x


cases = {
    INPUT: (lambda t: 0.02 * (1 - np.cos(3 * np.pi * t)), ()),
    ROAD: (lambda t: 0.05 if 0.2 <= t < 0.23 else 0.0, (0.2, 0.23)),
}
for text, (z_r, kinks) in cases.items():
    open("study.toml", "w").write(STUDY + text)
    run = qddot.run_study("study.toml")
    np.testing.assert_allclose(run.states[-1], by_hand(z_r, kinks), atol=2e-6)
    found = qddot.metric(run, "mean_square", "z_s")
    np.testing.assert_allclose(found, np.mean(run["z_s"] ** 2), rtol=1e-12)


def said(*words):
    sys.argv = ["qddot", *words]
    with contextlib.redirect_stdout(io.StringIO()) as out, contextlib.suppress(SystemExit):
        main()
    return out.getvalue()


assert said("greet", "Lagrange") == "good day, Lagrange\\n"
assert "Greet somebody." in said("--help")
assert "ralston" in said("list", "methods") and "mean_square" in said("list", "metrics")
assert '"swell"' in said("schema") and '"kerb"' in said("schema")
"""


@pytest.mark.slow
def test_one_place_is_enough(tmp_path):
    copy = tmp_path / "qddot"
    left_out = shutil.ignore_patterns(
        ".venv", ".git", "*.nb[ci]*", "*.pyc.*", "results", ".*_cache", ".hypothesis", "docs", "tests"
    )
    shutil.copytree(ROOT, copy, symlinks=True, ignore=left_out)
    for name, text in ADDED.items():
        with (copy / name).open("a", encoding="utf-8") as file:
            file.write(text)
    done = subprocess.run(
        [sys.executable, "-P", "-c", USED], cwd=copy, env={**os.environ, "PYTHONPATH": str(copy / ".types")},
        capture_output=True, text=True, timeout=600, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert str(copy) not in done.stdout + done.stderr


def test_the_house_names_these_places():
    told = (ROOT / "docs" / "house.md").read_text()
    for name in ADDED:
        assert f"`{name}`" in told or f"`{Path(name).parent}/`" in told, name
