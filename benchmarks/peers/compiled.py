"""Our generated right-hand side with the inputs of a case, jitted as tools that take compiled functions want it."""

from typing import Any

import numpy as np
from numba import carray, njit

from benchmarks.cases.case import Case, Floats


def derivative(case: Case) -> Any:
    """Jitted (t, x, numbers, dx) with the `numbers` of a run and part; nothing is allocated in a call."""
    rhs, inputs = case.model.kernel("rhs"), case.inputs
    k, n_constants = case.given.shape[1], case.constants.shape[1]

    @njit(error_model="numpy", fastmath={"contract", "nsz"})
    def function(t, x, numbers, dx):
        u = numbers[1 + k + n_constants :]
        inputs(t, numbers[0], numbers[1 : 1 + k], u)
        rhs(t, x, u, numbers[1 + k : 1 + k + n_constants], dx)

    return function


def by_pointers(case: Case) -> Any:
    """The same with pointers in place of arrays, as C and C++ call it."""
    function, size, count = derivative(case), 2 * case.n, numbers(case).shape[2]

    @njit(error_model="numpy")
    def called(t, x, p, dx):
        function(t, carray(x, (size,)), carray(p, (count,)), carray(dx, (size,)))

    return called


def numbers(case: Case) -> Floats:
    """Peak, given, constants and room for the inputs u for each run and part, (runs, parts, m)."""
    room = np.zeros((case.runs, channels(case)))
    rows = [np.column_stack([np.full(case.runs, peak), case.given, case.constants, room]) for _, peak in case.parts]
    return np.ascontiguousarray(np.stack(rows, axis=1))


def channels(case: Case) -> int:
    """Length of u."""
    return max(1, len(case.model.tables.inputs))
