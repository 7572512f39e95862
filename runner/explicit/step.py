"""One step of any embedded Runge-Kutta pair, and its dense output, without tolerances and whatever becomes of them.

A, b, c and k_i as in Hairer, Norsett, Wanner, counted from 0; E: weights of the error estimates.
"""

from functools import cache

import numpy as np
from numpy.typing import NDArray

from qddot.runner.explicit.slopes import slope, slope_by_arrays
from qddot.runner.explicit.workspace import (
    ERROR,
    ERROR_2,
    K0,
    MOST_STAGES,
    NEW,
    STAGE,
    WITHIN,
    ZERO,
    Y,
    combine,
    combine_with_latest,
    sum_rows,
)
from qddot.runner.frame.space import look_up, row_address
from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.memory import INLINE, LEAN, address, floats, layout, record
from qddot.runner.machine.stage import call_stage
from qddot.runner.tableaux.butcher import ButcherTableau
from qddot.runner.tableaux.embedded import EmbeddedPair

#: Bytes of a row of coefficients.
ROW = 8 * MOST_STAGES


#: Fields of an embedded pair: addresses of its coefficients in rows of MOST_STAGES, and its numbers. A: a row for each
#: stage, those of dense output included; b; c; depth: how far back from a stage the first slope lies that it needs; E:
#: a row for each estimate; P: a row for each power of theta. stages of a step, all_stages, next_slope: the stage that
#: is the next step's first.
PAIR = layout("A b c depth E P stages all_stages next_slope estimates degree")


@compiled(**LEAN)
def evaluate_stages(space, pair, t, h, first, last):
    """Slopes of the stages first to last - 1, from the row Y and the slopes before."""
    if space.by_item:
        evaluate_by_item(space, pair, t, h, first, last)
        return
    c = floats(pair.c, MOST_STAGES)
    for i in range(first, last):
        combine(space, h, Y, pair.A + ROW * i, i, STAGE)
        if i == first or c[i] != c[i - 1]:
            look_up(space, t, h, c[i])
        slope_by_arrays(space, t + c[i] * h, STAGE, K0 + i)


@compiled(**INLINE)
def evaluate_by_item(space, pair, t, h, first, last):
    """`evaluate_stages` where the kernel adds the latest slope's part itself."""
    rhs, u, constants = space.rhs, space.u, space.constants
    y, stage, target = row_address(space, Y), row_address(space, STAGE), row_address(space, K0 + first)
    weights, c, depth = pair.A + ROW * first, pair.c + 8 * first, pair.depth + 8 * first
    for i in range(first, last):
        at = floats(c, 1)[0]
        if i == first or at != floats(c - 8, 1)[0]:
            look_up(space, t, h, at)
        base = y
        if floats(depth, 1)[0] > 1.0:
            sum_rows(space, y, h, weights, i - 1, stage)
            base = stage
        latest = h * floats(weights, MOST_STAGES)[i - 1]
        call_stage(rhs, t + at * h, base, target - space.stride, latest, u, constants, target)
        weights, target, c, depth = weights + ROW, target + space.stride, c + 8, depth + 8


@compiled(**LEAN)
def take_step(space, pair, t, h):
    """From Y and slope 0 at t: NEW, the slopes and the error estimates of the step to t + h."""
    if pair.next_slope < pair.stages:
        evaluate_stages(space, pair, t, h, np.int64(1), pair.next_slope)
        combine_with_latest(space, h, Y, pair.A + ROW * pair.next_slope, pair.next_slope, NEW)
        if floats(pair.c, MOST_STAGES)[pair.next_slope - 1] != 1.0:
            look_up(space, t, h, 1.0)
        slope(space, t + h, NEW, K0 + pair.next_slope)
    else:
        evaluate_stages(space, pair, t, h, np.int64(1), pair.stages)
        combine_with_latest(space, h, Y, pair.b, pair.stages, NEW)
    combine(space, h, ZERO, pair.E, pair.stages, ERROR)
    if pair.estimates > 1:
        combine(space, h, ZERO, pair.E + ROW, pair.stages, ERROR_2)


@compiled(**LEAN)
def evaluate_next_slope(space, pair, t, h):
    """The slope at the end of an accepted step, where the step did not need it; returns the number of evaluations."""
    return 0 if pair.next_slope < pair.stages else evaluate_end_slope(space, pair, t, h)


@compiled(**LEAN)
def evaluate_end_slope(space, pair, t, h):
    """The slope at the end of an accepted step; returns the number of evaluations, one."""
    look_up(space, t, h, 1.0)
    slope(space, t + h, NEW, K0 + pair.next_slope)
    return 1


@compiled(**LEAN)
def prepare_dense(space, pair, t, h):
    """The stages that only dense output needs; returns the number of evaluations."""
    evaluate_stages(space, pair, t, h, pair.next_slope + 1, pair.all_stages)
    return pair.all_stages - pair.next_slope - 1


@compiled(**LEAN)
def interpolate(space, pair, theta, h):
    """The row WITHIN = y(t + theta*h), from Y and all slopes."""
    P = floats(pair.P, pair.degree * MOST_STAGES)
    weights = floats(space.weights, MOST_STAGES)
    for i in range(MOST_STAGES):
        weights[i] = 0.0
    for j in range(pair.degree - 1, -1, -1):
        for i in range(MOST_STAGES):
            weights[i] = (weights[i] + P[j * MOST_STAGES + i]) * theta
    combine(space, h, Y, space.weights, pair.all_stages, WITHIN)


@cache
def pair_for(pair: EmbeddedPair) -> tuple[np.void, NDArray[np.float64]]:
    """The coefficients as the compiled step reads them, and the array that holds them; made once for a pair."""
    A, P, E = pair.dense.A, pair.dense.P.T, pair.error_weights
    rows = {
        "A": A,
        "b": pair.tableau.b[None],
        "c": pair.dense.c[None],
        "depth": _depth(A),
        "E": E,
        "P": P,
    }
    table, places = _table(rows)
    return record(
        PAIR,
        **places,
        stages=pair.tableau.stages,
        all_stages=pair.dense.stages,
        next_slope=pair.next_slope,
        estimates=len(E),
        degree=len(P),
    ), table


@cache
def tableau_for(tableau: ButcherTableau) -> tuple[np.void, NDArray[np.float64]]:
    """The same of a tableau without error estimate and dense output."""
    rows = {"A": tableau.A, "b": tableau.b[None], "c": tableau.c[None], "depth": _depth(tableau.A)}
    table, places = _table(rows)
    return record(PAIR, **places, stages=tableau.stages, all_stages=tableau.stages), table


def _depth(A: NDArray[np.float64]) -> NDArray[np.float64]:
    """How far back from each stage the first slope lies that it needs, 0 where it needs none: (1, stages)."""
    return np.array([[i - np.flatnonzero(row)[0] if row.any() else 0 for i, row in enumerate(A)]], dtype=np.float64)


def _table(blocks: dict[str, NDArray[np.float64]]) -> tuple[NDArray[np.float64], dict[str, int]]:
    """Blocks of rows under each other, rows of MOST_STAGES, and the address of each block."""
    table = np.zeros((sum(map(len, blocks.values())), MOST_STAGES))
    places, row = {}, 0
    for name, values in blocks.items():
        table[row : row + len(values), : values.shape[1]] = values
        places[name] = address(table) + ROW * row
        row += len(values)
    return table, places
