"""Step-size control for all lanes at once: what `explicit.adaptive_loop` does for one run."""

import math

from numba import typeof, types

from qddot.runner import abi
from qddot.runner.frame.step_control import (
    CONTROL,
    MATLAB,
    Factors,
    after_failure,
    after_success,
    at_least,
    of_two_estimates,
)
from qddot.runner.inputs.instants import rounding
from qddot.runner.lanes.lane import lane_of
from qddot.runner.lanes.pack import LANES
from qddot.runner.machine.lane_loop import lane_loop
from qddot.runner.machine.memory import record

#: Step-size control, whose constants all lanes have in common.
CONTROL_TYPE = typeof(record(CONTROL))


@lane_loop(types.void(abi.POINTER, types.float64))
def propose_steps(rows, stretch):
    """Every lane's next attempt: of the size that control wants, or to the next stop where that is near."""
    for lane in range(LANES):
        its = lane_of(rows, lane)
        least = rounding(its.t)
        proposed = at_least(least, its.next)
        proposed = proposed if proposed < its.longest else its.longest
        first = its.failures == 0.0
        size = proposed if first else its.tried
        lands = stretch * size >= its.stop - its.t
        its.least = least
        its.proposed = proposed if first else its.proposed
        its.tried = size
        its.lands = 1.0 if lands else 0.0
        its.h = (its.stop if lands else its.t + size) - its.t


@lane_loop(types.void(abi.POINTER, types.int64, types.int64, types.float64))
def size_errors(rows, kind, estimates, n):
    """How large every lane's error is, from the sizes of its estimates; a good step's is at most 1."""
    for lane in range(LANES):
        its = lane_of(rows, lane)
        error = its.error if kind == MATLAB else math.sqrt(its.error / n)
        its.error = of_two_estimates(error, math.sqrt(its.error_2 / n)) if estimates > 1 else error


@lane_loop(types.int64(abi.POINTER, typeof(Factors(0, *[0.0] * 5))))
def judge_steps(rows, factors):
    """Accept or reject every lane's attempt and size the next; returns how many want a closer look.

    Those are the ones that come to a stop or a sample, and the ones that are stuck (good = -1).
    """
    found = 0
    for lane in range(LANES):
        its = lane_of(rows, lane)
        error, h, failures, active = its.error, its.h, its.failures, its.active > 0.0
        least, proposed, tried, lands = its.least, its.proposed, its.tried, its.lands > 0.0
        good = active & (error <= 1.0)
        larger = h * after_success(factors, error, its.last_error, failures > 0.0)
        larger = proposed if lands & (failures == 0.0) & (larger < proposed) else larger
        smaller = at_least(least, h * after_failure(factors, error, failures + 1.0))
        stuck = active & (not good) & ((tried <= least) | (h <= least) | ((smaller <= least) & (not error < math.inf)))
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
def end_steps(rows):
    """The end of an accepted step is the present."""
    for lane in range(LANES):
        its = lane_of(rows, lane)
        good = its.good > 0.0
        its.t = its.target if good else its.t
        its.good = 1.0 if good else 0.0
