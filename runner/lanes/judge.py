"""Step-size control for all lanes at once: what `explicit.controller` and `explicit.adaptive_loop` do for one run."""

import math

from numba import types

from qddot.runner import abi
from qddot.runner.explicit.controller import LEAST_LAST_ERROR, MATLAB
from qddot.runner.lanes.pack import (
    ACTIVE,
    ERROR,
    ERROR_2,
    FAILED,
    FAILURES,
    GOOD,
    LANDS,
    LANES,
    LAST_ERROR,
    LEAST,
    LONGEST,
    NEXT,
    PROPOSED,
    SAMPLE,
    STEPS,
    STOP,
    TARGET,
    TRIED,
    H,
    T,
)
from qddot.runner.machine.elementary import exp, log
from qddot.runner.machine.lane_loop import lane_loop

#: The least step that advances the time is this part of the time: 16 spacings of floating-point numbers.
SIXTEEN_SPACINGS = 16.0 * 2.0**-52


@lane_loop(types.void(abi.POINTER, types.float64))
def propose_steps(control, stretch):
    """Every lane's next attempt: of the size that control wants, or to the next stop where that is near."""
    for lane in range(LANES):
        t = control[T * LANES + lane]
        least = SIXTEEN_SPACINGS * abs(t)
        proposed = control[NEXT * LANES + lane]
        proposed = proposed if proposed > least else least
        longest = control[LONGEST * LANES + lane]
        proposed = proposed if proposed < longest else longest
        first = control[FAILURES * LANES + lane] == 0.0
        size = proposed if first else control[TRIED * LANES + lane]
        stop = control[STOP * LANES + lane]
        lands = stretch * size >= stop - t
        control[LEAST * LANES + lane] = least
        control[PROPOSED * LANES + lane] = proposed if first else control[PROPOSED * LANES + lane]
        control[TRIED * LANES + lane] = size
        control[LANDS * LANES + lane] = 1.0 if lands else 0.0
        control[H * LANES + lane] = (stop if lands else t + size) - t


@lane_loop(types.void(abi.POINTER, types.int64, types.int64, types.float64))
def size_errors(control, kind, estimates, n):
    """ERROR: how large every lane's error is, from the sizes of its estimates; a good step's is at most 1."""
    for lane in range(LANES):
        error = control[ERROR * LANES + lane]
        error = error if kind == MATLAB else math.sqrt(error / n)
        length = math.sqrt(error * error + 0.01 * (control[ERROR_2 * LANES + lane] / n))
        both = error * (error / (1.0 if length == 0.0 else length))
        both = both if error < math.inf else error
        control[ERROR * LANES + lane] = both if estimates > 1 else error


@lane_loop(types.int64(abi.POINTER, types.int64, *[types.float64] * 5))
def judge_steps(control, kind, order, beta, safety, least_factor, most):
    """Accept or reject every lane's attempt and size the next; returns how many want a closer look.

    Those are the ones that come to a stop or a sample, and the ones that are stuck (GOOD = -1).
    """
    found = 0
    for lane in range(LANES):
        error, active = control[ERROR * LANES + lane], control[ACTIVE * LANES + lane] > 0.0
        good = active & (error <= 1.0)
        power = exp((0.75 * beta - 1.0 / order) * log(error if error > 1e-30 else 1e-30))
        last = control[LAST_ERROR * LANES + lane]
        last = last if last > LEAST_LAST_ERROR else LEAST_LAST_ERROR
        failures = control[FAILURES * LANES + lane]
        greatest = 1.0 if failures > 0.0 else most
        factor = safety * power * exp(beta * log(last))
        factor = factor if factor < greatest else greatest
        factor = factor if (factor > least_factor) | (kind == MATLAB) else least_factor
        factor = 1.0 if (failures > 0.0) & (kind == MATLAB) else factor
        down = safety * power
        down = down if down > least_factor else least_factor
        down = 0.5 if (failures > 0.0) & (kind == MATLAB) else down
        h, least = control[H * LANES + lane], control[LEAST * LANES + lane]
        proposed, tried = control[PROPOSED * LANES + lane], control[TRIED * LANES + lane]
        lands = control[LANDS * LANES + lane] > 0.0
        larger = h * factor
        larger = proposed if lands & (failures == 0.0) & (larger < proposed) else larger
        smaller = h * down
        smaller = smaller if smaller > least else least
        stuck = active & (not good) & ((tried <= least) | (h <= least))
        target = control[STOP * LANES + lane] if lands else control[T * LANES + lane] + h
        control[NEXT * LANES + lane] = larger if good else control[NEXT * LANES + lane]
        control[TRIED * LANES + lane] = tried if good else smaller
        control[FAILURES * LANES + lane] = 0.0 if good else failures + 1.0
        control[LAST_ERROR * LANES + lane] = error if good else control[LAST_ERROR * LANES + lane]
        control[STEPS * LANES + lane] += 1.0 if good else 0.0
        control[FAILED * LANES + lane] += 1.0 if active & (not good) else 0.0
        control[GOOD * LANES + lane] = 1.0 if good else (-1.0 if stuck else 0.0)
        control[TARGET * LANES + lane] = target
        found += stuck | (good & (lands | (control[SAMPLE * LANES + lane] <= target)))
    return found


@lane_loop(types.void(abi.POINTER))
def end_steps(control):
    """The end of an accepted step is the present."""
    for lane in range(LANES):
        good = control[GOOD * LANES + lane] > 0.0
        control[T * LANES + lane] = control[TARGET * LANES + lane] if good else control[T * LANES + lane]
        control[GOOD * LANES + lane] = 1.0 if good else 0.0
