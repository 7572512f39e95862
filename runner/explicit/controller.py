"""Step-size control: how large an error is, and how large the next step should be. It does not know the method.

An error is scaled so that a step is good where it does not exceed 1.

    matlab    L. F. Shampine, M. W. Reichelt, The MATLAB ODE Suite, SIAM J. Sci. Comput. 18 (1997) 1-22, and its code:
              largest component of error / max(rtol max(|y|, |y_new|), atol).
    standard  E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I (HNW), section II.4:
              root mean square of error / (atol + rtol max(|y|, |y_new|)).
    pi        the same with a proportional-integral controller (Gustafsson), HNW II and its code DOPRI5, section IV.2.
"""

import numpy as np

from qddot.runner.explicit.slopes import slope
from qddot.runner.explicit.workspace import ATOL, ERROR, K0, NEW, RTOL, SCALED, STAGE, Y, block, copy
from qddot.runner.frame.space import look_up, states
from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.memory import BLOCK, LEAN, layout, record

MATLAB, STANDARD, PI = range(3)
NAMES = {"matlab": MATLAB, "standard": STANDARD, "pi": PI}
#: The PI controller takes the last error to be at least this.
LEAST_LAST_ERROR = 1e-4


#: Fields of step-size control. kind: MATLAB, STANDARD or PI. rtol: the least of all states. limit: a state of this
#: magnitude counts as diverged. order: the error estimate is O(h^order). The next step is this one times safety *
#: last_error^beta / error^(1/order - 3/4 beta), at least `least` and at most `most` times. A step that reaches the next
#: stop when stretched by `stretch` is stretched.
CONTROL = layout("kind", "rtol limit order beta safety least most stretch")


def control_for(name: str, order: int, rtol: float, limit: float) -> np.void:
    """The settings of a controller for an error estimate O(h^order).

    Raises ValueError naming the controllers there are. As published: after a first failure MATLAB's ode23 (order 3) at
    most halves the step, ode45 divides it by up to ten. Hairer's DOP853 (order 8) bounds factors by 1/3 and 6, DOPRI5
    by 1/5 and 10.
    """
    if name not in NAMES:
        raise ValueError(f"controller is {name!r}, expected one of {', '.join(map(repr, NAMES))}")
    if name == "matlab":
        least, most, safety, stretch, beta = (0.5 if order == 3 else 0.1), 5.0, 0.8, 1.1, 0.0
    else:
        least, most = (1 / 3, 6.0) if order == 8 else (0.2, 10.0)
        safety, stretch, beta = 0.9, 1.01, 0.2 / order if name == "pi" else 0.0
    factors = {"beta": beta, "safety": safety, "least": least, "most": most, "stretch": stretch}
    return record(CONTROL, kind=NAMES[name], rtol=rtol, limit=limit, order=order, **factors)


@compiled(**LEAN)
def scale(space, control, row):
    """SCALED = |row| over the tolerance at Y and NEW, infinite where that is not finite or NEW beyond the limit."""
    matlab, limit = control.kind == MATLAB, control.limit
    for b in range(space.blocks):
        old, new, error = block(space, Y, b), block(space, NEW, b), block(space, row, b)
        rtol, atol, scaled = block(space, RTOL, b), block(space, ATOL, b), block(space, SCALED, b)
        for m in range(BLOCK):
            size, new_size = abs(old[m]), abs(new[m])
            part = rtol[m] * (size if size > new_size else new_size)
            larger = part if part > atol[m] else atol[m]
            ratio = abs(error[m]) / (larger if matlab else part + atol[m])
            scaled[m] = ratio if ratio < np.inf and new_size <= limit else np.inf


