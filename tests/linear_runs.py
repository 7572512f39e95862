"""Linear systems with known solutions, by every method there is, `exact` among them."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import runs
from numba import njit
from numpy.typing import ArrayLike

from qddot.runner.frame.spans import integrate
from qddot.runner.inputs.signal import Signal, stack
from qddot.runner.matrices import PlacedKernel, pattern
from qddot.runner.methods import METHODS, find_method
from qddot.runner.options import Options
from qddot.runner.problem import Problem, Trajectory
from qddot.runner.takers import fitted

EVERY = [name for name in METHODS if name not in ("taylor", "auto")]  # these want a generated model
FIXED = [name for name, method in METHODS.items() if method.family == "fixed"]
#: Those that are exact, but for rounding, where the solution is a cubic in time.
EXACT_ON_CUBICS = [name for name in EVERY if name not in ("euler", "heun", "midpoint", "ode15s")]


@njit
def states_of(t, x, u, c, values):
    """A as it lies in the constants."""
    for k in range(len(x) ** 2):
        values[k] = c[k]


@njit
def inputs_of(t, x, u, c, values):
    """B without its last column, behind A."""
    n, m = len(x), len(u)
    for i in range(n):
        for j in range(m):
            values[m * i + j] = c[n * n + (m + 1) * i + j]


@njit
def slopes_of(t, x, u, c, dx):
    """A x + B [u, 1]."""
    n, m = len(x), len(u)
    for i in range(n):
        dx[i] = c[n * n + (m + 1) * i + m]
        for j in range(m):
            dx[i] += c[n * n + (m + 1) * i + j] * u[j]
        for j in range(n):
            dx[i] += c[n * i + j] * x[j]


def full(kernel: Any, *shape: int) -> PlacedKernel:
    """A kernel of a matrix all of whose entries it writes."""
    return PlacedKernel(kernel, pattern((tuple(range(shape[1])),) * shape[0], shape))


def problem(
    A: Sequence[Sequence[float]], B: ArrayLike, x0: ArrayLike, span: tuple[float, float], signal: Signal | None = None
) -> Problem:
    """x' = A x + B [u, 1] over a span; B has two columns."""
    n, inputs = len(A), stack([signal or polynomial(0.0)], [0])
    c = np.concatenate([np.ravel(A), np.ravel(B)])
    made = runs.problem(slopes_of, span[1], x0, jacobian=full(states_of, n, n), c=c, inputs=inputs, t0=span[0])
    return replace(made, input_jacobian=full(inputs_of, n, 1))


def polynomial(*coefficients: float) -> Signal:
    """The input c0 + c1 t + c2 t^2 + c3 t^3."""
    piece = np.zeros((1, 8))
    piece[0, 1 : 1 + len(coefficients)] = coefficients
    return Signal(piece, np.empty(0))


def double_integral(signal: Signal | None, x0: ArrayLike, span: tuple[float, float], pull: float = 0.0) -> Problem:
    """x'' = u + pull."""
    return problem([[0, 1], [0, 0]], [[0, 0], [1, pull]], x0, span, signal)


def cosine(omega: float, phase: float, span: tuple[float, float]) -> Problem:
    """x = cos(omega t + phase), v = x'."""
    start = omega * span[0] + phase
    x0 = (np.cos(start), -omega * np.sin(start))
    return problem([[0, 1], [-(omega**2), 0]], np.zeros((2, 2)), x0, span)


def run(method: str, made: Problem, step: float, **options: Any) -> Trajectory:
    """The trajectory; step: of methods with a constant one; rtol, atol, ...: of those that control theirs."""
    chosen = find_method(method)
    own = {name: value for name, value in options.items() if chosen.adaptive or name == "events"}
    own |= {"step": step} if method in FIXED else {}
    return integrate(made, chosen, fitted(Options(**own), chosen))
