"""Step and order of the quasi-constant-step NDFs after a failed error test and after an accepted step.

Shampine & Reichelt (1997), section 2.3, with the constants of the published code.
"""

from qddot.runner.frame.step_control import at_least, by_error
from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.memory import INLINE, LEAN
from qddot.runner.stiff.ndf_formulas import CORRECTION, DIF, ERROR
from qddot.runner.stiff.space import WEIGHTS
from qddot.runner.stiff.system import weighted_norm


@compiled(**INLINE)
def choose_after_failure(s, v, first_failure):
    """The step, and perhaps the order below, to try after a failed error test."""
    s.last_h = s.h
    if not first_failure:
        s.h = max(s.h_min, 0.5 * s.h)
    else:
        best = s.h * at_least(0.1, by_error(s.error / s.rtol, -1.0 / (s.k + 1), 0.833))
        if s.k > 1:
            below = s.h * at_least(0.1, by_error(_error_one_below(s, v) / s.rtol, -1.0 / s.k, 0.769))
            if below > best:
                best = min(s.h, below)
                s.k -= 1
        s.h = max(s.h_min, best)
    if s.h < s.last_h:
        s.reaches_end = False


@compiled(**INLINE)
def _error_one_below(s, v):
    largest = 0.0
    for i in range(v.shape[1]):
        largest = max(largest, abs(v[DIF + s.k - 1, i] + v[CORRECTION, i]) * v[WEIGHTS, i])
    return largest * ERROR[s.bdf, s.k - 2]


@compiled(**LEAN)
def choose_after_success(s, v):
    """Step and order after an accepted step; they change only after k + 2 steps alike, and only to go faster."""
    s.last_k = s.k
    s.last_h = s.h
    s.same_steps = min(s.same_steps + 1, s.max_order + 2)
    if s.same_steps < s.k + 2:
        return
    k, best = s.k, _step_for(s, 1.2, s.error, s.k)
    if s.k > 1:
        below = _step_for(s, 1.3, weighted_norm(s, v, DIF + s.k - 1) * ERROR[s.bdf, s.k - 2], s.k - 1)
        if below > best:
            k, best = s.k - 1, below
    if s.k < s.max_order:
        above = _step_for(s, 1.4, weighted_norm(s, v, DIF + s.k + 1) * ERROR[s.bdf, s.k], s.k + 1)
        if above > best:
            k, best = s.k + 1, above
    if best > s.h:
        s.h, s.k = best, k


@compiled(**INLINE)
def _step_for(s, safety, error, k):
    """The step that order k could take, at most ten times the present one."""
    return s.h * min(10.0, by_error(error / s.rtol, -1.0 / (k + 1), 1.0 / safety))
