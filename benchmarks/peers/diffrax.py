"""diffrax: JAX's vmap over runs, double precision, on the CPU."""

from collections.abc import Callable
from typing import Any

import diffrax
import jax
import jax.numpy as jnp
import numpy as np

from benchmarks.cases.case import Case, Run, accelerations

jax.config.update("jax_enable_x64", True)

#: Up to so many coordinates accelerations are solved for symbol by symbol: XLA compiles more than that for minutes.
WRITTEN_OUT = 4


class _RK4(diffrax.AbstractERK):  # type: ignore[misc]
    tableau = diffrax.ButcherTableau(
        a_lower=(np.array([0.5]), np.array([0.0, 0.5]), np.array([0.0, 0.0, 1.0])),
        b_sol=np.array([1, 2, 2, 1]) / 6,
        b_error=np.zeros(4),
        c=np.array([0.5, 0.5, 1.0]),
    )
    interpolation_cls = diffrax.ThirdOrderHermitePolynomialInterpolation.from_k

    def order(self, terms: Any) -> int:
        return 4


def rk4(case: Case, step: float) -> Run:
    """All runs by the classical Runge-Kutta method with constant steps."""
    return _batched(case, _RK4(), step)(0.0)


def many(case: Case) -> Callable[[float], Run]:
    """All runs by Dopri8, each with its own step; JAX goes on with all until the last has ended."""
    return _batched(case, diffrax.Dopri8(), None)


def _accelerations(case: Case, t: Any, x: Any, peak: Any, given: Any) -> Any:
    if case.n <= WRITTEN_OUT:
        return jnp.stack(accelerations(case, t, x, peak, given, jnp))
    M, forces = case.equations(t, list(x[: case.n]), list(x[case.n :]), peak, given, jnp)
    forces = jnp.stack(forces)
    return forces if M is None else jnp.linalg.solve(jnp.array(M), forces)


def _batched(case: Case, solver: Any, step: float | None) -> Callable[[float], Run]:
    """Runs at a tolerance, which is an argument of the compiled function: one compilation serves all."""
    count = 1_000_000 if step is None else round(case.end / step) + 2
    ends, peaks = np.array([until for until, _ in case.parts]).T, jnp.array([peak for _, peak in case.parts])

    def derivative(t: Any, x: Any, args: Any) -> Any:
        given, ends = args
        peak = peaks[jnp.searchsorted(ends[:-1], t, side="right")]
        return jnp.concatenate([x[case.n :], _accelerations(case, t, x, peak, given)])

    def one(x: Any, given: Any, ends: Any, tolerance: Any) -> Any:
        options: dict[str, Any] = {"args": (given, ends), "max_steps": count}
        if step is None:
            controller = diffrax.PIDController(rtol=tolerance, atol=tolerance * case.atol)
            jumps = len(case.parts) > 1
            options["stepsize_controller"] = (
                diffrax.ClipStepSizeController(controller, jump_ts=ends[:-1]) if jumps else controller
            )
        return diffrax.diffeqsolve(diffrax.ODETerm(derivative), solver, 0.0, case.end, step, x, **options).ys[-1]

    batched = jax.jit(jax.vmap(one, in_axes=(0, 0, 0, None)))
    rows = tuple(map(jnp.asarray, (case.starts, case.given, ends)))
    return lambda tolerance: lambda: np.asarray(batched(*rows, tolerance))
