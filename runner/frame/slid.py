"""Outputs at points where conditions slide: the same combination of branches as that of the right-hand side.

A saved state does not say whether it slid. It did where both branches drive it back to where a switching function is
zero, and would take next to no time to bring it there from where rounding has left it.
"""

from functools import cache
from typing import Any

import numpy as np
from numba import types
from numpy.typing import NDArray

from qddot.runner import abi
from qddot.runner.frame.slide import BOUND, COUNT, FIELDS, FLAGS, MODES, PART, PULL, REST, N, combine, slider
from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.memory import address, first_item, floats, integers
from qddot.runner.machine.pointers import call_kernel
from qddot.runner.problem import FOREVER, Problem

Floats = NDArray[np.float64]

#: What counts as no time, as a part of the span of a run.
_NO_TIME = 1e-8


def combine_outputs(problem: Problem, kernel: Any, t: Floats, x: Floats, u: Floats, y: Floats) -> None:
    """Put right the outputs y (n, n_outputs) at times t (n,), states x (n, n_states), inputs u (n, channels)."""
    if problem.approach is None or not problem.approach.pattern.entries:
        return
    count, span = problem.n_modes, abs(problem.t1 - problem.t0)
    its, arrays = slider(problem, u.shape[1])
    beside = np.zeros((len(t), u.shape[1] + 1))
    beside[:, 0].view(np.int64)[:] = address(its)
    beside[:, 1:] = u
    able = np.isin(np.arange(count), arrays["rows"]).astype(np.int64)
    time = _NO_TIME * (span if span < FOREVER else np.ptp(t))
    parts, states = np.full((len(t), count), np.nan), np.ascontiguousarray(x)
    _compiled_parts()(address(its), time, able, t, states, beside, np.array(problem.constants), parts)
    for i in np.flatnonzero(~np.isnan(parts).all(axis=1)):
        _combine(problem, kernel, parts[i], t[i], states[i], u[i].copy(), y[i])


def _combine(problem: Problem, kernel: Any, parts: Floats, t: float, x: Floats, u: Floats, y: Floats) -> None:
    sliding, first = np.flatnonzero(~np.isnan(parts)), len(u) - problem.n_modes
    low, high = np.zeros(len(y)), np.zeros(len(y))
    u[first + sliding] = -np.inf
    kernel(t, x, u, problem.constants, low)
    y[:] = low
    for k in sliding:
        u[first + k] = np.inf
        kernel(t, x, u, problem.constants, high)
        u[first + k] = -np.inf
        y += parts[k] * (high - low)


@cache
def _compiled_parts() -> Any:
    flags = types.Array(types.int64, 1, "C")
    arguments = (types.int64, types.float64, flags, abi.VECTOR, abi.MATRIX, abi.MATRIX, abi.VECTOR, abi.MATRIX)
    return compiled(types.void(*arguments), nogil=True)(find_parts)


def find_parts(where, time, able, t, x, beside, c, parts):
    """Write the parts (n, count) of the conditions that slide at points, and leave those of others.

    where: the address of what `slider` made, which stands before the inputs in `beside` (n, 1 + channels). time: within
    which a branch would bring a switching function to zero. able (count,): not 0 for those that can slide.
    """
    its = integers(where, FIELDS)
    count = its[COUNT]
    flags, part, pull = integers(its[FLAGS], count), floats(its[PART], count), floats(its[PULL], count)
    bound, rest, values = floats(its[BOUND], count), floats(its[REST], its[N]), np.zeros(count)
    for i in range(len(t)):
        u = floats(first_item(beside) + 8 * (beside.shape[1] * i + 1), beside.shape[1] - 1)
        call_kernel(its[MODES], t[i], x[i], u, c, values)
        for k in range(count):
            flags[k] = able[k]
        combine(t[i], x[i], u, c, rest)
        for k in range(count):
            flags[k] = flags[k] != 0 and pull[k] < 0.0 and abs(values[k]) <= -time * pull[k]
        left = True
        while left and flags.any():
            left = False
            combine(t[i], x[i], u, c, rest)
            for k in range(count):
                if flags[k] != 0 and not abs(2.0 * part[k] - 1.0) <= bound[k] * (1.0 + 1e-9):
                    flags[k], left = 0, True
        for k in range(count):
            if flags[k] != 0:
                parts[i, k] = part[k]
