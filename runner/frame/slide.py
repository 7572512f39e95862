"""Sliding: a condition whose branches both drive the state back to where it turns is held there (Filippov).

With s the switching function, f_+ and f_- the two branches of the right-hand side, x' = f_- + p (f_+ - f_-) with the
p for which ds/dt = 0: A. F. Filippov, Differential Equations with Discontinuous Righthand Sides (1988), section 4.
Several conditions slide at once where their branches add up, as those of friction at several places do. What a
condition that slides is watched for is its p: from 0 to 1 neither branch wins; dry friction that sticks beyond its
sliding limit has a bound of its own.

While anything slides, `slide` and `slide_functions` stand where methods have the kernels `rhs` and `modes`; they find
what they need at the address that stands before the inputs u in memory.
"""

from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from qddot.runner import abi
from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.memory import LEAN, address, first_item, floats, integers, matrix
from qddot.runner.machine.pointers import call_kernel, pointer
from qddot.runner.problem import Problem

#: What stands at that address. Addresses of kernels rhs, modes, approach; entries of that, their rows and columns;
#: numbers of states, conditions, channels; sense of time; flags (count,): which conditions slide; values (entries,),
#: slopes (count, n), equations (count, count + 1), part (count,): p of each; pull (count,): f_+ less f_- along ds/dx;
#: bound (count,): of |2 p - 1|; rest (n,): room.
RHS, MODES, APPROACH, ENTRIES, ROWS, COLUMNS, N, COUNT, CHANNELS, SENSE = range(10)
FLAGS, VALUES, SLOPES, EQUATIONS, PART, PULL, BOUND, REST = range(10, 18)
FIELDS = 18


def slider(problem: Problem, channels: int) -> tuple[NDArray[np.int64], dict[str, NDArray[Any]]]:
    """What stands before the inputs, and the arrays that it points into."""
    n, count, placed = len(problem.initial_state), problem.n_modes, problem.approach
    arrays: dict[str, NDArray[Any]] = {
        "rows": placed.pattern.rows.astype(np.int64),
        "columns": placed.pattern.columns.astype(np.int64),
        "flags": np.zeros(count, dtype=np.int64),
        "values": np.zeros(placed.pattern.entries),
        "slopes": np.zeros((count, n)),
        "equations": np.zeros((count, count + 1)),
        "part": np.zeros(count),
        "pull": np.zeros(count),
        "bound": np.ones(count),
        "rest": np.zeros(n),
    }
    kernels = {"rhs": problem.rhs, "modes": problem.switching, "approach": placed.kernel}
    at = {name: pointer(kernel, abi.VECTOR_KERNEL, name) for name, kernel in kernels.items()}
    rows, columns, *others = (address(array) for array in arrays.values())
    sizes = (placed.pattern.entries, rows, columns, n, count, channels, problem.sense)
    return np.array([*at.values(), *sizes, *others], dtype=np.int64), arrays


@cache
def sliding_rhs() -> int:
    """The address of `slide`."""
    return pointer(compiled(abi.VECTOR_KERNEL)(slide), abi.VECTOR_KERNEL, "slide")


@cache
def sliding_functions() -> int:
    """The address of `slide_functions`."""
    return pointer(compiled(abi.VECTOR_KERNEL)(slide_functions), abi.VECTOR_KERNEL, "slide_functions")


@compiled(**LEAN)
def context(u):
    """The address that stands before the inputs."""
    return integers(first_item(u) - 8, 1)[0]


def slide(t, x, u, c, dx):
    """The right-hand side where conditions slide."""
    combine(t, x, u, c, dx)


