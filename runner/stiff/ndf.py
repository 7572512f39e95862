"""`ode15s`: numerical differentiation formulas of orders 1 to 5 at quasi-constant step, for stiff M x' = f(t, x).

L. F. Shampine, M. W. Reichelt, "The MATLAB ODE Suite", SIAM J. Sci. Comput. 18 (1997) 1-22; singular M after Shampine,
Reichelt, Kierzenka, SIAM Review 41 (1999) 538-552.
"""

from typing import TYPE_CHECKING

import numpy as np

from qddot.runner.frame.pieces import Recorder
from qddot.runner.frame.step_control import at_rate, matlab_first_step
from qddot.runner.frame.workplace import run_in_place
from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.memory import BY_ADDRESS, INLINE, record_at
from qddot.runner.options import Options
from qddot.runner.problem import Problem, Trajectory
from qddot.runner.stiff.driver import StiffWorkplace, stiff_workplace
from qddot.runner.stiff.loop import take_steps
from qddot.runner.stiff.ndf_choice import choose_after_success
from qddot.runner.stiff.ndf_formulas import (
    CORRECTION,
    DELTA,
    DIF,
    HIGHEST_ORDER,
    PREDICTED,
    PSI,
    ROWS,
    prepare_polynomial,
)
from qddot.runner.stiff.ndf_step import form_matrix, take_good_step
from qddot.runner.stiff.space import F, X, control_type, space_at
from qddot.runner.stiff.system import (
    ROOT_EPS,
    apply_inverse_mass,
    multiply_jacobian,
    set_weights,
    time_derivative,
    weighted_norm,
)

if TYPE_CHECKING:
    from qddot.runner.method import Method

#: The error of backward Euler, which begins, is O(h^2).
FIRST_ORDER = 2
#: k: order; last_h, last_k: of the step before; same_steps: taken with this h and k; rate: of Newton's convergence;
#: R, RU: see `ndf_formulas.rescale`.
CONTROL = control_type(
    [
        *((name, "f8") for name in ("last_h", "rate", "error")),
        *((name, "i8") for name in ("k", "last_k", "same_steps", "max_order", "bdf")),
        *((name, "?") for name in ("have_rate", "at_h_min")),
        *((name, "f8", (HIGHEST_ORDER, HIGHEST_ORDER)) for name in ("R", "RU")),
    ]
)
_scalars_at = record_at(CONTROL)


@compiled(**INLINE)
def first_step(space, s, v):
    """Slope and first step at the start of a segment: half the tolerance for the error of backward Euler, h^2 x''/2."""
    apply_inverse_mass(space, s, v, F, DELTA)
    set_weights(v, X)
    s.h_min = 16.0 * np.spacing(abs(s.t))
    s.h = min(s.h_max, max(s.h_min, s.first_step))
    if s.first_step == 0.0:
        longest = min(s.h_max, s.segment_end - s.t, s.longest_first)
        s.h = max(matlab_first_step(weighted_norm(s, v, DELTA) / s.rtol, s.rtol, FIRST_ORDER, longest), s.h_min)
        time_derivative(space, s, v, min(ROOT_EPS * max(abs(s.t), abs(s.t + s.h)), s.h), PSI)
        multiply_jacobian(space, v, DELTA, PREDICTED)
        for i in range(space.n):
            v[PREDICTED, i] += v[PSI, i]
        apply_inverse_mass(space, s, v, PREDICTED, CORRECTION)
        s.h = max(at_rate(1.25 * np.sqrt(0.5 * weighted_norm(s, v, CORRECTION) / s.rtol), longest), s.h_min)
    s.first_step = 0.0
    for i in range(space.n):
        for j in range(HIGHEST_ORDER + 2):
            v[DIF + j, i] = 0.0
        v[DIF, i] = s.h * v[DELTA, i]
    s.k, s.last_k, s.last_h, s.same_steps, s.at_h_min = 1, 1, s.h, 0, False
    form_matrix(space, s)


@compiled(**BY_ADDRESS)
def prepare(where):
    """Write the polynomial of the step that the space at an address has."""
    space = space_at(where)
    prepare_polynomial(space, _scalars_at(space.scalars))


def run_slice(space, s, log, watch, sides, most_steps):
    """Take at most `most_steps` steps; returns a Status."""
    return take_steps(
        space,
        s,
        log,
        watch,
        sides,
        most_steps,
        first_step,
        take_good_step,
        choose_after_success,
    )


def integrate(problem: Problem, method: "Method", options: Options, recorder: Recorder | None = None) -> Trajectory:
    """Integrate by the NDFs of orders 1 to options.max_order, or by the BDFs where options.bdf.

    The Jacobian comes from problem.jacobian, or from forward differences. Saves options.refine points a step (1), or at
    options.output_times by dense output. Events end up in extras["events"], an `EventLog`. Raises ValueError for a mass
    matrix or atol of the wrong shape, an empty span, output times outside it, and initial values that cannot be made
    consistent.
    """
    return run_in_place(_workplace, problem, method, options, recorder)


def _workplace(problem: Problem, method: "Method", options: Options, recorder: Recorder | None) -> StiffWorkplace:
    own = {"max_order": options.max_order, "bdf": options.bdf}
    return stiff_workplace(problem, options, recorder, run_slice, prepare, ROWS, CONTROL, **own)
