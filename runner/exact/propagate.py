"""The compiled course of an exact run: from stop to stop, by the means that costs least there.

The stops are the ends of segments, where an input changes its piece, and the wanted times. A short way goes by Taylor
series; a long one by one exponential; many equal ones within a segment by one exponential that is applied to each.
"""

import math

from qddot.runner.exact.forcing import force, look_up, set_driver_rows, set_drivers, set_steps
from qddot.runner.exact.ladder import LEVELS, TURNS, apply, go_up, level_for, reach
from qddot.runner.exact.taylor import LONGEST, THETA, degree_for, largest_rate, taylor_step
from qddot.runner.inputs.instants import rounding
from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.memory import LEAN, floats, matrix
from qddot.runner.problem import Status

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
def start(s):
    """Begin a run at s.t, A and the wanted times being set."""
    s.degree, s.frequencies = 0, 0
    set_steps(s, s.spacing if s.spacing > 0.0 else s.t1 - s.t)


@compiled(**LEAN)
def rows_cost(s, level):
    """Cost of the rows of the ladder up to a level that are not there yet."""
    turns, q = TURNS + level, s.degree + 1 + 2 * s.frequencies
    known = s.driver_turns if s.driving else 0
    return s.panels * (s.n * s.n * max(0, turns - s.turns) + q * (s.n + 2 * q) * max(0, turns - known))


@compiled(**LEAN)
def ladder_cost(s, h):
    """Cost of a way of length h over the ladder, and the rest by series."""
    level = level_for(h / s.delta)
    rest = THETA.size // 2 * s.n if s.spacing == 0.0 or h != s.spacing else 0
    return rows_cost(s, level) + WAITING * s.panels * (s.n * (0.5 * level + 1.0) + rest)


@compiled(**LEAN)
def ready_drivers(s):
    """Have the drivers of this segment, at s.t."""
    if not s.driving:
        set_driver_rows(s)
        s.driving = 1
        if s.grid_level >= LEVELS:  # A sine so fast that the rungs had to become shorter.
            s.grid = NONE
    set_drivers(s)


@compiled(**LEAN)
def on_grid(s, wanted):
    """Whether the way to the wanted time, in this segment, is one of the even ones."""
    before = floats(s.outputs, s.n_outputs)[s.next_output - 1]
    even = s.first_even < s.next_output <= s.last_even and s.grid_level < LEVELS
    return even and abs(s.t - before) <= rounding(s.t) and wanted <= s.segment_end


@compiled(**LEAN)
def grid_pays(s):
    """Whether a rung of the length of the even ways left in this segment is worth having."""
    left = min(s.last_even - s.next_output + 1, int((s.segment_end - s.t) / s.spacing + 1e-6))
    by_rung = rows_cost(s, s.grid_level) + WAITING * s.n * s.panels * left
    return by_rung < left * series_cost(s, s.spacing)


@compiled(**LEAN)
def by_ladder(s, wanted, h):
    """Whether the ladder is the way to go h; decides on the grid where x is at the first of its times in a segment."""
    if s.grid == UNDECIDED and on_grid(s, wanted):
        s.grid = READY if grid_pays(s) else NONE
        if s.grid == READY:
            return True
    return h >= s.delta and ladder_cost(s, h) < series_cost(s, h)


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
def move_on(s, wanted, stop):
    """Go towards the next stop; returns the time that was reached."""
    if s.grid == READY and wanted <= s.segment_end and s.next_output <= s.last_even:
        apply(s, s.grid_level)
        return stop
    h = stop - s.t
    force(s)
    if by_ladder(s, wanted, h):
        ready_drivers(s)
        if s.grid == READY and wanted <= s.segment_end and s.next_output <= s.last_even:
            reach(s, s.grid_level)
            apply(s, s.grid_level)
            return stop
        whole = math.floor(min(h / s.delta, 2.0**52))
        go_up(s, whole)
        return min(s.t + whole * s.delta, stop)
    parts = parts_for(s, h)
    stop = stop if parts == 1 else s.t + h / parts
    taylor_step(s, stop - s.t)
    return stop


@compiled(**LEAN)
def propagate(s, most):
    """Go on until the last wanted time, or until about `most` row operations are done; returns a Status.

    x is at s.t; segment_end <= t where a segment is to begin. A wanted time next to the end of a segment is that end.
    """
    done = 0.0
    while done < most:
        if s.t >= s.segment_end:
            look_up(s)
            s.grid, s.driving = UNDECIDED, 0
        wanted = floats(s.outputs, s.n_outputs)[s.next_output]
        s.t = move_on(s, wanted, min(wanted, s.segment_end))
        done += STEP_COST * s.n * s.panels
        s.steps += 1
        s.failed_state = leaving(s)
        if s.failed_state >= 0:
            return NON_FINITE
        if s.t >= wanted - rounding(wanted):
            save(s)
            if s.next_output == s.n_outputs:
                return FINISHED
    return RUNNING
