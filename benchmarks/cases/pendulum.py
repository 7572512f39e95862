"""Pendulums of n equal links, written down by hand: point masses of 1 kg on rods of 1 m."""

from collections.abc import Callable
from typing import Any

import numpy as np
from numba import njit

from benchmarks.cases.case import Case, Floats
from benchmarks.cases.reference import precisely
from qddot.runner.load import Model

GRAVITY = 9.81


def swings(model: Model, starts: Floats, end: float) -> Case:
    """Runs from starts (runs, 2n) of a model whose parameters are such by default."""
    runs, n = len(starts), starts.shape[1] // 2
    c = model.constants(model.parameter_values())
    return Case(
        model=model,
        starts=starts,
        constants=np.tile(c, (runs, 1)),
        given=np.zeros((runs, 0)),
        parts=((np.full(runs, end), 0.0),),
        equations=equations_of(n),
        inputs=_no_inputs,
        one=lambda case: {},
        many=lambda case: {},
        solution=precisely,
        atol=1.0,
    )


def equations_of(n: int) -> Callable[..., Any]:
    """Mass matrix and forces of n links in angles from the downward vertical.

    With mu_ij = n - max(i, j): sum_j mu_ij (cos(a_i - a_j) a_j'' + sin(a_i - a_j) a_j'^2) = -mu_ii g sin(a_i).
    """

    def equations(t: Any, q: Any, v: Any, peak: Any, given: Any, f: Any) -> tuple[list[list[Any]], list[Any]]:
        M: list[list[Any]] = [[float(n - i) if i == j else None for j in range(n)] for i in range(n)]
        forces = [-(n - i) * GRAVITY * f.sin(q[i]) for i in range(n)]
        squares = [rate * rate for rate in v]
        for i in range(n):
            for j in range(i + 1, n):
                mu, apart = float(n - j), q[i] - q[j]
                M[i][j] = M[j][i] = mu * f.cos(apart)
                turn = mu * f.sin(apart)
                forces[i] = forces[i] - turn * squares[j]
                forces[j] = forces[j] + turn * squares[i]
        return M, forces

    return equations


@njit
def _no_inputs(t, peak, given, u):
    pass
