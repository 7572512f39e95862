"""How large rows of the workspace are beside the tolerances, and the first step from there."""

import numpy as np

from qddot.runner.explicit.slopes import slope
from qddot.runner.explicit.workspace import ATOL, ERROR, K0, NEW, RTOL, SCALED, STAGE, Y, block, copy
from qddot.runner.frame.space import look_up, states
from qddot.runner.frame.step_control import MATLAB, matlab_first_step, scaled, settled_step, tolerance, trial_step
from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.memory import BLOCK, LEAN


@compiled(**LEAN)
def scale(space, control, row):
    """SCALED = |row| over the tolerance at Y and NEW, infinite where that is not finite or NEW beyond the limit."""
    matlab, limit = control.kind == MATLAB, control.limit
    for b in range(space.blocks):
        old, new, error = block(space, Y, b), block(space, NEW, b), block(space, row, b)
        rtol, atol, ratio = block(space, RTOL, b), block(space, ATOL, b), block(space, SCALED, b)
        for m in range(BLOCK):
            size, new_size = abs(old[m]), abs(new[m])
            allowed = tolerance(rtol[m], atol[m], size if size > new_size else new_size, matlab)
            ratio[m] = scaled(error[m], allowed, new_size, limit)


@compiled(**LEAN)
def norm(space, control, row):
    """Size of a row relative to the tolerance: largest component or root mean square, as the controller has it."""
    scale(space, control, row)
    matlab = control.kind == MATLAB
    p0 = p1 = p2 = p3 = 0.0
    for b in range(space.blocks):
        ratio = block(space, SCALED, b)
        for m in range(0, BLOCK, 4):
            s0, s1, s2, s3 = ratio[m], ratio[m + 1], ratio[m + 2], ratio[m + 3]
            if matlab:
                p0, p1, p2, p3 = max(p0, s0), max(p1, s1), max(p2, s2), max(p3, s3)
            else:
                p0, p1, p2, p3 = p0 + s0 * s0, p1 + s1 * s1, p2 + s2 * s2, p3 + s3 * s3
    return max(p0, p1, p2, p3) if matlab else np.sqrt((p0 + p1 + p2 + p3) / space.n)


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