@compiled(**LEAN)
def norm(space, control, row):
    """Size of a row relative to the tolerance: largest component or root mean square, as the controller has it."""
    scale(space, control, row)
    matlab = control.kind == MATLAB
    p0 = p1 = p2 = p3 = 0.0
    for b in range(space.blocks):
        scaled = block(space, SCALED, b)
        for m in range(0, BLOCK, 4):
            s0, s1, s2, s3 = scaled[m], scaled[m + 1], scaled[m + 2], scaled[m + 3]
            if matlab:
                p0, p1, p2, p3 = max(p0, s0), max(p1, s1), max(p2, s2), max(p3, s3)
            else:
                p0, p1, p2, p3 = p0 + s0 * s0, p1 + s1 * s1, p2 + s2 * s2, p3 + s3 * s3
    return max(p0, p1, p2, p3) if matlab else np.sqrt((p0 + p1 + p2 + p3) / space.n)


@compiled(**LEAN)
def combined(error, second):
    """The error of DOP853 from its estimates of order 5 and 3 (HNW, equation II.10.16)."""
    if error == 0.0:
        return 0.0
    return error * (error / np.sqrt(error * error + 0.01 * second * second)) if error < np.inf else error


@compiled(**LEAN)
def after_success(control, error, last_error, failed):
    """Factor by which the next step is larger."""
    error = max(error, 1e-30)
    if control.kind == MATLAB:
        return 1.0 if failed else min(control.most, control.safety * error ** (-1.0 / control.order))
    factor = control.safety * error ** (0.75 * control.beta - 1.0 / control.order)
    if control.kind == PI:
        factor *= max(last_error, LEAST_LAST_ERROR) ** control.beta
    return max(control.least, min(1.0 if failed else control.most, factor))


@compiled(**LEAN)
def after_failure(control, error, failures):
    """Factor by which a step is tried smaller after so many failures."""
    if control.kind == MATLAB and failures > 1:
        return 0.5
    return max(control.least, control.safety * error ** (0.75 * control.beta - 1.0 / control.order))


@compiled(**LEAN)
def first_step(space, control, t, longest):
    """Size of a first step from Y with slope 0, at most `longest`. Writes NEW, STAGE, ERROR and slope 1.

    MATLAB: the published rule. Otherwise HNW section II.4: an explicit Euler step estimates the second derivative.
    """
    copy(space, Y, NEW)
    speed = norm(space, control, K0)
    if control.kind == MATLAB:
        return matlab_first_step(speed, control.rtol, control.order, longest)
    h = trial_step(norm(space, control, Y), speed)
    bend = second_derivative(space, control, t, min(h, longest))
    return min(settled_step(h, max(speed, bend), control.order), longest)


@compiled(**LEAN)
def matlab_first_step(speed, rtol, order, longest):
    """Size of MATLAB's first step, for a relative size of the slope."""
    rate = speed * rtol ** (1.0 - 1.0 / order) / 0.8
    return 1.0 / rate if longest * rate > 1.0 else longest


@compiled(**LEAN)
def trial_step(size, speed):
    """Length of the explicit Euler step that tells the second derivative (HNW II.4, steps a to c)."""
    return 1e-6 if size < 1e-5 or speed < 1e-5 else 0.01 * size / speed


@compiled(**LEAN)
def settled_step(h, greatest, order):
    """Size of a first step from that of the trial and the larger of the derivatives (HNW II.4, steps e and f)."""
    by_order = max(1e-6, 1e-3 * h) if greatest <= 1e-15 else (0.01 / greatest) ** (1.0 / order)
    return min(100.0 * h, by_order)


@compiled(**LEAN)
def second_derivative(space, control, t, h):
    """Relative size of the second derivative at Y, by an explicit Euler step h."""
    y, k, stage, bend = states(space, Y), states(space, K0), states(space, STAGE), states(space, ERROR)
    for i in range(space.n):
        stage[i] = y[i] + h * k[i]
    look_up(space, t, h, 1.0)
    slope(space, t + h, STAGE, K0 + 1)
    k_1 = states(space, K0 + 1)
    for i in range(space.n):
        bend[i] = k_1[i] - k[i]
    return norm(space, control, ERROR) / h
