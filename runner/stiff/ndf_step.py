"""One accepted step of the quasi-constant-step NDFs: prediction, simplified Newton iteration, error test.

Shampine & Reichelt (1997), sections 2.2, 2.3 and 4, with the constants of the published code.
"""

import numpy as np

from qddot.runner.frame.space import project_at_end, row_address, set_inputs
from qddot.runner.inputs.instants import side_of
from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.memory import INLINE, LEAN
from qddot.runner.problem import Status
from qddot.runner.stiff.matrix import square
from qddot.runner.stiff.ndf_choice import choose_after_failure
from qddot.runner.stiff.ndf_formulas import CORRECTION, DELTA, DIF, ERROR, GAMMA, INVERSE, PREDICTED, PSI, rescale
from qddot.runner.stiff.space import X_NEW, F, X
from qddot.runner.stiff.system import (
    evaluate_f,
    evaluate_jacobian,
    factorize_shifted,
    find_non_finite,
    set_weights,
    solve_factorized,
    weighted_norm,
)

MOST_ITERATIONS = 4
#: A failed step whose error stays above this part of the last one although it is half as long.
STAGNANT = 0.8
#: How often a step takes the present state nearer to its algebraic equations where it cannot become shorter.
MOST_SETTLED = 10
EPS = float(np.finfo(np.float64).eps)
#: How a Newton iteration ended.
UNDECIDED, CONVERGED, TOO_SLOW, BLEW_UP = range(4)

RUNNING, NON_FINITE = int(Status.RUNNING), int(Status.NON_FINITE)
STEP_UNDERFLOW, NEWTON_FAILURE = int(Status.STEP_UNDERFLOW), int(Status.NEWTON_FAILURE)


@compiled(**LEAN)
def take_good_step(space, s, v):
    """Take one accepted step from (s.t, v[X]) to (s.t_new, v[X_NEW]); returns RUNNING, or how it failed."""
    _prepare(space, s, v)
    first_failure, last_error, settled = True, np.inf, 0
    while True:
        status = _solve(space, s, v)
        may_settle = s.algebraic and settled < MOST_SETTLED
        if status == NEWTON_FAILURE and may_settle:
            settled += 1
            _settle_on_constraints(v)
            _renew_jacobian(space, s, v)
            continue
        if status != RUNNING:
            return status
        if space.project != 0:
            _project(space, s, v)
        s.error = weighted_norm(s, v, CORRECTION) * ERROR[s.bdf, s.k - 1]
        if s.error <= s.rtol:
            break
        s.failed_attempts += 1
        shortest = s.h <= s.h_min
        if shortest and not may_settle:
            s.failed_state = s.worst
            return STEP_UNDERFLOW
        if s.algebraic and (shortest or s.error > STAGNANT * last_error):
            settled += 1
            _settle_on_constraints(v)
            s.error = np.inf
        choose_after_failure(s, v, first_failure)
        last_error = np.inf if first_failure else s.error
        first_failure = False
        _change_step(space, s, v)
    _update_differences(s.k, v)
    return RUNNING


@compiled(**LEAN)
def _project(space, s, v):
    """Put the new state on the constraints; the correction, of which the differences are made, tells of that too."""
    project_at_end(space, s.t, s.t_new - s.t, row_address(space, X_NEW))
    for i in range(v.shape[1]):
        v[CORRECTION, i] = v[X_NEW, i] - v[PREDICTED, i]


@compiled(**INLINE)
def _settle_on_constraints(v):
    """Take the correction of a step that fails however small it is as one of the present state.

    Algebraic states carry the error that the last Newton iteration left, which no smaller step reduces. The differences
    are those of a smooth solution, and stay.
    """
    for i in range(v.shape[1]):
        v[X, i] += v[CORRECTION, i]


@compiled(**INLINE)
def _prepare(space, s, v):
    """Limit the step, stretch it to the segment's end, and rescale to it."""
    s.h_min = 16.0 * np.spacing(abs(s.t))
    s.h = min(s.h_max, max(s.h_min, s.h))
    if s.h == s.h_min:
        if s.at_h_min:
            s.h = s.last_h  # so that the step can recover
        s.at_h_min = True
    else:
        s.at_h_min = False
    if 1.1 * s.h >= s.segment_end - s.t:
        s.h = s.segment_end - s.t
        s.reaches_end = True
    if s.h != s.last_h or s.k != s.last_k:
        _change_step(space, s, v)


@compiled(**LEAN)
def _change_step(space, s, v):
    """Rescale the differences from s.last_h to s.h and form the new iteration matrix."""
    rescale(s, v, s.k, s.h / s.last_h)
    s.same_steps = 0
    form_matrix(space, s)


@compiled(**LEAN)
def form_matrix(space, s):
    """Factorize M - h/((1 - kappa) gamma) J."""
    factorize_shifted(space, s, 1.0, s.h * INVERSE[s.bdf, s.k - 1])
    s.have_rate = False


