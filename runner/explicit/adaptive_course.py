"""What a run of an adaptive explicit method has reached, and what it writes down: points and events."""

from qddot.runner.events.search import NONE, earliest
from qddot.runner.explicit.step import interpolate, prepare_dense
from qddot.runner.explicit.workspace import WITHIN, Y, write_states
from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.memory import LEAN, floats, integers, layout

#: Fields of the course of a run, besides the state itself. stops (n_stops,): breakpoints, then the end; stop: the next
#: one; wanted (n_wanted,): times to save at; next_wanted; saved_t, saved_x: `room` points, of which `saved` are used;
#: found_t, found_event, found_x: the same of events. refine: points saved per step, 0 where only wanted times are.
#: restart: the next step starts at a breakpoint. dense: the last step's dense output is prepared. max_steps: 0 for no
#: limit; first_step: 0 for the controller's; longest_first: the longest after a stop. now: time of the state; size: of
#: the next step; start, length: of the last; end: theta of the terminal event that cut it short.
COURSE = layout(
    "stops n_stops stop wanted n_wanted next_wanted saved_t saved_x room saved "
    "found_t found_event found_x event_room found "
    "refine max_steps steps failed_attempts evaluations failed_state restart dense",
    "now size last_error start length end max_step first_step longest_first",
)


@compiled(**LEAN)
def save(space, course, row, t):
    """Append a point."""
    place = course.saved
    floats(course.saved_t, course.room)[place] = t
    write_states(space, row, course.saved_x + 8 * space.n * place)
    course.saved = place + 1


@compiled(**LEAN)
def ensure_dense(space, pair, course, t, h):
    """The stages of dense output, once a step."""
    if course.dense == 0:
        course.evaluations += prepare_dense(space, pair, t, h)
        course.dense = 1


@compiled(**LEAN)
def record(space, pair, course, watch, i, t, h):
    """Append event i, which lies at theta[i] of the step."""
    place, theta = course.found, floats(watch.theta, watch.count)[i]
    row = Y
    if theta > 0.0:
        interpolate(space, pair, theta, h)
        row = WITHIN
    floats(course.found_t, course.event_room)[place] = t + theta * h
    integers(course.found_event, course.event_room)[place] = i
    write_states(space, row, course.found_x + 8 * space.n * place)
    course.found = place + 1


@compiled(**LEAN)
def record_all(space, pair, course, watch, t, h):
    """Record the marked events in order of time; returns theta of a terminal one, which is the last, or NONE."""
    theta, terminal = floats(watch.theta, watch.count), integers(watch.terminal, watch.count)
    i = earliest(watch)
    while i >= 0:
        record(space, pair, course, watch, i, t, h)
        if terminal[i]:
            return theta[i]
        theta[i] = NONE
        i = earliest(watch)
    return NONE


@compiled(**LEAN)
def save_within(space, pair, course):
    """Save the wanted times, or the refinement, strictly within the step."""
    t, h, end = course.start, course.length, course.now
    wanted = floats(course.wanted, course.n_wanted)
    for j in range(1, course.refine):
        at = t + j * h / course.refine
        if at < end:
            ensure_dense(space, pair, course, t, h)
            interpolate(space, pair, j / course.refine, h)
            save(space, course, WITHIN, at)
    while course.next_wanted < course.n_wanted and wanted[course.next_wanted] < end:
        ensure_dense(space, pair, course, t, h)
        interpolate(space, pair, (wanted[course.next_wanted] - t) / h, h)
        save(space, course, WITHIN, wanted[course.next_wanted])
        course.next_wanted += 1
