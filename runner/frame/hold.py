"""Conditions of a model in its state, each held on its side during a step, so that a step sees a smooth function.

A kernel reads a mode beside each condition's switching function s, see `abi`: +inf where s > 0 is held, -inf where
s < 0 is, 0 where the condition is free. Where s leaves its side is found on the dense output of the branch that is
held; the step ends there, the condition changes its side, and the method starts anew.

A condition is free where s is zero and nobody knows which way it goes: at a start, and where rounding makes it change
sides again and again at one time. In a step whose branch has no finite continuation beyond the other side, such as
sqrt(-x), all are. It is held again from the end of that step on.
"""

from typing import TYPE_CHECKING, Any

import numpy as np
from numba import from_dtype, types
from numpy.typing import NDArray

from qddot.runner.frame.events import ActingCrossing, watch_for
from qddot.runner.frame.log import LOG
from qddot.runner.frame.search import NONE, WATCH, event_values
from qddot.runner.frame.slide import combine, slider, sliding_functions, sliding_rhs
from qddot.runner.frame.space import SPACE, common, constants, input_values, look_up, modes, sketch_within, write_modes
from qddot.runner.frame.step_end import call_walk
from qddot.runner.load import Model
from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.memory import BY_ADDRESS, LEAN, address, floats, integers
from qddot.runner.machine.pointers import calling
from qddot.runner.options import LOCATE, Options
from qddot.runner.problem import Problem

if TYPE_CHECKING:
    from qddot.runner.method import Method

#: What becomes of a step: it stays, it ends earlier, it is none and the next begins on another side, and that for ever.
KEPT, SHORTER, NOTHING, CHATTER = range(4)
#: Parts of a step at which a switching function is looked at before its dense output is.
_LOOKS = (0.25, 0.5, 0.75)
#: A turn of a switching function that would bring it nearer to zero than this part of its size is looked at closely.
_NEAR = 0.5
#: A step of fewer spacings of floating-point time is none; conditions within this part of a step turn at one time.
_LEAST_STEP, _AT_ONCE = 8.0, 1e-12
#: Changes of sides, for each condition, without more than this part of a step between them, after which all conditions
#: are free for a step.
_MOST_CHANGES, _NO_PROGRESS = 3, 1e-3
#: So many changes of sides within this part of the time passed are chatter.
_CHATTER, _NO_TIME = 256, 1e-8

_SIDES = from_dtype(WATCH)
TAKE_SIDES = types.void(SPACE, _SIDES, types.float64, types.int64)
RELEASE = types.void(SPACE, _SIDES)
KEEP_SIDES = types.Tuple((types.int64, types.float64))(
    SPACE, from_dtype(LOG), _SIDES, types.float64, types.float64, types.int64
)
_call_take, _call_release, _call_keep = map(calling, (TAKE_SIDES, RELEASE, KEEP_SIDES))