@compiled(**INLINE)
def _solve(space, s, v):
    """Solve for the step by Newton's method; where that is slow, renew the Jacobian, then reduce the step."""
    while True:
        _predict(s, v)
        set_inputs(space, s.t_new, side_of(s.t, s.t_new - s.t, 1.0))
        outcome = _newton(space, s, v)
        if outcome == CONVERGED:
            return RUNNING
        s.failed_attempts += 1
        if not s.fresh_jacobian:
            _renew_jacobian(space, s, v)
        elif s.h <= s.h_min or (outcome == BLEW_UP and 0.3 * s.h <= s.h_min):
            worst = s.worst
            culprit = find_non_finite(space, s, v)
            s.failed_state = culprit if culprit >= 0 else worst
            return NON_FINITE if culprit >= 0 or outcome == BLEW_UP else NEWTON_FAILURE
        else:
            s.last_h = s.h
            s.h = max(0.3 * s.h, s.h_min)
            s.reaches_end = False
            _change_step(space, s, v)


@compiled(**INLINE)
def _renew_jacobian(space, s, v):
    """Jacobian at the present state, and the iteration matrix with it."""
    set_inputs(space, s.t, side_of(s.t, s.h, 0.0))
    if space.jacobian_kernel == 0:
        evaluate_f(space, s, s.t, X, F)
    evaluate_jacobian(space, s, v, s.t, s.h)
    s.fresh_jacobian = True
    form_matrix(space, s)


@compiled(**INLINE)
def _predict(s, v):
    """Extrapolate to the new time; psi gathers what the formula takes from the past (equation 3)."""
    s.t_new = s.segment_end if s.reaches_end else s.t + s.h
    for i in range(v.shape[1]):
        change, past = 0.0, 0.0
        for j in range(s.k):
            change += v[DIF + j, i]
            past += v[DIF + j, i] * GAMMA[j]
        v[PSI, i] = past * INVERSE[s.bdf, s.k - 1]
        predicted = v[X, i] + change
        v[PREDICTED, i] = predicted
        v[X_NEW, i] = predicted
        v[CORRECTION, i] = 0.0
    set_weights(v, PREDICTED)


@compiled(**INLINE)
def _newton(space, s, v):
    """Simplified Newton iteration for v[CORRECTION] = v[X_NEW] - v[PREDICTED], the difference of order k + 1."""
    outcome = TOO_SLOW if s.singular else UNDECIDED
    smallest = 100.0 * EPS * weighted_norm(s, v, X_NEW)
    last_norm = 0.0
    iteration = 1
    while outcome == UNDECIDED:
        norm = _newton_correction(space, s, v)
        if not np.isfinite(norm):
            outcome = BLEW_UP
        elif norm <= smallest:
            outcome = CONVERGED
        elif iteration == 1:
            if not s.have_rate:
                s.rate = 0.0
            elif norm * s.rate / (1.0 - s.rate) <= 0.05 * s.rtol:
                outcome = CONVERGED
        elif norm > 0.9 * last_norm:
            outcome = TOO_SLOW
        else:
            s.rate = max(0.9 * s.rate, norm / last_norm)
            s.have_rate = True
            error = norm * s.rate / (1.0 - s.rate)
            if error <= 0.5 * s.rtol:
                outcome = CONVERGED
            elif 0.5 * s.rtol < error * s.rate ** (MOST_ITERATIONS - iteration):
                outcome = TOO_SLOW
        last_norm = norm
        iteration += 1
    return outcome


@compiled(**INLINE)
def _newton_correction(space, s, v):
    """One iteration; returns the weighted size of its correction."""
    evaluate_f(space, s, s.t_new, X_NEW, F)
    scale = s.h * INVERSE[s.bdf, s.k - 1]
    n = v.shape[1]
    for i in range(n):
        v[DELTA, i] = scale * v[F, i]
    if s.unit_mass:
        for i in range(n):
            v[DELTA, i] -= v[PSI, i] + v[CORRECTION, i]
    else:
        mass = square(space, space.mass)
        for i in range(n):
            for j in range(n):
                v[DELTA, i] -= mass[i, j] * (v[PSI, j] + v[CORRECTION, j])
    solve_factorized(space, s, DELTA)
    for i in range(n):
        v[CORRECTION, i] += v[DELTA, i]
        v[X_NEW, i] = v[PREDICTED, i] + v[CORRECTION, i]
    return weighted_norm(s, v, DELTA)


@compiled(**INLINE)
def _update_differences(k, v):
    for i in range(v.shape[1]):
        v[DIF + k + 1, i] = v[CORRECTION, i] - v[DIF + k, i]
        v[DIF + k, i] = v[CORRECTION, i]
    for j in range(k - 1, -1, -1):
        for i in range(v.shape[1]):
            v[DIF + j, i] += v[DIF + j + 1, i]
