"""`rodas5p`: a stiff one-step method of order 5, L-stable and without a Newton iteration, for M x' = f(t, x).

For lightly damped oscillations, where backward differences are barely stable, and for loose to moderate tolerances.
G. Steinebach, BIT Numer. Math. 63 (2023) 27; E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, IV.7.
"""

from typing import TYPE_CHECKING

import numpy as np

from qddot.runner.frame.pieces import Recorder
from qddot.runner.frame.step_control import CONTROL as STEP_CONTROL
from qddot.runner.frame.step_control import control_for
from qddot.runner.frame.workplace import run_in_place
from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.memory import BY_ADDRESS, LEAN, record_at
from qddot.runner.options import Options
from qddot.runner.problem import Problem, Trajectory
from qddot.runner.stiff.driver import StiffWorkplace, stiff_workplace
from qddot.runner.stiff.loop import take_steps
from qddot.runner.stiff.rosenbrock_step import ARGUMENT, DFDT, PAST, ROWS, U, prepare_polynomial, take_good_step
from qddot.runner.stiff.space import F, X, control_type, space_at
from qddot.runner.stiff.system import (
    CENTRAL_BELOW,
    ROOT_EPS,
    apply_inverse_mass,
    multiply_jacobian,
    set_weights,
    time_derivative,
    weighted_norm,
)

if TYPE_CHECKING:
    from qddot.runner.method import Method

#: The estimate of the error is O(h^5).
ERROR_ORDER = 5
DEFAULT_CONTROLLER = "pi"
#: Settings of the step control; every run has rtol and limit.
STEPPING = [name for name in STEP_CONTROL.names or () if name not in ("rtol", "limit")]
#: next_h: the controller's step; last_error: of the step before.
CONTROL = control_type([*((name, STEP_CONTROL[name]) for name in STEPPING), ("next_h", "f8"), ("last_error", "f8")])
_scalars_at = record_at(CONTROL)


@compiled(**LEAN)
def first_step(space, s, v):
    """A first step that changes the state by about rtol^(1/5), judged by x' and x''."""
    s.last_error = 1.0
    s.h = min(s.h_max, s.segment_end - s.t)
    if s.first_step > 0.0:
        s.h, s.first_step = min(s.h, s.first_step), 0.0
        return
    s.h = min(s.h, s.longest_first)
    set_weights(v, X)
    part = 0.8 * s.rtol ** (1.0 / ERROR_ORDER)
    apply_inverse_mass(space, s, v, F, U)
    s.h = min(s.h, part / weighted_norm(s, v, U))
    time_derivative(space, s, v, min(ROOT_EPS * max(abs(s.t), abs(s.t + s.h)), s.h), DFDT)
    multiply_jacobian(space, v, U, PAST)
    for i in range(space.n):
        v[PAST, i] += v[DFDT, i]
    apply_inverse_mass(space, s, v, PAST, ARGUMENT)
    s.h = min(s.h, part * np.sqrt(2.0 / weighted_norm(s, v, ARGUMENT)))


@compiled(**LEAN)
def choose_next(s, v):
    """The next step is the controller's."""
    s.h = s.next_h


@compiled(**BY_ADDRESS)
def prepare(where):
    """Write the polynomial of the step that the space at an address has."""
    space = space_at(where)
    prepare_polynomial(space, _scalars_at(space.scalars))


def run_slice(space, s, log, watch, sides, most_steps):
    """Take at most `most_steps` steps; returns a Status."""
    return take_steps(space, s, log, watch, sides, most_steps, first_step, take_good_step, choose_next)


def integrate(problem: Problem, method: "Method", options: Options, recorder: Recorder | None = None) -> Trajectory:
    """Integrate by Rodas5P with the step control of options.controller, "pi" by default.

    The Jacobian comes from problem.jacobian, or from differences: forward ones, or, where rtol is below CENTRAL_BELOW,
    central ones, twice as many evaluations. Saves options.refine points a step (1), or at
    options.output_times by dense output. Events end up in extras["events"], an `EventLog`. Raises ValueError for a mass
    matrix or atol of the wrong shape, an empty span, output times outside it, and initial values that cannot be made
    consistent.
    """
    return run_in_place(_workplace, problem, method, options, recorder)


def _workplace(problem: Problem, method: "Method", options: Options, recorder: Recorder | None) -> StiffWorkplace:
    name = options.controller or DEFAULT_CONTROLLER
    step_control = control_for(name, ERROR_ORDER, options.least_rtol, float(options.divergence_limit))
    central = options.least_rtol < CENTRAL_BELOW
    stepping = {field: step_control[field] for field in STEPPING}
    return stiff_workplace(problem, options, recorder, run_slice, prepare, ROWS, CONTROL, central=central, **stepping)