@compiled(**LEAN)
def combine(t, x, u, c, dx):
    """Write the combination of branches that keeps s where it is, and its parts."""
    its = integers(context(u), FIELDS)
    n, count, first = its[N], its[COUNT], its[CHANNELS] - its[COUNT]
    flags, part = integers(its[FLAGS], count), floats(its[PART], count)
    put(its, u, -np.inf)
    call_kernel(its[RHS], t, x, u, c, dx)
    for k in range(count):
        if flags[k] != 0:
            slopes = floats(its[SLOPES] + 8 * n * k, n)
            u[first + k] = np.inf
            call_kernel(its[RHS], t, x, u, c, slopes)
            u[first + k] = -np.inf
            for i in range(n):
                slopes[i] -= dx[i]
    call_kernel(its[APPROACH], t, x, u, c, floats(its[VALUES], its[ENTRIES]))
    put(its, u, 0.0)
    set_up(its, dx)
    eliminate(its)
    for k in range(count):
        if flags[k] != 0:
            slopes = floats(its[SLOPES] + 8 * n * k, n)
            for i in range(n):
                dx[i] += part[k] * slopes[i]


@compiled(**LEAN)
def put(its, u, mode):
    """Let all conditions that slide have this mode."""
    flags, first = integers(its[FLAGS], its[COUNT]), its[CHANNELS] - its[COUNT]
    for k in range(its[COUNT]):
        if flags[k] != 0:
            u[first + k] = mode


@compiled(**LEAN)
def set_up(its, dx):
    """Write the equations of the parts: ds/dt = 0 of all that slide; the parts of others are 0."""
    n, count = its[N], its[COUNT]
    flags, pull, bound = integers(its[FLAGS], count), floats(its[PULL], count), floats(its[BOUND], count)
    entries = its[ENTRIES]
    rows, columns, values = integers(its[ROWS], entries), integers(its[COLUMNS], entries), floats(its[VALUES], entries)
    equations = matrix(its[EQUATIONS], count, count + 1)
    for k in range(count):
        for j in range(count + 1):
            equations[k, j] = 0.0
        if flags[k] == 0:
            equations[k, k] = 1.0
    for entry in range(entries):
        k, column = rows[entry], columns[entry]
        if column > n:
            bound[k] = values[entry]
        elif flags[k] != 0:
            equations[k, count] -= values[entry] * (dx[column] if column < n else its[SENSE])
            for j in range(count):
                if flags[j] != 0 and column < n:
                    equations[k, j] += values[entry] * floats(its[SLOPES] + 8 * n * j, n)[column]
    for k in range(count):
        pull[k] = equations[k, k]


@compiled(**LEAN)
def eliminate(its):
    """Solve for the parts, by Gauss's elimination with pivots."""
    count = its[COUNT]
    equations, part = matrix(its[EQUATIONS], count, count + 1), floats(its[PART], count)
    for k in range(count):
        pivot = k
        for i in range(k + 1, count):
            if abs(equations[i, k]) > abs(equations[pivot, k]):
                pivot = i
        for j in range(k, count + 1):
            equations[k, j], equations[pivot, j] = equations[pivot, j], equations[k, j]
        for i in range(k + 1, count):
            factor = equations[i, k] / equations[k, k]
            if factor != 0.0:
                for j in range(k, count + 1):
                    equations[i, j] -= factor * equations[k, j]
    for k in range(count - 1, -1, -1):
        total = equations[k, count]
        for j in range(k + 1, count):
            total -= equations[k, j] * part[j]
        part[k] = total / equations[k, k]


def slide_functions(t, x, u, c, v):
    """What conditions are watched for where some slide: of these how far p is from 0 and 1, doubled."""
    its = integers(context(u), FIELDS)
    call_kernel(its[MODES], t, x, u, c, v)
    combine(t, x, u, c, floats(its[REST], its[N]))
    flags, part = integers(its[FLAGS], its[COUNT]), floats(its[PART], its[COUNT])
    bound = floats(its[BOUND], its[COUNT])
    for k in range(its[COUNT]):
        if flags[k] != 0:
            v[k] = bound[k] - abs(2.0 * part[k] - 1.0)
