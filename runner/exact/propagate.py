"""The compiled course of an exact run: from stop to stop, by the means that costs least there.

The stops are the ends of segments, where an input changes its piece, and the wanted times. A short way goes by Taylor
series; a long one by one exponential; many equal ones within a segment by one exponential that is applied to each.
"""

import math

from runner.compiled import compiled
from runner.exact.exponential import ROW, driving_block, exponential, squarings_for
from runner.exact.forcing import augment, force, look_up
from runner.exact.taylor import LONGEST, degree_for, largest_rate, taylor_step
from runner.memory import BLOCK, LEAN, floats, matrix, weighted_sum
from runner.problem import Status

RUNNING, FINISHED, NON_FINITE = int(Status.RUNNING), int(Status.FINISHED), int(Status.NON_FINITE)
#: Of a segment: whether Y is that of the grid's step.
UNDECIDED, NONE, READY = range(3)
#: A product of a vector waits for its sums, one of matrices does not: cost of the first relative to the second.
WAITING = 2.0
#: Products in a step, about.
STEP_COST = 10.0


@compiled(**LEAN)
def parts_for(s, h):
    """Into how many series a way of length h is cut."""
    return max(1, math.ceil(h * largest_rate(s) / LONGEST))


@compiled(**LEAN)
def series_cost(s, h):
    """Cost of a way of length h by Taylor series."""
    parts = parts_for(s, h)
    return WAITING * parts * degree_for(h * largest_rate(s) / parts) * s.n * s.panels


@compiled(**LEAN)
def exponential_cost(s, h):
    """Cost of an exponential for a step of length h."""
    q = s.degree + 1 + 2 * s.frequencies
    products = 7 + squarings_for(h * largest_rate(s))
    return products * (s.panels * ((s.n + q) * s.n + q * q) + q * q * -(-q // BLOCK))


@compiled(**LEAN)
def prepare(s, h):
    """Write Y of a step h from s.t."""
    augment(s, h)
    Y = exponential(s.n, s.q, s.M, s.M_2, s.M_3, s.M_4, s.Y, s.room)
    if Y != s.Y:
        s.Y, s.room = Y, s.Y
    s.exponentials += 1


@compiled(**LEAN)
def apply(s):
    """Move x and the drivers p by the step that Y is of."""
    n, q, rows = s.n, s.q, s.n + s.q
    for b in range(s.panels):
        base = s.Y + ROW * rows * b
        weighted_sum(s.x + ROW * b, 1.0, s.x, n, base, s.y + ROW * b)
        weighted_sum(s.y + ROW * b, 1.0, s.p, q, base + ROW * n, s.y + ROW * b)
    J = driving_block(s.Y, n, q)
    for b in range(-(-q // BLOCK)):
        weighted_sum(s.p + ROW * b, 1.0, s.p, q, J + ROW * q * b, s.p_next + ROW * b)
    s.x, s.y = s.y, s.x
    s.p, s.p_next = s.p_next, s.p
    s.products += 1


@compiled(**LEAN)
def grid_pays(s, wanted):
    """Whether x is at one of the evenly spaced times, and those left in the segment are worth an exponential."""
    before = floats(s.outputs, s.n_outputs)[s.next_output - 1]
    if not s.first_even < s.next_output <= s.last_even or abs(s.t - before) > s.near or wanted > s.segment_end:
        return False
    left = min(s.last_even - s.next_output + 1, int((s.segment_end - s.t) / s.spacing + 1e-6))
    once = exponential_cost(s, s.spacing)
    return left > 1 and once + WAITING * s.n * s.panels * left < left * min(series_cost(s, s.spacing), once)


@compiled(**LEAN)
def exponential_for(s, wanted, h):
    """The step of which an exponential pays now: that of the grid, the way h to the next stop, or 0 for none."""
    if s.grid == UNDECIDED and s.next_output > s.first_even:
        s.grid = NONE
        if grid_pays(s, wanted):
            s.grid = READY
            return s.spacing
    return h if exponential_cost(s, h) < series_cost(s, h) else 0.0


@compiled(**LEAN)
def save(s):
    """Write the state at the wanted time."""
    saved, x, scale = matrix(s.saved, s.n_outputs, s.n), floats(s.x, s.n), floats(s.scale, s.n)
    for i in range(s.n):
        saved[s.next_output, i] = scale[i] * x[i]
    s.next_output += 1


@compiled(**LEAN)
def leaving(s):
    """The index of the state that is not finite or exceeds the limit by most, -1 where there is none."""
    x, scale = floats(s.x, s.n), floats(s.scale, s.n)
    worst = -1
    for i in range(s.n):
        if not abs(scale[i] * x[i]) <= s.limit and (worst < 0 or abs(scale[i] * x[i]) > abs(scale[worst] * x[worst])):
            worst = i
    return worst


@compiled(**LEAN)
def advance_some(s, most):
    """Go on until the last wanted time, or until about `most` row operations are done; returns a Status.

    x is at s.t; segment_end <= t where a segment is to begin. A wanted time next to the end of a segment is that end.
    """
    done = 0.0
    while done < most:
        if s.t >= s.segment_end:
            look_up(s)
            s.grid = UNDECIDED
        wanted = floats(s.outputs, s.n_outputs)[s.next_output]
        stop = min(wanted, s.segment_end)
        ready = s.grid == READY and wanted <= s.segment_end and s.next_output <= s.last_even
        if not ready:
            force(s)
            h = exponential_for(s, wanted, stop - s.t)
            ready = h > 0.0
            if ready:
                prepare(s, h)
                done += exponential_cost(s, h)
        if ready:
            apply(s)
        else:
            parts = parts_for(s, stop - s.t)
            stop = stop if parts == 1 else s.t + (stop - s.t) / parts
            taylor_step(s, stop - s.t)
        done += STEP_COST * s.n * s.panels
        s.t = stop
        s.steps += 1
        s.failed_state = leaving(s)
        if s.failed_state >= 0:
            return NON_FINITE
        if stop >= wanted - s.near:
            save(s)
            if s.next_output == s.n_outputs:
                return FINISHED
    return RUNNING
