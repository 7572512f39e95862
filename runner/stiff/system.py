"""What the stiff methods compute of M x' = f(t, x): Jacobian, df/dt, factorized combinations, norms."""

import numpy as np

from qddot.runner.frame.space import constants, input_values, set_inputs, states
from qddot.runner.frame.step_control import tolerance
from qddot.runner.inputs.instants import side_of
from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.memory import BLOCK, LEAN, floats
from qddot.runner.machine.pointers import call_kernel, call_matrix_kernel
from qddot.runner.machine.sums import any_beyond
from qddot.runner.matrices import scatter
from qddot.runner.stiff.matrix import (
    entry,
    factorize_combination,
    multiply,
    multiply_whole,
    set_entry,
    solve_combination,
    square,
)
from qddot.runner.stiff.space import (
    DEGREE,
    F_OPPOSITE,
    F_SHIFTED,
    POLYNOMIAL,
    RELATIVE,
    SHIFTED,
    THRESHOLD,
    WEIGHTS,
    WITHIN,
    F,
    X,
)

#: Square root of the rounding unit: relative increment of a forward difference.
ROOT_EPS = float(np.sqrt(np.finfo(np.float64).eps))
#: Its cube root: of a central difference.
CBRT_EPS = float(np.cbrt(np.finfo(np.float64).eps))
#: The largest of finite numbers.
LARGEST = float(np.finfo(np.float64).max)
#: rtol below which a Rosenbrock method, whose order rests on the Jacobian, takes central differences: of BEAM (80
#: states) at rtol 1e-9 it needs 17276 steps with forward ones, 2715 with central and 2717 with exact derivatives.
CENTRAL_BELOW = 1e-4


@compiled(**LEAN)
def evaluate_f(space, s, t, row, target):
    """v[target] = f(t, v[row]) with the inputs last set."""
    x, f = states(space, row), states(space, target)
    call_kernel(space.rhs, t, x, input_values(space), constants(space), f)
    s.evaluations += 1


@compiled(**LEAN)
def all_finite(where, count):
    """Whether all of so many floats at an address are finite."""
    whole, entries = count - count % BLOCK, floats(where, count)
    found = True
    for i in range(0, whole, BLOCK):
        found &= not any_beyond(where + 8 * i, LARGEST)
    for i in range(whole, count):
        found &= abs(entries[i]) <= LARGEST
    return found


@compiled(**LEAN)
def kernel_jacobian(space, t):
    """Write df/dx at (t, v[X]) by its kernel; whether it is finite."""
    x, u, c = states(space, X), input_values(space), constants(space)
    if space.places == 0:
        jacobian = square(space, space.jacobian)
        call_matrix_kernel(space.jacobian_kernel, t, x, u, c, jacobian)
        return all_finite(space.jacobian, space.n * space.n)
    call_kernel(space.jacobian_kernel, t, x, u, c, floats(space.values, space.entries))
    scatter(space.values, space.places, space.entries, space.jacobian, space.cells)
    return all_finite(space.values, space.entries)


@compiled(**LEAN)
def evaluate_jacobian(space, s, v, t, typical_step):
    """Evaluate df/dx at (t, v[X]), where v[F] = f, with the inputs last set.

    Without a kernel, or where what it gives is not finite (as of sqrt|v| at rest): differences, with increments
    relative to |x|, to its change within typical_step (s), or to the threshold, whichever is largest. Where s.central,
    and f is finite on both sides, they are central, and the threshold counts as little as in forward ones: it says
    where errors do not matter, not how far f is smooth.
    """
    n = space.n
    s.jacobians += 1
    if space.jacobian_kernel != 0 and kernel_jacobian(space, t):
        return
    for i in range(n):
        v[SHIFTED, i] = v[X, i]
    for j in range(n):
        size = max(abs(v[X, j]), abs(typical_step * v[F, j]))
        increment = ROOT_EPS * max(size, v[THRESHOLD, j])
        if s.central:
            increment = max(CBRT_EPS * size, ROOT_EPS * v[THRESHOLD, j])
        shifted = v[X, j] + np.copysign(increment, v[F, j])
        v[SHIFTED, j] = shifted
        evaluate_f(space, s, t, SHIFTED, F_SHIFTED)
        for i in range(n):
            set_entry(space, i, j, (v[F_SHIFTED, i] - v[F, i]) / (shifted - v[X, j]))
        if s.central:
            centre_column(space, s, v, t, j)
        v[SHIFTED, j] = v[X, j]


