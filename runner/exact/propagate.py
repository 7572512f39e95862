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


@compiled(**LEAN)
def series_cost(s, h):
    """Cost of a way of length h by Taylor series."""
    theta = h * largest_rate(s)
    steps = math.ceil(theta / LONGEST)
    return WAITING * steps * degree_for(theta / max(1, steps)) * s.n * s.panels


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
def go(s, target):
    """Move x from s.t to a time in the same segment; returns the cost."""
    h = target - s.t
    force(s)
    by_series, by_exponential = series_cost(s, h), exponential_cost(s, h)
    if by_exponential < by_series:
        prepare(s, h)
        apply(s)
        return by_exponential
    parts = max(1, math.ceil(h * largest_rate(s) / LONGEST))
    start = s.t
    for k in range(parts):
        if k > 0:
            s.t = start + k * h / parts
            force(s)
        taylor_step(s, h / parts)
    return by_series


@compiled(**LEAN)
def grid_pays(s):
    """Whether the evenly spaced times left in the segment are worth an exponential."""
    left = min(s.last_even - s.next_output + 1, int((s.segment_end - s.t) / s.spacing + 1e-6))
    if left < 2:
        return False
    force(s)
    by_exponential = exponential_cost(s, s.spacing)
    each = min(series_cost(s, s.spacing), by_exponential)
    return by_exponential + WAITING * s.n * s.panels * left < left * each


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
def grid_begins(s, wanted):
    """Whether x is at one of the evenly spaced times and an exponential from here on pays."""
    before = floats(s.outputs, s.n_outputs)[s.next_output - 1]
    even = s.first_even < s.next_output <= s.last_even and abs(s.t - before) <= s.near
    return even and wanted <= s.segment_end and grid_pays(s)


def advance(s, most):
    """Go on until the last wanted time, or until about `most` row operations are done; returns a Status.

    x is at s.t; segment_end <= t where a segment is to begin. A wanted time next to the end of a segment is that end.
    """
    done = 0.0
    while done < most:
        if s.t >= s.segment_end:
            look_up(s)
            s.grid = UNDECIDED
        wanted = floats(s.outputs, s.n_outputs)[s.next_output]
        at_output = wanted <= s.segment_end + s.near
        target = min(wanted, s.segment_end)
        if s.grid == UNDECIDED and s.next_output > s.first_even:
            s.grid = NONE
            if grid_begins(s, wanted):
                s.grid = READY
                done += exponential_cost(s, s.spacing)
                prepare(s, s.spacing)
        if s.grid == READY and wanted <= s.segment_end and s.next_output <= s.last_even:
            apply(s)
            done += WAITING * s.n * s.panels
        else:
            done += go(s, target)
        s.t = target
        s.steps += 1
        s.failed_state = leaving(s)
        if s.failed_state >= 0:
            return NON_FINITE
        if at_output:
            save(s)
            if s.next_output == s.n_outputs:
                return FINISHED
    return RUNNING
