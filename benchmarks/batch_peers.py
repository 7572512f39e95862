"""The same batches in other tools; each is imported where it is used, and one that is missing is named."""

from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np
import sympy
from numba import njit, prange
from numpy.typing import NDArray

from generated import m113
from model.m113 import system

Run = Callable[[], NDArray[np.float64]]
DURATION, IMPULSE, WAVELENGTH, AMPLITUDE = 0.1, 605.0, 3.0, 0.05
PEAK = IMPULSE * np.pi / (2 * DURATION)
THREADS = 2


@dataclass(frozen=True, eq=False)
class Drives:
    """Runs of the M113 over a sine road: speeds, shot times, hull masses (runs,), starts and constants a row each."""

    end: float
    speeds: NDArray[np.float64]
    shots: NDArray[np.float64]
    masses: NDArray[np.float64]
    places: NDArray[np.float64]
    starts: NDArray[np.float64]
    constants: NDArray[np.float64]

    def first(self, runs: int) -> "Drives":
        """The first of these runs."""
        rows = (each[:runs] for each in (self.speeds, self.shots, self.masses))
        return Drives(self.end, *rows, self.places, self.starts[:runs], self.constants[:runs])


@njit(fastmath={"contract", "nsz"})
def _inputs(t, speed, shot, places, u):
    for i in range(5):
        u[i] = AMPLITUDE * np.sin(2 * np.pi / WAVELENGTH * (speed * t - places[i]))
    inside = shot <= t < shot + DURATION
    u[5] = PEAK * np.sin(np.pi * (t - shot) / DURATION) if inside else 0.0


@njit(parallel=True, fastmath={"contract", "nsz"})
def _march(starts, constants, speeds, shots, places, step, count, final):
    for run in prange(len(starts)):
        x, c, n = starts[run].copy(), constants[run], starts.shape[1]
        u = np.zeros(11)
        k1, k2, k3, k4, y = np.empty(n), np.empty(n), np.empty(n), np.empty(n), np.empty(n)
        _inputs(0.0, speeds[run], shots[run], places, u)
        for k in range(count):
            t = k * step
            m113.rhs(t, x, u, c, k1)
            for i in range(n):
                y[i] = x[i] + 0.5 * step * k1[i]
            _inputs(t + 0.5 * step, speeds[run], shots[run], places, u)
            m113.rhs(t, y, u, c, k2)
            for i in range(n):
                y[i] = x[i] + 0.5 * step * k2[i]
            m113.rhs(t, y, u, c, k3)
            for i in range(n):
                y[i] = x[i] + step * k3[i]
            _inputs(t + step, speeds[run], shots[run], places, u)
            m113.rhs(t, y, u, c, k4)
            for i in range(n):
                x[i] += step / 6 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i])
        final[run] = x


def scalar_rk4(drives: Drives, step: float) -> Run:
    """Our own scalar kernel in a loop over runs by numba's prange."""
    final = np.empty_like(drives.starts)
    count = round(drives.end / step)

    def run() -> NDArray[np.float64]:
        _march(drives.starts, drives.constants, drives.speeds, drives.shots, drives.places, step, count, final)
        return final

    return run


def heyoka_drives(drives: Drives, tolerance: float) -> Run:
    """Heyoka's batch mode, a batch a thread at a time; every lane restarts at the edges of its pulse."""
    import heyoka as hy

    x = hy.make_vars(*(f"x_{i}" for i in range(14)))
    rows = [*x[7:], *_accelerations(x, hy)]
    width = hy.recommended_simd_size()
    make = hy.taylor_adaptive_batch(
        list(zip(x, rows, strict=True)), np.zeros((14, width)), tol=tolerance, pars=np.zeros((4, width))
    )
    copies = [make.__copy__() for _ in range(THREADS)]
    chunks = [np.arange(i, i + width) % len(drives.speeds) for i in range(0, len(drives.speeds), width)]
    final = np.empty_like(drives.starts)

    def work(thread: int) -> None:
        integrator = copies[thread]
        for chosen in chunks[thread::THREADS]:
            integrator.set_time(0.0)
            integrator.state[:] = drives.starts[chosen].T
            shots = drives.shots[chosen]
            for peak, until in ((0.0, shots), (PEAK, shots + DURATION), (0.0, np.full(width, drives.end))):
                integrator.pars[:] = [np.full(width, peak), drives.speeds[chosen], 1 / drives.masses[chosen], shots]
                integrator.propagate_until(until)
            final[chosen] = integrator.state.T

    return _on_threads(work, final)


def _on_threads(work: Callable[[int], None], final: NDArray[np.float64]) -> Run:
    pool = ThreadPoolExecutor(THREADS)

    def run() -> NDArray[np.float64]:
        list(pool.map(work, range(THREADS)))
        return final

    return run


def _accelerations(x: Any, hy: Any) -> list[Any]:
    """The seven accelerations in heyoka's expressions; parameters: peak, speed, inverse hull mass, shot time."""
    peak, speed, inverse_mass, shot = hy.par[0], hy.par[1], hy.par[2], hy.par[3]
    return _lambdified("math", place_of_axles())(
        *x,
        *(
            AMPLITUDE * hy.sin((2 * np.pi / WAVELENGTH) * (speed * hy.time - float(place)))
            for place in place_of_axles()
        ),
        peak * hy.sin((hy.time - shot) * (np.pi / DURATION)),
        inverse_mass,
    )


