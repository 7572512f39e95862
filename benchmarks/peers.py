"""The same M113 case in other tools; each is imported where it is used, and one that is missing is named."""

import contextlib
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import sympy
from numpy.typing import NDArray

from generated import m113
from model.m113 import system

Run = Callable[[], NDArray[np.float64]]
PEAK = 605.0 * np.pi / 0.2
SHOT, DURATION = 0.5, 0.1


@dataclass(frozen=True, eq=False)
class Case:
    """Start (14,), constants c, phases (5,) of a sine road, its amplitude (m) and frequency (rad/s), ends of parts."""

    start: NDArray[np.float64]
    constants: NDArray[np.float64]
    phases: NDArray[np.float64]
    amplitude: float
    frequency: float
    edges: tuple[float, ...]


def contenders(case: Case, rtol: float, atol: float) -> tuple[dict[str, Run], dict[str, str]]:
    """Runs by name, and the reason why a tool does not take part."""
    runs: dict[str, Run] = {}
    missing: dict[str, str] = {}
    makers = {
        "heyoka taylor_adaptive": _heyoka,
        "numbalsoda dop853": _numbalsoda,
        "JiTCODE dop853": _jitcode,
    }
    for name, make in makers.items():
        try:
            runs[name] = make(case, rtol, atol)
        except Exception as error:  # whatever a foreign tool does, the others still run
            missing[name] = (
                f"does not take part: {type(error).__name__}: {str(error).splitlines()[0] if str(error) else ''}"
            )
    return runs, missing


def _accelerations(case: Case, names: list[Any], time: Any, peak: Any, sine: Any) -> list[Any]:
    """The seven accelerations in another tool's expressions, from T, Pi, Phi and Q of the model."""
    model = system()
    q, v = [c.symbol for c in model.coordinates], [c.rate for c in model.coordinates]
    values = {p.symbol: p.default for p in model.parameters}
    T, potential, phi = (
        model.written_out(e) for e in (model.kinetic_energy, model.potential_energy, model.dissipation)
    )
    forces = [model.written_out(model.force(c)) for c in model.coordinates]
    rows = [
        ((Q - potential.diff(c.symbol) - phi.diff(c.rate)) / T.diff(c.rate, 2)).subs(values).expand()
        for Q, c in zip(forces, model.coordinates, strict=True)
    ]
    road = [case.amplitude * sine(case.frequency * time + float(phase)) for phase in case.phases]
    recoil = peak * sine((time - SHOT) * (np.pi / DURATION))
    function = sympy.lambdify([*q, *v, *sympy.symbols("z_1:6"), sympy.Symbol("F")], rows, modules="math")
    return function(*names, *road, recoil)


def _heyoka(case: Case, rtol: float, atol: float) -> Run:
    import heyoka as hy

    x = hy.make_vars(*(f"x_{i}" for i in range(14)))
    rows = [*x[7:], *_accelerations(case, x, hy.time, hy.par[0], hy.sin)]
    integrator = hy.taylor_adaptive(list(zip(x, rows, strict=True)), case.start, tol=rtol, pars=[0.0])

    def run() -> NDArray[np.float64]:
        integrator.time = 0.0
        integrator.state[:] = case.start
        for k, edge in enumerate(case.edges):
            integrator.pars[0] = PEAK if k == 1 else 0.0
            integrator.propagate_until(edge)
        return integrator.state.copy()

    return run


def _numbalsoda(case: Case, rtol: float, atol: float) -> Run:
    import numbalsoda
    from numba import carray, cfunc

    rhs, constants, phases = m113.rhs, case.constants, case.phases
    amplitude, frequency = case.amplitude, case.frequency

    @cfunc(numbalsoda.lsoda_sig)
    def derivative(t, x_pointer, dx_pointer, p_pointer):
        x, dx, p = carray(x_pointer, (14,)), carray(dx_pointer, (14,)), carray(p_pointer, (1,))
        u = np.zeros(11)
        for i in range(5):
            u[i] = amplitude * np.sin(frequency * t + phases[i])
        u[5] = p[0] * np.sin(np.pi * (t - SHOT) / DURATION)
        rhs(t, x, u, constants, dx)

    def run() -> NDArray[np.float64]:
        x, t0 = case.start.copy(), 0.0
        for k, edge in enumerate(case.edges):
            peak = np.array([PEAK if k == 1 else 0.0])
            points, success = numbalsoda.dop853(
                derivative.address, x, np.array([t0, edge]), data=peak, rtol=rtol, atol=atol
            )
            if not success:
                raise RuntimeError("numbalsoda failed")
            x, t0 = points[-1].copy(), edge
        return x

    return run


def _jitcode(case: Case, rtol: float, atol: float) -> Run:
    import jitcode
    import symengine

    peak = symengine.Symbol("peak")
    rows = [jitcode.y(i) for i in range(7, 14)]
    rows += _accelerations(case, [jitcode.y(i) for i in range(14)], jitcode.t, peak, symengine.sin)
    ode = jitcode.jitcode(rows, n=14, control_pars=[peak], verbose=False)
    with tempfile.TemporaryDirectory() as elsewhere, contextlib.chdir(elsewhere):
        ode.compile_C()  # setuptools would take a pyproject.toml here for the extension's own

    def run() -> NDArray[np.float64]:
        x, t0 = case.start, 0.0
        for k, edge in enumerate(case.edges):
            ode.set_integrator("dop853", rtol=rtol, atol=atol, nsteps=100000)
            ode.set_parameters(PEAK if k == 1 else 0.0)
            ode.set_initial_value(x, t0)
            x, t0 = ode.integrate(edge), edge
        return np.array(x)

    return run