def holding(
    problem: Problem, space: np.void, u: NDArray[np.float64], degree: int
) -> tuple[np.void, dict[str, NDArray[Any]]]:
    """What a loop knows of a problem's conditions, and the arrays it points into; degree: of the dense output.

    space, u: where the method works, and its inputs.
    """
    count = problem.n_modes
    if count == 0:
        return watch_for((), 0, degree)
    watched = [ActingCrossing(name="", events=problem.switching, count=count, index=k) for k in range(count)]
    record, arrays = watch_for(watched, len(problem.initial_state), (degree + 1) // 2)
    its, sliding = slider(problem, int(space["channels"]))
    integers_before(u)[0] = address(its)
    arrays |= {"turning": np.zeros(count, dtype=np.int64), "looks": np.zeros((len(_LOOKS) + 2, count))}
    for name in ("turning", "looks"):
        record[name] = address(arrays[name])
    for name in ("flags", "part", "pull", "slopes", "bound", "rest"):
        record[name] = address(sliding[name])
    for name in ("rhs", "by_item", "jacobian_kernel"):
        record[name] = space[name]
    record["functions"], record["slide"], record["watch_slide"] = record["acting"], sliding_rhs(), sliding_functions()
    return record, arrays | {f"sliding {name}": array for name, array in sliding.items()} | {"slider": its}


def integers_before(u: NDArray[np.float64]) -> NDArray[np.int64]:
    """What stands before the inputs in memory, see `make_space`."""
    whole: Any = u.base
    found: NDArray[np.int64] = whole[:1].view(np.int64)
    return found


def kept(arrays: dict[str, NDArray[Any]]) -> tuple[NDArray[Any], ...]:
    """Which of the arrays of `holding` a run leaves other than it finds them."""
    return tuple(arrays[name] for name in ("sliding flags", "turning") if name in arrays)


def switching_of(model: Model, method: "Method", options: Options) -> dict[str, Any]:
    """What a problem says of the conditions of a model in its state: nothing where a method is not to locate them."""
    count = len(model.tables.modes)
    if not count or not locates(method, options):
        return {}
    found = {"switching": model.kernel("modes"), "n_modes": count, "approach": model.matrix("approach")}
    rest = model.tables.patterns["approach"].columns == len(model.state_names)
    return found | ({"n_inputs": len(model.tables.courses)} if rest.any() else {})


def locates(method: "Method", options: Options) -> bool:
    """Whether a method holds conditions on their sides: adaptive ones do unless told, others only where told."""
    by_default = method.family in ("adaptive", "stiff")
    return by_default if options.switching is None else options.switching == LOCATE


@compiled(**LEAN)
def hold(space, sides, k, value):
    """Hold condition k on the side on which its switching function has this value; free at zero."""
    mode, way = 0.0, 0
    if value > 0.0:
        mode, way = np.inf, -1
    elif value < 0.0:
        mode, way = -np.inf, 1
    modes(space)[k] = mode
    integers(sides.direction, sides.count)[k] = way


@compiled(**LEAN)
def put_side(space, sides, k, t, where, value, otherwise):
    """Put condition k, at its zero, on the side that it goes to, or let it slide; on `otherwise` where nothing tells.

    value: what its switching function still has; the state at the address is put where it has none, along the jump of
    the right-hand side, which is where an impulse of the force that jumps would bring it.
    """
    flags, part = integers(sides.flags, sides.count), floats(sides.part, sides.count)
    flags[k] = 1
    write_modes(space)
    slope_when_sliding(space, sides, t, where)
    pull, p = floats(sides.pull, sides.count)[k], part[k]
    if pull < 0.0 and abs(2.0 * p - 1.0) <= floats(sides.bound, sides.count)[k]:
        x, jump = floats(where, space.n), floats(sides.slopes + 8 * space.n * k, space.n)
        for i in range(space.n):
            x[i] -= value / pull * jump[i]
        modes(space)[k] = 0.0
        integers(sides.direction, sides.count)[k] = -1
        return
    flags[k] = 0
    if pull < 0.0:
        hold(space, sides, k, p - 0.5)
    else:
        down = -p * pull  # ds/dt on the side below
        same = down * (down + pull) > 0.0
        hold(space, sides, k, down if same else otherwise)
    write_modes(space)


@compiled(**LEAN)
def slope_when_sliding(space, sides, t, where):
    """Find the parts of the conditions that slide, at time t, the state at an address."""
    x, u, c = floats(where, space.n), input_values(space), constants(space)
    combine(t, x, u, c, floats(sides.rest, space.n))


@compiled(**LEAN)
def engage(space, sides):
    """Let the method take the combination of branches where conditions slide, else the kernels as they are."""
    flags, sides.sliding = integers(sides.flags, sides.count), 0
    for k in range(sides.count):
        sides.sliding += flags[k]
    if sides.sliding > 0:
        space.rhs, space.by_item, space.jacobian_kernel, sides.acting = sides.slide, 0, 0, sides.watch_slide
    else:
        space.rhs, space.by_item = sides.rhs, sides.by_item
        space.jacobian_kernel, sides.acting = sides.jacobian_kernel, sides.functions


@compiled(**LEAN)
def hold_all(space, sides, values):
    """Hold all conditions that do not slide where their switching functions, (count,) at an address, say they are."""
    found, flags = floats(values, sides.count), integers(sides.flags, sides.count)
    for k in range(sides.count):
        if flags[k] == 0:
            hold(space, sides, k, found[k])
    sides.free = 0
    write_modes(space)


@compiled(**LEAN)
def release(space, sides):
    """Let all conditions be free for a step."""
    _call_release(space.release, (common(space), sides))


@compiled(**BY_ADDRESS)
def let_go(space, sides):
    """`release`."""
    flags = integers(sides.flags, sides.count)
    for k in range(sides.count):
        modes(space)[k] = 0.0
        flags[k] = 0
    sides.free = 1
    engage(space, sides)
    write_modes(space)


@compiled(**LEAN)
def may_release(sides, t):
    """Whether to let all conditions be free at t, where a branch has no values: not where that was done just before.

    There it is no branch that has none, but the model itself, as beyond the points of a table that refuses it.
    """
    again = t - sides.released < _NO_TIME * (t - sides.start)
    sides.released = t
    return not again


@compiled(**LEAN)
def take_sides(space, sides, t, where):
    """Put the conditions on their sides where a step starts, the inputs being set: those that turned, or all anew."""
    _call_take(space.take_sides, (common(space), sides, t, where))


@compiled(**BY_ADDRESS)
def take(space, sides, t, where):
    """`take_sides`."""
    turning, flags = integers(sides.turning, sides.count), integers(sides.flags, sides.count)
    before, part = floats(sides.before, sides.count), floats(sides.part, sides.count)
    event_values(space, sides, t, where, sides.before)
    if sides.started == 0:
        sides.start, sides.started, sides.released = t, 1, -np.inf
    if sides.turned == 0:
        hold_all(space, sides, sides.before)
        for k in range(sides.count):
            if flags[k] != 0 or before[k] == 0.0:
                put_side(space, sides, k, t, where, 0.0, 0.0)
        sides.changes = 0
    elif sides.changes > _MOST_CHANGES * sides.count:
        release(space, sides)
        sides.changes = 0
    else:
        for k in range(sides.count):
            if turning[k] != 0 and flags[k] != 0:
                flags[k] = 0
                hold(space, sides, k, part[k] - 0.5)
            elif turning[k] != 0:
                put_side(space, sides, k, t, where, before[k], -modes(space)[k])
    for k in range(sides.count):
        turning[k] = 0
    sides.turned = 0
    engage(space, sides)
    write_modes(space)
    if sides.sliding > 0:
        event_values(space, sides, t, where, sides.before)


@compiled(**LEAN)
def strays(space, sides, k, value):
    """Whether a value lies beyond the side on which condition k is held, or where its sliding ends."""
    mode = modes(space)[k]
    if mode == 0.0:
        return integers(sides.flags, sides.count)[k] != 0 and value < 0.0
    return (mode > 0.0 and value < 0.0) or (mode < 0.0 and value > 0.0)


@compiled(**LEAN)
def turns_near_zero(a, b, c):
    """Whether a function with these values at even distances, all of one sign, comes near to zero between them."""
    bend = a - 2.0 * b + c
    if abs(b) > min(abs(a), abs(c)) or bend * b <= 0.0:
        return False
    return abs(b) - (c - a) ** 2 / (8.0 * abs(bend)) < _NEAR * abs(b)


@compiled(**LEAN)
def may_leave(space, sides, t, h):
    """Whether a condition may leave its side within a step, by a sketch of its state; `after` is known."""
    count, last = sides.count, len(_LOOKS) + 1
    looks = floats(sides.looks, count * (last + 1))
    before, after = floats(sides.before, count), floats(sides.after, count)
    astray = False
    for k in range(count):
        looks[k], looks[count * last + k] = before[k], after[k]
        astray |= strays(space, sides, k, after[k])
    if astray:
        return True
    for j in range(1, last):
        theta = _LOOKS[j - 1]
        where = sketch_within(space, theta)
        look_up(space, t, h, theta)
        event_values(space, sides, t + theta * h, where, sides.looks + 8 * count * j)
        for k in range(count):
            if strays(space, sides, k, looks[count * j + k]):
                return True
    for k in range(count):
        for j in range(1, last):
            if turns_near_zero(looks[count * (j - 1) + k], looks[count * j + k], looks[count * (j + 1) + k]):
                return True
    return False


@compiled(**LEAN)
def turn_astray(space, sides):
    """Have those turn that were on the wrong side from the start of a step to its end; whether there are any."""
    start, end = floats(sides.looks, sides.count), floats(sides.after, sides.count)
    turning, found = integers(sides.turning, sides.count), False
    for k in range(sides.count):
        if strays(space, sides, k, end[k]) and not strays(space, sides, k, -start[k]):
            turning[k], found = 1, True
    return found


@compiled(**LEAN)
def turn_first(space, sides):
    """Have those turn that leave their sides first, at one time; returns that part of the step, or NONE."""
    thetas, found = floats(sides.theta, sides.most), integers(sides.event, sides.most)
    turning, first = integers(sides.turning, sides.count), NONE
    for j in range(sides.found):
        held = modes(space)[found[j]] != 0.0 or integers(sides.flags, sides.count)[found[j]] != 0
        if held and thetas[j] <= first + _AT_ONCE:
            first = min(first, thetas[j])
            turning[found[j]] = 1
    return first


@compiled(**LEAN)
def keep_sides(space, log, sides, t, h, where):
    """What becomes of a step from t over h to the state at an address, and the part of it that is left.

    KEPT: no condition left its side in it. SHORTER: it ends at that part, and conditions turn there. NOTHING: they turn
    where it began. CHATTER: they do so without end. Those that turn are put on their sides by `take_sides`.
    """
    return _call_keep(space.keep_sides, (common(space), log, sides, t, h, where))


@compiled(**BY_ADDRESS)
def keep(space, log, sides, t, h, where):
    """`keep_sides`."""
    look_up(space, t, h, 1.0)
    event_values(space, sides, t + h, where, sides.after)
    fate, part = KEPT, 1.0
    if sides.free != 0:
        hold_all(space, sides, sides.after)
    elif may_leave(space, sides, t, h):
        call_walk(space.walk, (space, log, sides, t, h))
        part = turn_first(space, sides)
        if part != NONE:
            fate = SHORTER if part * h > _LEAST_STEP * np.spacing(abs(t)) else NOTHING
        elif turn_astray(space, sides):
            fate = NOTHING
    if fate == KEPT:
        sides.changes = 0
        before, after = floats(sides.before, sides.count), floats(sides.after, sides.count)
        for k in range(sides.count):
            before[k] = after[k]
            if modes(space)[k] == 0.0 and integers(sides.flags, sides.count)[k] == 0:
                hold(space, sides, k, after[k])
        write_modes(space)
    else:
        sides.changes = 0 if fate == SHORTER and part > _NO_PROGRESS else sides.changes + 1
        sides.turned = 1
        if chatters(sides, t):
            fate = CHATTER
    return fate, part


@compiled(**LEAN)
def chatters(sides, t):
    """Whether conditions have changed sides again and again while next to no time passed; t: of another change."""
    if sides.counted == 0:
        sides.since = t
    sides.counted += 1
    if sides.counted < _CHATTER:
        return False
    sides.counted = 0
    return t - sides.since < _NO_TIME * (t - sides.start)