def place_of_axles() -> NDArray[np.float64]:
    """The model's own constants a_i, (5,)."""
    values = {p.symbol.name: float(p.default) for p in system().parameters}
    c, p = np.zeros(len(m113.CONSTANT)), np.array([values[row[0]] for row in m113.PARAMETER])
    m113.constants.py_func(p, c)
    return c[[m113.CONSTANT.index(f"a_{i}") for i in range(1, 6)]]


def _lambdified(modules: str, places: NDArray[np.float64]) -> Callable[..., Any]:
    """Accelerations of states, road heights, recoil force and inverse hull mass, from T, Pi, Phi and Q of the model."""
    model, inverse = system(), sympy.Symbol("inverse_mass")
    q, v = [c.symbol for c in model.coordinates], [c.rate for c in model.coordinates]
    values = {p.symbol: p.default for p in model.parameters if p.symbol.name != "m_6"}
    values |= {p.symbol: 1 / inverse for p in model.parameters if p.symbol.name == "m_6"}
    T, potential, phi = (_plain(e) for e in (model.kinetic_energy, model.potential_energy, model.dissipation))
    rows = [
        ((_plain(model.force(c)) - potential.diff(c.symbol) - phi.diff(c.rate)) / T.diff(c.rate, 2))
        .subs(values)
        .expand()
        for c in model.coordinates
    ]
    arguments = [*q, *v, *sympy.symbols("z_1:6"), sympy.Symbol("F"), inverse]
    return sympy.lambdify(arguments, rows, modules=modules)


def _plain(expression: Any) -> Any:
    expression = sympy.sympify(expression)
    for symbol, definition in reversed(system().definitions.items()):
        expression = expression.xreplace({symbol: definition})
    return expression


def heyoka_pendulums(starts: NDArray[np.float64], end: float, tolerance: float) -> Run:
    """Double pendulums of unit masses and lengths in heyoka's batch mode."""
    import heyoka as hy

    a, b, v, w = hy.make_vars("a", "b", "v", "w")
    d, g = b - a, 9.81
    sine, cosine = hy.sin(d), hy.cos(d)
    denominator = 2.0 - cosine * cosine
    first = (v * v * sine * cosine + g * hy.sin(b) * cosine + w * w * sine - 2.0 * g * hy.sin(a)) / denominator
    second = (-(w * w) * sine * cosine + 2.0 * (g * hy.sin(a) * cosine - v * v * sine - g * hy.sin(b))) / denominator
    width = hy.recommended_simd_size()
    make = hy.taylor_adaptive_batch([(a, v), (b, w), (v, first), (w, second)], np.zeros((4, width)), tol=tolerance)
    copies = [make.__copy__() for _ in range(THREADS)]
    chunks = [np.arange(i, i + width) % len(starts) for i in range(0, len(starts), width)]
    final = np.empty_like(starts)

    def work(thread: int) -> None:
        integrator = copies[thread]
        for chosen in chunks[thread::THREADS]:
            integrator.set_time(0.0)
            integrator.state[:] = starts[chosen].T
            integrator.propagate_until(end)
            final[chosen] = integrator.state.T

    return _on_threads(work, final)


def diffrax_rk4(drives: Drives, step: float) -> Run:
    """Diffrax's vmap with constant RK4 steps, double precision, on the CPU."""
    import diffrax
    import jax
    import jax.numpy as jnp

    jax.config.update("jax_enable_x64", True)
    accelerations = _lambdified("jax", drives.places)
    coefficients = diffrax.ButcherTableau(
        a_lower=(np.array([0.5]), np.array([0.0, 0.5]), np.array([0.0, 0.0, 1.0])),
        b_sol=np.array([1, 2, 2, 1]) / 6,
        b_error=np.zeros(4),
        c=np.array([0.5, 0.5, 1.0]),
    )

    class RK4(diffrax.AbstractERK):  # type: ignore[name-defined,misc]
        tableau = coefficients
        interpolation_cls = diffrax.ThirdOrderHermitePolynomialInterpolation.from_k

        def order(self, terms: Any) -> int:
            return 4

    def derivative(t: Any, x: Any, args: Any) -> Any:
        speed, shot, inverse = args
        road = AMPLITUDE * jnp.sin(2 * np.pi / WAVELENGTH * (speed * t - drives.places))
        inside = (t >= shot) & (t < shot + DURATION)
        force = jnp.where(inside, PEAK * jnp.sin(np.pi * (t - shot) / DURATION), 0.0)
        return jnp.concatenate([x[7:], jnp.stack(accelerations(*x, *road, force, inverse))])

    def one(x: Any, speed: Any, shot: Any, inverse: Any) -> Any:
        term, count = diffrax.ODETerm(derivative), round(drives.end / step) + 2
        found = diffrax.diffeqsolve(term, RK4(), 0.0, drives.end, step, x, args=(speed, shot, inverse), max_steps=count)
        return found.ys[-1]

    batched = jax.jit(jax.vmap(one))
    arguments = (drives.starts, drives.speeds, drives.shots, 1 / drives.masses)
    return lambda: np.asarray(batched(*map(jnp.asarray, arguments)))


def those_that_run(makers: Mapping[str, Callable[[], Run]]) -> tuple[dict[str, Run], dict[str, str]]:
    """Runs by name, and the reason why a tool does not take part."""
    runs, missing = {}, {}
    for name, make in makers.items():
        try:
            runs[name] = make()
            runs[name]()
        except Exception as error:  # whatever a foreign tool does, the others still run
            runs.pop(name, None)
            reason = str(error).splitlines()[0] if str(error) else ""
            missing[name] = f"does not take part: {type(error).__name__}: {reason}"
    return runs, missing