@compiled(**LEAN)
def centre_column(space, s, v, t, j):
    """Column j of the Jacobian from v[F_SHIFTED] and f as far on the other side, where that is finite."""
    shifted = v[SHIFTED, j]
    v[SHIFTED, j] = v[X, j] - (shifted - v[X, j])
    evaluate_f(space, s, t, SHIFTED, F_OPPOSITE)
    for i in range(space.n):
        if not np.isfinite(v[F_OPPOSITE, i]):
            return
    for i in range(space.n):
        set_entry(space, i, j, (v[F_SHIFTED, i] - v[F_OPPOSITE, i]) / (shifted - v[SHIFTED, j]))


@compiled(**LEAN)
def time_derivative(space, s, v, increment, dfdt):
    """v[dfdt] = df/dt at (s.t, v[X]), where v[F] = f, by a forward difference; changes the inputs last set.

    The difference stays within the segment, in which no input jumps.
    """
    later = s.t + min(increment, 0.5 * (s.segment_end - s.t))
    set_inputs(space, later, later)
    evaluate_f(space, s, later, X, dfdt)
    for i in range(v.shape[1]):
        v[dfdt, i] = (v[dfdt, i] - v[F, i]) / (later - s.t)


@compiled(**LEAN)
def careful_time_derivative(space, s, v, increment, dfdt):
    """`time_derivative` of second order, by two differences ahead: an input may have a kink where the step begins."""
    increment = min(increment, 0.25 * (s.segment_end - s.t))
    latest = s.t + 2.0 * increment
    time_derivative(space, s, v, increment, dfdt)
    set_inputs(space, latest, latest)
    evaluate_f(space, s, latest, X, F_SHIFTED)
    for i in range(v.shape[1]):
        v[dfdt, i] = 2.0 * v[dfdt, i] - (v[F_SHIFTED, i] - v[F, i]) / (latest - s.t)


@compiled(**LEAN)
def find_non_finite(space, s, v):
    """The first state whose slope, here or just ahead, or whose row of the Jacobian is not finite; -1 where all are."""
    set_inputs(space, s.t, side_of(s.t, s.h, 0.0))
    evaluate_f(space, s, s.t, X, F)
    for i in range(space.n):
        v[SHIFTED, i] = v[X, i] + s.h * v[F, i]
    set_inputs(space, s.t + s.h, side_of(s.t, s.h, 1.0))
    evaluate_f(space, s, s.t + s.h, SHIFTED, F_SHIFTED)
    for i in range(space.n):
        if not (np.isfinite(v[F, i]) and np.isfinite(v[F_SHIFTED, i])):
            return i
    for i in range(space.n):
        for j in range(space.n):
            if not np.isfinite(entry(space, i, j)):
                return i
    return -1


@compiled(**LEAN)
def factorize_shifted(space, s, a, b):
    """Factorize a M - b df/dx; s.singular tells whether that failed."""
    s.singular = factorize_combination(space, a, b)
    s.factorizations += 1


@compiled(**LEAN)
def solve_factorized(space, s, row):
    """Overwrite the row of v with the solution of the system last factorized."""
    solve_combination(space, states(space, row))
    s.linear_solves += 1


@compiled(**LEAN)
def multiply_jacobian(space, v, row, target):
    """v[target] = df/dx v[row]."""
    multiply(space, states(space, row), states(space, target))


@compiled(**LEAN)
def apply_inverse_mass(space, s, v, row, target):
    """v[target] = v[row] over the mass matrix, by its pseudo-inverse."""
    if s.unit_mass:
        for i in range(space.n):
            v[target, i] = v[row, i]
    else:
        multiply_whole(space, space.pseudo_inverse, states(space, row), states(space, target))


@compiled(**LEAN)
def set_weights(v, row):
    """Errors count relative to the larger of |v[X]|, |v[row]| and the threshold."""
    for i in range(v.shape[1]):
        size = max(abs(v[X, i]), abs(v[row, i]))
        v[WEIGHTS, i] = v[RELATIVE, i] / tolerance(1.0, v[THRESHOLD, i], size, True)


@compiled(**LEAN)
def weighted_norm(s, v, row):
    """The largest |v[row, i]| * v[WEIGHTS, i]; NaN if one is. s.worst is its index."""
    largest = 0.0
    for i in range(v.shape[1]):
        size = abs(v[row, i]) * v[WEIGHTS, i]
        if not size <= largest:
            largest = size
            s.worst = i
            if np.isnan(size):
                break
    return largest


@compiled(**LEAN)
def evaluate_polynomial(v, theta):
    """v[WITHIN] = the state at part theta of the step, 0 to 1."""
    for i in range(v.shape[1]):
        value = v[POLYNOMIAL + DEGREE - 1, i]
        for p in range(DEGREE - 2, -1, -1):
            value = v[POLYNOMIAL + p, i] + theta * value
        v[WITHIN, i] = v[X, i] + theta * value
