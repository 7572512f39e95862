"""The M113 standing and driving for 10 s with one shot at 0.5 s: one run, beside heyoka, numbalsoda, JiTCODE, SciPy.

Every contender is prepared beforehand and timed from a given state to the end; it restarts at the two edges of the
pulse (ours finds them by itself). Errors are those of the displacements at the end, relative to the largest
displacement from rest, against SciPy's DOP853 at 1e-13.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

import qddot
from benchmarks.peers import Case, contenders
from benchmarks.timing import Timing, interleaved
from generated import m113
from runner.methods import METHODS

RTOL, ATOL = 1e-6, 1e-9
SHOT, DURATION, IMPULSE = 0.5, 0.1, 605.0
END = 10.0
AMPLITUDE, WAVELENGTH, SPEED = 0.05, 3.0, 5.56

#: Our methods that are no match for this problem at 1e-6 and only lengthen the table.
_SLOW = ("ode23", "rodas5p", "ode15s")


def groups(quick: bool) -> dict[str, list[Timing]]:
    """Standing and driving; a contender that does not import is named with its reason."""
    model = qddot.load("m113")
    constants = model.constants(model.parameter_values("as_run_unloaded"))
    start = qddot.equilibrium(model, "as_run_unloaded")
    found = {}
    for name, amplitude in (("standing", 0.0), ("driving", AMPLITUDE)):
        case = Case(
            start, constants, _phases(model), amplitude, 2 * np.pi * SPEED / WAVELENGTH, (SHOT, SHOT + DURATION, END)
        )
        found[f"M113 {name}, 10 s, one run, rtol {RTOL:g}"] = _compared(model, case, quick)
    return found


def _compared(model: object, case: Case, quick: bool) -> list[Timing]:
    reference = _scipy(case, 1e-13, 1e-15)()
    scale = np.abs(reference[:7] - case.start[:7]).max()
    runs: dict[str, Callable[[], NDArray[np.float64]]] = {}
    for name, method in METHODS.items():
        if (method.adaptive or method.family == "exact") and name not in _SLOW:
            runs[f"qddot {name}"] = _ours(model, case, name)
    runs["SciPy DOP853, numba rhs"] = _scipy(case, RTOL, ATOL)
    peers, missing = contenders(case, RTOL, ATOL)
    runs |= peers
    errors = {name: np.abs(run()[:7] - reference[:7]).max() / scale for name, run in runs.items()}
    timings = interleaved(runs, 3 if quick else 15)
    rows = [replace(each, note=f"error {errors[each.name]:.1e}") for each in sorted(timings, key=lambda t: t.least)]
    return rows + [Timing(name, np.nan, np.nan, reason) for name, reason in missing.items()]


def _phases(model: object) -> NDArray[np.float64]:
    """Phase of the road under each axle in rad; the axles' places are the model's own constants a_i."""
    names = m113.CONSTANT
    constants = model.constants(model.parameter_values("as_run_unloaded"))  # type: ignore[attr-defined]
    return np.array([-2 * np.pi * constants[names.index(f"a_{i}")] / WAVELENGTH for i in range(1, 6)])


def _ours(model: object, case: Case, method: str) -> Callable[[], NDArray[np.float64]]:
    shot = qddot.pulse_train(times=[SHOT], duration=DURATION, impulse=IMPULSE)
    roads = {
        f"z_{i + 1}": qddot.sine(case.amplitude, case.frequency / (2 * np.pi), phase)
        for i, phase in enumerate(case.phases)
    }
    settings = {"parameters": "as_run_unloaded", "initial": case.start, "inputs": {"F": shot, **roads}}

    simulation = qddot.prepare(model, (0, END), method=method, rtol=RTOL, atol=ATOL, output_times=[END], **settings)
    return lambda: simulation(case.start).states[-1]


def _scipy(case: Case, rtol: float, atol: float) -> Callable[[], NDArray[np.float64]]:
    rhs = m113.rhs
    start, constants, phases, amplitude, frequency = (
        case.start,
        case.constants,
        case.phases,
        case.amplitude,
        case.frequency,
    )

    @njit
    def derivative(t, x, peak):
        u, dx = np.zeros(11), np.empty(14)
        for i in range(5):
            u[i] = amplitude * np.sin(frequency * t + phases[i])
        u[5] = peak * np.sin(np.pi * (t - SHOT) / DURATION)
        rhs(t, x, u, constants, dx)
        return dx

    def run() -> NDArray[np.float64]:
        x, t0 = start, 0.0
        for k, t1 in enumerate(case.edges):
            peak = IMPULSE * np.pi / (2 * DURATION) if k == 1 else 0.0
            x = solve_ivp(derivative, (t0, t1), x, method="DOP853", rtol=rtol, atol=atol, args=(peak,)).y[:, -1]
            t0 = t1
        return x

    return run
