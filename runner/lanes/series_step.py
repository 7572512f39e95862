"""Length and judgement of a Taylor step for all lanes at once: what `taylor.loop` and `taylor.step` do for one run."""

import math

from numba import types

from qddot.runner import abi
from qddot.runner.inputs.instants import rounding
from qddot.runner.lanes.lane import lane_of
from qddot.runner.lanes.pack import LANES
from qddot.runner.machine.elementary import exp, log
from qddot.runner.machine.lane_loop import lane_loop


@lane_loop(types.void(abi.POINTER, types.float64, types.float64))
def size_steps(rows, order, decay):
    """NEXT: the step that the sizes of the last two coefficients allow; 0 where one is not finite."""
    for lane in range(LANES):
        its = lane_of(rows, lane)
        one, other = log(its.error) / (order - 1.0), log(its.error_2) / order
        its.next = exp(decay - (one if one > other else other))


@lane_loop(types.void(abi.POINTER, types.float64, types.float64))
def plan_steps(rows, first_step, with_inputs):
    """H and TARGET of all lanes: the step that the series allows, or to the end of a piece or the stop before that."""
    for lane in range(LANES):
        its = lane_of(rows, lane)
        t, stop, longest = its.t, its.stop, its.longest
        h = its.next
        h = h if h < longest else longest
        h = first_step if (first_step > 0.0) & (its.steps == 0.0) & (first_step < h) else h
        least = rounding(t)
        end = its.high if its.high > t + least else t + least
        end = end if (with_inputs != 0.0) & (end < stop) else stop
        landing = h >= end - t
        its.least = least
        its.h = end - t if landing else h
        its.target = end if landing else t + h
        its.lands = 1.0 if landing & (end == stop) else 0.0


@lane_loop(types.void(abi.POINTER))
def set_behind(rows):
    """THETA: how far the lanes' times AT are behind the start of their steps, in s."""
    for lane in range(LANES):
        its = lane_of(rows, lane)
        its.theta = its.at - its.t


@lane_loop(types.int64(abi.POINTER, types.float64))
def judge_steps(rows, limit):
    """GOOD: 1 where a step counts, -1 where it is too small or leaves the bounds; how many lanes want a closer look.

    Those are the ones that come to a stop or a sample, and the ones that are stuck.
    """
    found = 0
    for lane in range(LANES):
        its = lane_of(rows, lane)
        active, size = its.active > 0.0, its.next
        good = active & (size >= its.least) & (size > 0.0) & (its.size <= limit)
        stuck = active & (not good)
        its.good = 1.0 if good else (-1.0 if stuck else 0.0)
        its.steps += 1.0 if good else 0.0
        found += stuck | (good & ((its.lands > 0.0) | (its.sample <= its.target)))
    return found
