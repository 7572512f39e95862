"""Thousands of runs: M113 over a sine road and over a table, one shot each, and double pendulums; beside other tools.

Every run has a speed, a shot time and a hull mass of its own. Times are those of one run: the whole call divided by the
number of runs, set-up and results included, on two threads. Errors are the largest over 16 runs of the displacements at
the end, relative to the largest displacement, against SciPy's DOP853 at 1e-13.
"""

import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

import qddot
from benchmarks.batch_peers import (
    AMPLITUDE,
    DURATION,
    IMPULSE,
    THREADS,
    WAVELENGTH,
    Drives,
    Run,
    diffrax_rk4,
    heyoka_drives,
    heyoka_pendulums,
    place_of_axles,
    scalar_rk4,
    those_that_run,
)
from benchmarks.timing import Timing, interleaved
from codegen.lagrange import derive
from codegen.lower import lower
from codegen.sources import shipped
from generated import m113

END, STEP, WANTED = 2.0, 1e-4, 1e-8
PENDULUM_END, PENDULUM_ERROR = 10.0, 1e-9
CHECKED = 16
TOLERANCES = 10.0 ** np.arange(-6, -14.1, -0.5)


def groups(quick: bool) -> dict[str, list[Timing]]:
    """All batches; a contender that does not import is named with its reason."""
    runs, repeats = (512, 2) if quick else (10_000, 5)
    model = qddot.load("m113")
    drives = make_drives(model, runs)
    return {
        "M113, RK4 batch, step 1e-4, 2 s, seconds a run": _rk4(model, drives, quick),
        "M113, batch at error 1e-8, 2 s, seconds a run": _at_equal_error(model, drives, repeats),
        "double pendulums, batch at error 1e-9, 10 s, seconds a run": _pendulums(runs, repeats),
    }


def make_drives(model: object, runs: int) -> Drives:
    """The runs: speeds from 3 to 8 m/s, shots from 0.1 to 1.5 s, hulls from 9 to 12 t, at random."""
    rng = np.random.default_rng(11)
    speeds, shots, masses = rng.uniform(3, 8, runs), rng.uniform(0.1, 1.5, runs), rng.uniform(9e3, 12e3, runs)
    p = np.tile(model.parameter_values("as_run_unloaded"), (runs, 1))  # type: ignore[attr-defined]
    p[:, [row[0] for row in m113.PARAMETER].index("m_6")] = masses
    rest = qddot.simulate_batch(model, (0, 1e-3), step=1e-3, parameters=p, samples=[0.0])
    c = np.array([model.constants(each) for each in p])  # type: ignore[attr-defined]
    return Drives(END, speeds, shots, masses, place_of_axles(), rest.samples[:, 0].copy(), c)


def ours(model: object, drives: Drives, road: object = None, **settings: object) -> Run:
    """The batch by qddot, from equilibrium to the final states."""
    shot = qddot.pulse_train(times=[0.0], duration=DURATION, impulse=IMPULSE)
    road = road or qddot.sine(AMPLITUDE, 1 / WAVELENGTH)
    inputs = {f"z_{i + 1}": qddot.per_run(road, drives.speeds, -place) for i, place in enumerate(drives.places)}
    inputs["F"] = qddot.per_run(shot, offset=-drives.shots)
    parameters = ("as_run_unloaded", {"m_6": drives.masses})

    def run() -> NDArray[np.float64]:
        given = {"parameters": parameters, "inputs": inputs, "initial": drives.starts, "threads": THREADS}
        batch = qddot.simulate_batch(model, (0, drives.end), **given, **settings)
        if not (batch.in_lanes and batch.success.all()):
            raise RuntimeError("a run failed, or did not go in lanes")
        return batch.final

    return run


def _rk4(model: object, drives: Drives, quick: bool) -> list[Timing]:
    few = drives.first(64 if quick else 400)
    whole = few if quick else drives
    runs: dict[str, tuple[Run, int]] = {
        f"qddot rk4 in lanes, {len(whole.speeds)} runs": (
            ours(model, whole, method="rk4", step=STEP),
            len(whole.speeds),
        ),
        f"qddot scalar kernel under prange, {len(few.speeds)} runs": (scalar_rk4(few, STEP), len(few.speeds)),
    }
    peers, missing = those_that_run({f"diffrax vmap, {len(few.speeds)} runs": lambda: diffrax_rk4(few, STEP)})
    runs |= {name: (run, len(few.speeds)) for name, run in peers.items()}
    rows = _per_run({name: run for name, (run, _) in runs.items()}, {n: k for n, (_, k) in runs.items()}, 2)
    peak, work = dgemm_peak(), flops_of_step() * END / STEP
    share = f"{work / rows[0].least / 1e9:.3g} Gflop/s, {work / rows[0].least / peak:.1%} of dgemm's {peak / 1e9:.0f}"
    rows[0] = replace(rows[0], note=f"{rows[0].least / (END / STEP) * 1e9:.1f} ns a step; {share}")
    return rows + [Timing(name, np.nan, np.nan, reason) for name, reason in missing.items()]


