"""Section 3.1 of the paper: its counts, the order of its errors, Euler's growth; and that the check can fail."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from commands import command

from qddot.paper.verification import REPORTED, verify
from qddot.paper.verification_figures import draw_errors, draw_schemes

ROOT = Path(__file__).parent.parent


@pytest.fixture(scope="module")
def as_run():
    return verify("as_run")


@pytest.fixture(scope="module")
def as_printed():
    return verify("as_printed")


def test_the_papers_counts(as_run):
    assert {scheme: as_run.row(scheme).points for scheme in REPORTED} == {"ODE23": 525, "ODE45": 637, "ODE15S": 449}


def test_every_claim_holds_as_run_and_none_of_the_counts_as_printed(as_run, as_printed):
    assert all(as_run.claims().values())
    printed = as_printed.claims()
    assert not any(holds for claim, holds in printed.items() if "points" in claim)


def test_errors_are_those_of_an_independent_reimplementation(as_run):
    for scheme, error in {"ODE45": 1.35e-5, "ODE15S": 3.9e-5, "ODE23": 7.8e-5}.items():
        assert as_run.row(scheme).largest_error == pytest.approx(error, rel=0.02)


def test_fixed_step_schemes_err_as_theory_says(as_run):
    """Euler multiplies the amplitude by sqrt(1 + (h omega)^2) a step; the classical method errs by (h omega)^5/120."""
    omega = 2 * np.pi / as_run.period
    swing = 9.81 / omega**2
    growth = (1 + (1e-4 * omega) ** 2) ** 5000
    assert as_run.row("Euler").largest_error == pytest.approx(swing * (growth - 1), rel=0.02)
    assert as_run.row("Runge-Kutta").largest_error == pytest.approx(swing * 1e4 * (1e-4 * omega) ** 5 / 120, rel=0.05)


def test_a_claim_that_does_not_hold_is_told(as_run):
    worse = [replace(row, error=row.error * 1e3) if row.scheme == "ODE45" else row for row in as_run.rows]
    claims = replace(as_run, rows=tuple(worse)).claims()
    assert not claims["modified Euler, Runge-Kutta and ODE45 err least, then ODE15S, ODE23 most (Fig. 3)"]
    flat = [replace(row, error=np.ones_like(row.error)) if row.scheme == "Euler" else row for row in as_run.rows]
    assert not replace(as_run, rows=tuple(flat)).claims()["the error of Euler's method grows monotonically (Fig. 2)"]


def test_figures_are_drawn(as_run, tmp_path):
    for draw in (draw_schemes, draw_errors):
        assert draw(as_run, tmp_path / "figure.png").read_bytes().startswith(b"\x89PNG")


def test_the_command_prints_json_and_exits_with_0():
    done = command("verify", "--json", afresh=True)
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert all(found["claims"].values())
    points = {row["scheme"]: row["points"] for row in found["tables"]["as_run"]}
    assert (points["ODE23"], points["ODE45"], points["ODE15S"]) == (525, 637, 449)
