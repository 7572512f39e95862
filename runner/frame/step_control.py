"""Step control, each idea once for all families and for lanes: how large an error is, and what steps become of it.

An error is scaled so that a step is good where it does not exceed 1. Families hand over their constants as data.
Nothing here branches or calls, so that a loop over lanes that it is compiled into becomes vectors.

    matlab    L. F. Shampine, M. W. Reichelt, The MATLAB ODE Suite, SIAM J. Sci. Comput. 18 (1997) 1-22, and its code:
              largest component of error / max(rtol max(|y|, |y_new|), atol).
    standard  E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I (HNW), section II.4:
              root mean square of error / (atol + rtol max(|y|, |y_new|)).
    pi        the same with a proportional-integral controller (Gustafsson), HNW II and its code DOPRI5, section IV.2.
"""

import math
from typing import NamedTuple

import numpy as np

from qddot.runner.machine.bits import elementary
from qddot.runner.machine.exponentials import exp, log
from qddot.runner.machine.memory import layout, record

MATLAB, STANDARD, PI = range(3)
NAMES = {"matlab": MATLAB, "standard": STANDARD, "pi": PI}
#: The PI controller takes the last error to be at least this; no error counts as less than the other.
LEAST_LAST_ERROR, LEAST_ERROR = 1e-4, 1e-30

#: Fields of step-size control. kind: MATLAB, STANDARD or PI. rtol: the least of all states. limit: a state of this
#: magnitude counts as diverged. order: the error estimate is O(h^order). The next step is this one times safety *
#: last_error^beta / error^(1/order - 3/4 beta), at least `least` and at most `most` times. A step that reaches the next
#: stop when stretched by `stretch` is stretched.
CONTROL = layout("kind", "rtol limit order beta safety least most stretch")


class Factors(NamedTuple):
    """The fields that `after_success` and `after_failure` read, for loops over lanes, where they must be at hand."""

    kind: int
    order: float
    beta: float
    safety: float
    least: float
    most: float


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


@elementary
def at_least(least, value):
    """The value, `least` where it is smaller or no number."""
    return value if value > least else least


@elementary
def tolerance(rtol, atol, size, largest):
    """How large the error of a state of this size may be: the larger of both parts where `largest`, else their sum."""
    part = rtol * size
    return at_least(atol, part) if largest else part + atol


@elementary
def scaled(error, allowed, size, limit):
    """An error over its tolerance, infinite where that is not finite or the state beyond the limit."""
    ratio = abs(error) / allowed
    return ratio if (ratio < math.inf) & (size <= limit) else math.inf


@elementary
def of_two_estimates(error, second):
    """The error of DOP853 from its estimates of order 5 and 3 (HNW, equation II.10.16)."""
    length = math.sqrt(error * error + 0.01 * second * second)
    both = error * (error / (1.0 if length == 0.0 else length))
    return both if error < math.inf else error


@elementary
def by_error(error, exponent, safety):
    """The factor safety * error^exponent by which a step of this error has the one wanted (HNW, equation II.4.13)."""
    return safety * exp(exponent * log(at_least(LEAST_ERROR, error)))


@elementary
def asked_for(control, error):
    """`by_error` with the exponent of a controller."""
    return by_error(error, 0.75 * control.beta - 1.0 / control.order, control.safety)


@elementary
def after_success(control, error, last_error, failed):
    """Factor by which the next step is larger; failed: whether this one was tried more than once."""
    matlab = control.kind == MATLAB
    factor = asked_for(control, error)
    if control.beta > 0.0:
        factor *= exp(control.beta * log(at_least(LEAST_LAST_ERROR, last_error)))
    greatest = 1.0 if failed else control.most
    factor = factor if factor < greatest else greatest
    return (1.0 if failed else factor) if matlab else at_least(control.least, factor)


@elementary
def after_failure(control, error, failures):
    """Factor by which a step is tried smaller after so many failures."""
    halved = (control.kind == MATLAB) & (failures > 1)
    return 0.5 if halved else at_least(control.least, asked_for(control, error))


@elementary
def at_rate(rate, longest):
    """The step that takes 1/rate, at most `longest`, also where the rate is 0."""
    return 1.0 / rate if longest * rate > 1.0 else longest


@elementary
def matlab_first_step(speed, rtol, order, longest):
    """Size of MATLAB's first step, for a size of the slope relative to the tolerance."""
    return at_rate(speed * rtol ** (1.0 - 1.0 / order) / 0.8, longest)


@elementary
def trial_step(size, speed):
    """Length of the explicit Euler step that tells the second derivative (HNW II.4, steps a to c)."""
    return 1e-6 if (size < 1e-5) | (speed < 1e-5) else 0.01 * size / speed


@elementary
def settled_step(h, greatest, order):
    """Size of a first step from that of the trial and the larger of the derivatives (HNW II.4, steps e and f)."""
    by_order = at_least(1e-6, 1e-3 * h) if greatest <= 1e-15 else (0.01 / greatest) ** (1.0 / order)
    return min(100.0 * h, by_order)
