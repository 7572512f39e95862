"""One accepted step of Rodas5P: one linearisation, eight stages on one factorization, the error test.

The form of HW, equation IV.7.25; see `tableau_rosenbrock`.
"""

import numpy as np

from qddot.runner.frame.space import project_at_end, row_address, set_inputs
from qddot.runner.frame.step_control import MATLAB, after_failure, after_success, tolerance
from qddot.runner.inputs.instants import side_of
from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.memory import LEAN
from qddot.runner.problem import Status
from qddot.runner.stiff.matrix import square
from qddot.runner.stiff.space import OWN, POLYNOMIAL, RELATIVE, THRESHOLD, X_NEW, F, X, vectors
from qddot.runner.stiff.system import (
    careful_time_derivative,
    evaluate_f,
    evaluate_jacobian,
    factorize_shifted,
    find_non_finite,
    set_weights,
    solve_factorized,
    time_derivative,
    weighted_norm,
)
from qddot.runner.stiff.tableau_rosenbrock import RODAS5P

STAGES = RODAS5P.stages
A, C, CS, D, DENSE, GAMMA = RODAS5P.a, RODAS5P.C, RODAS5P.c, RODAS5P.d, RODAS5P.dense, RODAS5P.gamma
EPS = float(np.finfo(np.float64).eps)

#: Rows of v: argument of a stage, sum over C, df/dt, the stages U_1, ..., U_8.
ARGUMENT, PAST, DFDT, U = np.arange(OWN, OWN + 4)
ROWS = int(U) + STAGES
LAST = U + STAGES - 1

RUNNING, NON_FINITE, STEP_UNDERFLOW = int(Status.RUNNING), int(Status.NON_FINITE), int(Status.STEP_UNDERFLOW)


@compiled(**LEAN)
def take_good_step(space, s, v):
    """Take one accepted step from (s.t, v[X]) to (s.t_new, v[X_NEW]); returns RUNNING, or how it failed."""
    s.h_min = 16.0 * np.spacing(abs(s.t))
    s.h = min(s.h_max, max(s.h_min, s.h))
    if not s.fresh_jacobian:
        set_inputs(space, s.t, side_of(s.t, s.h, 0.0))
        evaluate_f(space, s, s.t, X, F)
        evaluate_jacobian(space, s, v, s.t, s.h)
        s.fresh_jacobian = True
    # Between the rounding of t and the curvature of f over h.
    if s.central:
        careful_time_derivative(space, s, v, np.cbrt(EPS * max(abs(s.t), s.h) * s.h**2), DFDT)
    else:
        time_derivative(space, s, v, np.sqrt(EPS * max(abs(s.t), s.h) * s.h), DFDT)
    failures = 0
    while True:
        if s.stretch * s.h >= s.segment_end - s.t:
            s.h = s.segment_end - s.t
            s.reaches_end = True
        s.t_new = s.segment_end if s.reaches_end else s.t + s.h
        error = _attempt(space, s, v)
        if error <= 1.0:
            s.next_h = s.h * after_success(s, error, s.last_error, failures > 0)
            s.last_error = error
            if space.project != 0:
                project_at_end(space, s.t, s.t_new - s.t, row_address(space, X_NEW))
            return RUNNING
        failures += 1
        s.failed_attempts += 1
        smaller = s.h * after_failure(s, error, failures)
        if s.h <= s.h_min or (not error < np.inf and smaller <= s.h_min):
            worst = s.worst
            culprit = find_non_finite(space, s, v)
            s.failed_state = culprit if culprit >= 0 else worst
            return STEP_UNDERFLOW if error < np.inf and culprit < 0 else NON_FINITE
        s.reaches_end = False
        s.h = max(s.h_min, smaller)


@compiled(**LEAN)
def _attempt(space, s, v):
    """All stages with the step s.h; returns the error, where 1 is just good enough."""
    n = space.n
    factorize_shifted(space, s, 1.0 / (GAMMA * s.h), 1.0)
    if s.singular:
        return np.inf
    for i in range(STAGES):
        if i > 0:
            _combine(v, i, s.h)
            set_inputs(space, s.t + CS[i] * s.h, side_of(s.t, s.h, CS[i]))
            evaluate_f(space, s, s.t + CS[i] * s.h, ARGUMENT, U + i)
            _add_past(space, s, v, i)
        else:
            for j in range(n):
                v[U, j] = v[F, j]
        for j in range(n):
            v[U + i, j] += s.h * D[i] * v[DFDT, j]
        solve_factorized(space, s, U + i)
    for j in range(n):
        v[X_NEW, j] = v[ARGUMENT, j] + v[LAST, j]
    return _scaled_error(s, v)


@compiled(**LEAN)
def _combine(v, i, h):
    """Argument of stage i, and the sum of C_ij/h U_j."""
    for j in range(v.shape[1]):
        v[ARGUMENT, j] = v[X, j]
        v[PAST, j] = 0.0
    for stage in range(i):
        a, c = A[i, stage], C[i, stage] / h
        for j in range(v.shape[1]):
            v[ARGUMENT, j] += a * v[U + stage, j]
            v[PAST, j] += c * v[U + stage, j]


@compiled(**LEAN)
def _add_past(space, s, v, i):
    """v[U + i] += M v[PAST]."""
    n = space.n
    if s.unit_mass:
        for j in range(n):
            v[U + i, j] += v[PAST, j]
    else:
        mass = square(space, space.mass)
        for j in range(n):
            for k in range(n):
                v[U + i, j] += mass[j, k] * v[PAST, k]


@compiled(**LEAN)
def _scaled_error(s, v):
    """Size of the error estimate, the last stage, over the tolerance: largest, or root mean square if so controlled."""
    set_weights(v, X_NEW)
    largest = weighted_norm(s, v, LAST)
    if not largest < np.inf:
        return np.inf
    if s.kind == MATLAB:
        return largest / s.rtol
    total = 0.0
    for i in range(v.shape[1]):
        allowed = tolerance(1.0, v[THRESHOLD, i], max(abs(v[X, i]), abs(v[X_NEW, i])), False)
        ratio = v[RELATIVE, i] * v[LAST, i] / allowed / s.rtol
        total += ratio * ratio
    return np.sqrt(total / v.shape[1])


@compiled(**LEAN)
def prepare_polynomial(space, s):
    """Write the dense output, of order 4, of the step just taken."""
    if s.part < 1.0:  # it was cut, and what it was cut from is gone
        return
    v = vectors(space)
    for i in range(v.shape[1]):
        D1, D2, D3 = 0.0, 0.0, 0.0
        for stage in range(STAGES):
            D1 += DENSE[0, stage] * v[U + stage, i]
            D2 += DENSE[1, stage] * v[U + stage, i]
            D3 += DENSE[2, stage] * v[U + stage, i]
        v[POLYNOMIAL, i] = v[X_NEW, i] - v[X, i] + D1
        v[POLYNOMIAL + 1, i] = D2 - D1
        v[POLYNOMIAL + 2, i] = D3 - D2
        v[POLYNOMIAL + 3, i] = -D3
        v[POLYNOMIAL + 4, i] = 0.0