def _at_equal_error(model: object, drives: Drives, repeats: int) -> list[Timing]:
    few = drives.first(CHECKED)
    exact = np.array([_reference(few, run) for run in range(CHECKED)])
    scale = np.abs(exact[:, :7] - few.starts[:, :7]).max()

    def error(final: NDArray[np.float64]) -> float:
        return float(np.abs(final[:CHECKED, :7] - exact[:, :7]).max() / scale)

    places = np.linspace(-10, 40, 10_000)
    table = qddot.table(places, AMPLITUDE * np.sin(2 * np.pi / WAVELENGTH * places), kind="cubic")
    makers: dict[str, Callable[[Drives, float], Run]] = {
        f"qddot {name}": lambda d, tol, name=name: ours(model, d, method=name, rtol=tol, atol=1e-3 * tol)
        for name in ("dop853", "vern7", "tsit5")
    }
    makers["qddot dop853, road of 10 000 points"] = lambda d, tol: ours(
        model, d, road=table, method="dop853", rtol=tol, atol=1e-3 * tol
    )
    makers["heyoka batch"] = heyoka_drives
    return _compared(makers, drives, few, error, WANTED, repeats)


def _compared(makers, drives, few, error, wanted, repeats):
    """Every contender at the loosest tolerance that gives the wanted error."""
    size = len(drives.speeds if isinstance(drives, Drives) else drives)
    runs, notes, missing = {}, {}, {}
    for name, make in makers.items():
        try:
            for tolerance in TOLERANCES:
                found = error(make(few, tolerance)())
                if found <= wanted:
                    break
            runs[name], notes[name] = make(drives, tolerance), f"error {found:.1e} at tolerance {tolerance:.0e}"
        except Exception as problem:  # a tool that is missing or fails does not stop the others
            missing[name] = f"does not take part: {type(problem).__name__}: {problem}"
    rows = [replace(each, note=notes[each.name]) for each in _per_run(runs, dict.fromkeys(runs, size), repeats)]
    return rows + [Timing(name, np.nan, np.nan, reason) for name, reason in missing.items()]


def _pendulums(runs: int, repeats: int) -> list[Timing]:
    model, rng = qddot.load("double_pendulum"), np.random.default_rng(4)
    starts = rng.uniform(-0.7, 0.7, (runs, 4))
    few = starts[:CHECKED]
    settings = {"method": "DOP853", "rtol": 3e-14, "atol": 1e-15}
    c = model.constants(model.parameter_values())
    exact = np.array([solve_ivp(_derivative(model, c), (0, PENDULUM_END), x, **settings).y[:, -1] for x in few])

    def error(final: NDArray[np.float64]) -> float:
        return float(np.abs(final[:CHECKED, :2] - exact[:, :2]).max())

    def lanes(x: NDArray[np.float64], method: str, tolerance: float) -> Run:
        given = {"method": method, "rtol": tolerance, "atol": tolerance, "initial": x, "threads": THREADS}
        return lambda: qddot.simulate_batch(model, (0, PENDULUM_END), **given).final

    makers = {f"qddot {name}": lambda x, tol, name=name: lanes(x, name, tol) for name in ("dop853", "vern7", "tsit5")}
    makers["heyoka batch"] = lambda x, tol: heyoka_pendulums(x, PENDULUM_END, tol)
    return _compared(makers, starts, few, error, PENDULUM_ERROR, repeats)


def _derivative(model: object, c: NDArray[np.float64]) -> Callable[..., NDArray[np.float64]]:
    rhs = model.kernel("rhs")  # type: ignore[attr-defined]

    def derivative(t: float, x: NDArray[np.float64]) -> NDArray[np.float64]:
        dx = np.empty(len(x))
        rhs(t, x, np.zeros(11), c, dx)
        return dx

    return derivative


def _reference(drives: Drives, run: int) -> NDArray[np.float64]:
    """The final state of a run by SciPy's DOP853 at 1e-13, restarted at the edges of the pulse."""
    rhs, c, shot = m113.rhs, drives.constants[run], drives.shots[run]
    u, dx, x, t0 = np.zeros(11), np.empty(14), drives.starts[run], 0.0
    for part, t1 in enumerate((shot, shot + DURATION, drives.end)):

        def derivative(t: float, x: NDArray[np.float64], part: int = part) -> NDArray[np.float64]:
            u[:5] = AMPLITUDE * np.sin(2 * np.pi / WAVELENGTH * (drives.speeds[run] * t - drives.places))
            peak = IMPULSE * np.pi / (2 * DURATION)
            u[5] = peak * np.sin(np.pi * (t - shot) / DURATION) if part == 1 else 0.0
            rhs(t, x, u, c, dx)
            return dx.copy()

        x = solve_ivp(derivative, (t0, t1), x, method="DOP853", rtol=1e-13, atol=1e-15).y[:, -1]
        t0 = t1
    return x


def _per_run(runs: dict[str, Run], counts: dict[str, int], repeats: int) -> list[Timing]:
    timings = interleaved(runs, repeats)
    return [replace(t, least=t.least / counts[t.name], median=t.median / counts[t.name]) for t in timings]


def dgemm_peak() -> float:
    """Floating-point operations a second of the BLAS that NumPy has, on a product of two square matrices."""
    n = 1500
    a, b = np.random.default_rng(0).random((2, n, n))
    best = np.inf
    for _ in range(8):
        start = time.perf_counter()
        a @ b
        best = min(best, time.perf_counter() - start)
    return 2 * n**3 / best


def flops_of_step() -> int:
    """Operations of an RK4 step of the M113: four right-hand sides and the sums over 14 states; inputs not counted."""
    rhs = lower(derive(shipped("m113"))).kernels["rhs"].operations
    return 4 * rhs + 14 * (3 * 3 + 9)
