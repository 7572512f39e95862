"""The M113 over a sine road, one shot in each run."""

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import sympy
from numba import njit

import qddot
from benchmarks.cases.case import Case, Floats
from benchmarks.cases.reference import by_scipy
from qddot.model.m113 import system
from qddot.runner.load import Model

DURATION, IMPULSE, WAVELENGTH, AMPLITUDE = 0.1, 605.0, 3.0, 0.05
PEAK = IMPULSE * np.pi / (2 * DURATION)
PARAMETERS = "as_run_unloaded"


def ride(model: Model, amplitude: float, end: float = 10.0) -> Case:
    """One run at 5.56 m/s with a shot at 0.5 s; standing where the road has no amplitude."""
    p = model.parameter_values(PARAMETERS)
    mass = p[_parameter(model, "m_6")]
    start = qddot.equilibrium(model, PARAMETERS)
    return _case(model, amplitude, end, start[None], p[None], np.array([[5.56, 0.5, 1 / mass]]))


def drives(model: Model, runs: int, end: float = 2.0) -> Case:
    """Runs with speeds from 3 to 8 m/s, shots from 0.1 to 1.5 s, hulls from 9 to 12 t, at random."""
    rng = np.random.default_rng(11)
    speeds, shots, masses = rng.uniform(3, 8, runs), rng.uniform(0.1, 1.5, runs), rng.uniform(9e3, 12e3, runs)
    p = np.tile(model.parameter_values(PARAMETERS), (runs, 1))
    p[:, _parameter(model, "m_6")] = masses
    rest = qddot.simulate_batch(model, (0, 1e-3), step=1e-3, parameters=p, output_times=[0.0])
    return _case(model, AMPLITUDE, end, rest.samples[:, 0], p, np.column_stack([speeds, shots, 1 / masses]))


def batch_keywords(case: Case, road: Any = None) -> dict[str, Any]:
    """What `simulate_batch` takes for these drives, over a road of one's own if wanted."""
    road = road or qddot.signal.sine(AMPLITUDE, 1 / WAVELENGTH)
    speeds, shots, inverse_masses = case.given.T
    inputs = {f"z_{i + 1}": qddot.per_run(road, speeds, -place) for i, place in enumerate(places(case.model))}
    inputs["F"] = qddot.per_run(_shot(0.0), offset=-shots)
    return {"parameters": (PARAMETERS, {"m_6": 1 / inverse_masses}), "inputs": inputs}


def places(model: Model) -> list[float]:
    """Places a_i of the axles behind the origin, the model's own constants, in m."""
    c = model.constants(model.parameter_values(PARAMETERS))
    return [float(c[model.tables.constant_names.index(f"a_{i}")]) for i in range(1, 6)]


def _case(model: Model, amplitude: float, end: float, starts: Floats, p: Floats, given: Floats) -> Case:
    shots, axles = given[:, 1], places(model)
    return Case(
        model=model,
        starts=np.ascontiguousarray(starts),
        constants=np.array([model.constants(each) for each in p]),
        given=given,
        parts=((shots, 0.0), (shots + DURATION, PEAK), (np.full(len(given), end), 0.0)),
        equations=_equations(amplitude, axles),
        inputs=_inputs(amplitude, tuple(axles)),
        one=lambda case: _one(case, amplitude),
        many=batch_keywords,
        solution=by_scipy,
        atol=1e-3,
    )


def _one(case: Case, amplitude: float) -> dict[str, Any]:
    speed, shot, _ = case.given[0]
    rate = speed / WAVELENGTH
    inputs = {
        f"z_{i + 1}": qddot.signal.sine(amplitude, rate, -2 * np.pi * place / WAVELENGTH)
        for i, place in enumerate(places(case.model))
    }
    return {"parameters": PARAMETERS, "inputs": inputs | {"F": _shot(shot)}}


def _shot(at: float) -> Any:
    return qddot.signal.pulse_train(times=[at], duration=DURATION, impulse=IMPULSE)


def _parameter(model: Model, name: str) -> int:
    return [parameter.name for parameter in model.tables.parameters].index(name)


def _equations(amplitude: float, axles: list[float]) -> Callable[..., Any]:
    wave = 2 * np.pi / WAVELENGTH

    def equations(t: Any, q: Any, v: Any, peak: Any, given: Any, f: Any) -> tuple[None, list[Any]]:
        speed, shot, inverse_mass = given
        road = [amplitude * f.sin(wave * (speed * t - place)) if amplitude else 0.0 for place in axles]
        force = peak * f.sin((t - shot) * (np.pi / DURATION))
        return None, list(_accelerations()(*q, *v, *road, force, inverse_mass))

    return equations


@cache
def _accelerations() -> Callable[..., Any]:
    """Accelerations of states, road heights, recoil force and inverse hull mass, from T, Pi, Phi and Q by SymPy."""
    model, inverse = system(), sympy.Symbol("inverse_mass")
    q, v = [c.symbol for c in model.coordinates], [c.rate for c in model.coordinates]
    T, potential, phi = map(model.written_out, (model.kinetic_energy, model.potential_energy, model.dissipation))
    values = {p.symbol: p.default for p in model.parameters}
    values |= {symbol: value for symbol, value in model.parameter_sets[PARAMETERS].items()}
    values[sympy.Symbol("m_6")] = 1 / inverse
    rows = [
        ((model.written_out(model.force(c)) - potential.diff(c.symbol) - phi.diff(c.rate)) / T.diff(c.rate, 2))
        .subs(values)
        .expand()
        for c in model.coordinates
    ]
    arguments = [*q, *v, *sympy.symbols("z_1:6"), sympy.Symbol("F"), inverse]
    return sympy.lambdify(arguments, rows, modules="math")


def _inputs(amplitude: float, axles: tuple[float, ...]) -> Any:
    wave = 2 * np.pi / WAVELENGTH

    @njit(fastmath={"contract", "nsz"})
    def inputs(t, peak, given, u):
        for i in range(5):
            u[i] = amplitude * np.sin(wave * (given[0] * t - axles[i]))
        u[5] = peak * np.sin((t - given[1]) * (np.pi / DURATION))

    return inputs
