"""Length and judgement of a Taylor step for all lanes at once: what `taylor.loop` and `taylor.step` do for one run."""

from numba import types

from qddot.runner import abi
from qddot.runner.inputs.instants import rounding
from qddot.runner.lanes.lane import lane_of
from qddot.runner.lanes.pack import LANES
from qddot.runner.machine.lane_loop import lane_loop


@lane_loop(types.void(abi.POINTER, types.float64, types.float64))
def plan_steps(rows, first_step, with_inputs):
    """H and TARGET of all lanes: the step that the series allows, or to the end of a piece or the stop before that."""
    for lane in range(LANES):
        its = lane_of(rows, lane)
        t, stop, longest, high, steps, h = its.t, its.stop, its.longest, its.high, its.steps, its.next
        h = h if h < longest else longest
        h = first_step if (first_step > 0.0) & (steps == 0.0) & (first_step < h) else h
        least = rounding(t)
        end, soonest = high if with_inputs != 0.0 else stop, t + least
        end = end if end > soonest else soonest
        end = end if end < stop else stop
        ahead, target = end - t, t + h
        landing = h >= ahead
        its.least = least
        its.h = h if h < ahead else ahead
        its.target = end if landing else target
        its.lands = landing & (end == stop)


@lane_loop(types.void(abi.POINTER))
def set_behind(rows):
    """THETA: how far the lanes' times AT are behind the start of their steps, in s."""
    for lane in range(LANES):
        its = lane_of(rows, lane)
        its.theta = its.at - its.t


@lane_loop(types.int64(abi.POINTER, types.float64))
def judge_steps(rows, limit):
    """GOOD: 1 where a step counts, -1 where it is too small or leaves the bounds; how many lanes want a closer look.

    Those come to a stop or a sample, or are stuck. ARRIVAL: the end of a step that counts, or the present.
    """
    found = 0
    for lane in range(LANES):
        its = lane_of(rows, lane)
        active, size, least, largest, t, target = its.active > 0.0, its.next, its.least, its.size, its.t, its.target
        good = active & (size >= least) & (size > 0.0) & (largest <= limit)
        stuck = active & (not good)
        lands, sample = its.lands > 0.0, its.sample
        its.good = 1.0 * good - 1.0 * stuck
        its.arrival = target if good else t
        its.steps += 1.0 * good
        found += stuck | (good & (lands | (sample <= target)))
    return found


@lane_loop(types.void(abi.POINTER))
def end_steps(rows):
    """The end of a step that counts is the present."""
    for lane in range(LANES):
        its = lane_of(rows, lane)
        arrival, good = its.arrival, its.good
        its.t = arrival
        its.good = good if good > 0.0 else 0.0
