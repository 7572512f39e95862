"""Samples of runs in lanes: the inputs of all lanes that have one are read at once, and so is dense output."""

from typing import Any

import numpy as np
from numba import typeof, types

from qddot.runner import abi
from qddot.runner.explicit.step import PAIR
from qddot.runner.explicit.workspace import MOST_STAGES
from qddot.runner.inputs.instants import rounding
from qddot.runner.lanes.inputs import look_up, outside
from qddot.runner.lanes.lane import control_of, lane_of
from qddot.runner.lanes.pack import BATCH_TYPE, LANES, PACK_TYPE
from qddot.runner.lanes.runs import gather, sample_time
from qddot.runner.machine.calls import doubles
from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.lane_loop import lane_loop
from qddot.runner.machine.memory import BY_ADDRESS, LEAN, floats, integers, intrinsic, record
from qddot.runner.machine.pointers import call_kernel, caller

PAIR_TYPE = typeof(record(PAIR))


@compiled(**LEAN)
def due(batch, pack, lane, t, near):
    """Whether a lane has a sample at t, or within this part of t of it; those that are long past are left out."""
    near, run, sample = near * abs(t), integers(pack.run, LANES)[lane], integers(pack.sample, LANES)
    while run >= 0 and sample[lane] < batch.n_samples:
        at = sample_time(batch, run, sample[lane])
        if at >= t - near:
            return at <= t + near
        sample[lane] += 1
    return False


@compiled(**LEAN)
def look_at(pack, lane, t):
    """Let the inputs of a lane be read at t, as they are right after it."""
    its = control_of(pack, lane)
    its.at = t
    its.side = t + rounding(t)


@compiled(**LEAN)
def write_sample(batch, pack, lane, t, where):
    """Write the next sample of a lane, at time t, from its states in the rows at an address, its inputs being read."""
    run, n, sample = integers(pack.run, LANES)[lane], batch.n, integers(pack.sample, LANES)
    x, y = floats(pack.x_lane, n), floats(pack.y_lane, batch.n_outputs)
    gather(lane, where, x)
    if batch.needs_outputs:
        u, c = floats(pack.u_lane, batch.channels), floats(batch.constants + 8 * run * batch.n_constants, 1)
        gather(lane, pack.u, u)
        call_kernel(batch.outputs, t, x, u, c, y)
    columns = integers(batch.columns, batch.n_columns)
    place = run * batch.n_samples + sample[lane]
    values = floats(batch.samples + 8 * batch.n_columns * place, batch.n_columns)
    for i in range(batch.n_columns):
        values[i] = x[columns[i]] if columns[i] < n else y[columns[i] - n]
    sample[lane] += 1


@compiled(**LEAN)
def write_samples(batch, pack, near):
    """Write the samples of all lanes that are at the present, or within this part of it."""
    found = 0
    for lane in range(LANES):
        t = control_of(pack, lane).t
        if due(batch, pack, lane, t, near):
            look_at(pack, lane, t)
            found += 1
    if found > 0:
        if batch.needs_outputs:
            look_up(batch.look_up, batch, pack, 1, outside(doubles(pack.control)))
        for lane in range(LANES):
            t = control_of(pack, lane).t
            while due(batch, pack, lane, t, near):
                write_sample(batch, pack, lane, t, pack.now)


@lane_loop(types.void(abi.POINTER, abi.POINTER, abi.POINTER, types.int64, types.int64))
def weigh(rows, P, weights, stages, degree):
    """Weights of the slopes in dense output, rows of lanes: polynomials in THETA, (AT - T) / H, times H."""
    for lane in range(LANES):
        its = lane_of(rows, lane)
        behind = its.at - its.t
        its.theta = behind / its.h
    for i in range(stages):
        for lane in range(LANES):
            weights[i * LANES + lane] = 0.0
        for j in range(degree - 1, -1, -1):
            for lane in range(LANES):
                weight = weights[i * LANES + lane] + P[j * MOST_STAGES + i]
                weights[i * LANES + lane] = weight * lane_of(rows, lane).theta


@lane_loop(types.void(abi.POINTER, abi.POINTER, abi.POINTER, abi.POINTER, abi.POINTER, types.int64, types.int64))
def interpolate(rows, weights, now, slopes, x, n, stages):
    """States within the step: x = now + H * (weights times the slopes), rows of lanes."""
    for m in range(n):
        for lane in range(LANES):
            x[m * LANES + lane] = 0.0
    for i in range(stages):
        for m in range(n):
            for lane in range(LANES):
                x[m * LANES + lane] += weights[i * LANES + lane] * slopes[(i * n + m) * LANES + lane]
    for m in range(n):
        for lane in range(LANES):
            x[m * LANES + lane] = now[m * LANES + lane] + lane_of(rows, lane).h * x[m * LANES + lane]


@compiled(**LEAN)
def aim(batch, pack):
    """Set the times of the lanes that have a sample in the step they just made; returns how many there are."""
    found = 0
    for lane in range(LANES):
        its = control_of(pack, lane)
        at = its.sample
        if its.good > 0.0 and at <= its.target:
            look_at(pack, lane, at)
            found += 1
    return found


@compiled(**BY_ADDRESS)
def write_samples_within(batch, pack, pair):
    """Write the samples of all lanes within the steps they just made by dense output, and those at their ends."""
    for lane in range(LANES):
        its = control_of(pack, lane)
        if its.good > 0.0 and its.sample < its.target:
            integers(pack.evaluations, LANES)[lane] += pair.all_stages - pair.next_slope - 1
    while aim(batch, pack) > 0:
        rows, weights, x = doubles(pack.control), doubles(pack.weights), doubles(pack.stage)
        weigh(rows, doubles(pair.P), weights, pair.all_stages, pair.degree)
        interpolate(rows, weights, doubles(pack.now), doubles(pack.slopes), x, batch.n, pair.all_stages)
        write_aimed(batch, pack)


@compiled(**LEAN)
def write_aimed(batch, pack):
    """Write the samples that `aim` found: their states stand in the rows `stage`, those at the step's end in `new`."""
    if batch.needs_outputs:
        look_up(batch.look_up, batch, pack, 1, outside(doubles(pack.control)))
    for lane in range(LANES):
        its = control_of(pack, lane)
        at, end = its.sample, its.target
        if its.good > 0.0 and at <= end:
            write_sample(batch, pack, lane, at, pack.stage if at < end else pack.new)
            run, j = integers(pack.run, LANES)[lane], integers(pack.sample, LANES)[lane]
            its.sample = sample_time(batch, run, j) if j < batch.n_samples else np.inf


SAMPLE_WITHIN = types.void(BATCH_TYPE, PACK_TYPE, PAIR_TYPE)


@intrinsic
def sample_within(typing_context: Any, where: Any, batch: Any, pack: Any, pair: Any) -> Any:
    """Call `write_samples_within` at an address, see `inputs.look_up`."""
    return caller(SAMPLE_WITHIN)
