"""Step-size control for all lanes at once: what `explicit.controller` and `explicit.adaptive_loop` do for one run."""

import math

from numba import types

from qddot.runner import abi
from qddot.runner.explicit.controller import LEAST_LAST_ERROR, MATLAB
from qddot.runner.lanes.lane import lane_of
from qddot.runner.lanes.pack import LANES
from qddot.runner.machine.elementary import exp, log
from qddot.runner.machine.lane_loop import lane_loop

#: The least step that advances the time is this part of the time: 16 spacings of floating-point numbers.
SIXTEEN_SPACINGS = 16.0 * 2.0**-52


@lane_loop(types.void(abi.POINTER, types.float64))
def propose_steps(control, stretch):
    """Every lane's next attempt: of the size that control wants, or to the next stop where that is near."""
    for lane in range(LANES):
        its = lane_of(control, lane)
        t = its.t
        least = SIXTEEN_SPACINGS * abs(t)
        proposed = its.next
        proposed = proposed if proposed > least else least
        longest = its.longest
        proposed = proposed if proposed < longest else longest
        first = its.failures == 0.0
        size = proposed if first else its.tried
        stop = its.stop
        lands = stretch * size >= stop - t
        its.least = least
        its.proposed = proposed if first else its.proposed
        its.tried = size
        its.lands = 1.0 if lands else 0.0
        its.h = (stop if lands else t + size) - t


@lane_loop(types.void(abi.POINTER, types.int64, types.int64, types.float64))
def size_errors(control, kind, estimates, n):
    """ERROR: how large every lane's error is, from the sizes of its estimates; a good step's is at most 1."""
    for lane in range(LANES):
        its = lane_of(control, lane)
        error = its.error
        error = error if kind == MATLAB else math.sqrt(error / n)
        length = math.sqrt(error * error + 0.01 * (its.error_2 / n))
        both = error * (error / (1.0 if length == 0.0 else length))
        both = both if error < math.inf else error
        its.error = both if estimates > 1 else error


@lane_loop(types.int64(abi.POINTER, types.int64, *[types.float64] * 5))
def judge_steps(control, kind, order, beta, safety, least_factor, most):
    """Accept or reject every lane's attempt and size the next; returns how many want a closer look.

    Those are the ones that come to a stop or a sample, and the ones that are stuck (GOOD = -1).
    """
    found = 0
    for lane in range(LANES):
        its = lane_of(control, lane)
        error, active = its.error, its.active > 0.0
        good = active & (error <= 1.0)
        power = exp((0.75 * beta - 1.0 / order) * log(error if error > 1e-30 else 1e-30))
        last = its.last_error
        last = last if last > LEAST_LAST_ERROR else LEAST_LAST_ERROR
        failures = its.failures
        greatest = 1.0 if failures > 0.0 else most
        factor = safety * power * exp(beta * log(last))
        factor = factor if factor < greatest else greatest
        factor = factor if (factor > least_factor) | (kind == MATLAB) else least_factor
        factor = 1.0 if (failures > 0.0) & (kind == MATLAB) else factor
        down = safety * power
        down = down if down > least_factor else least_factor
        down = 0.5 if (failures > 0.0) & (kind == MATLAB) else down
        h, least = its.h, its.least
        proposed, tried = its.proposed, its.tried
        lands = its.lands > 0.0
        larger = h * factor
        larger = proposed if lands & (failures == 0.0) & (larger < proposed) else larger
        smaller = h * down
        smaller = smaller if smaller > least else least
        stuck = active & (not good) & ((tried <= least) | (h <= least))
        target = its.stop if lands else its.t + h
        its.next = larger if good else its.next
        its.tried = tried if good else smaller
        its.failures = 0.0 if good else failures + 1.0
        its.last_error = error if good else its.last_error
        its.steps += 1.0 if good else 0.0
        its.failed += 1.0 if active & (not good) else 0.0
        its.good = 1.0 if good else (-1.0 if stuck else 0.0)
        its.target = target
        found += stuck | (good & (lands | (its.sample <= target)))
    return found


@lane_loop(types.void(abi.POINTER))
def end_steps(control):
    """The end of an accepted step is the present."""
    for lane in range(LANES):
        its = lane_of(control, lane)
        good = its.good > 0.0
        its.t = its.target if good else its.t
        its.good = 1.0 if good else 0.0
