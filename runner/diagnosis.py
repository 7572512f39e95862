"""Why a run of a model could not go on, as far as the model itself tells: what to say beside time and state."""

import numpy as np
from numpy.typing import NDArray

from qddot.runner.inertia import singular_mass
from qddot.runner.inputs.reader import evaluate, reader_for
from qddot.runner.jumps import jump
from qddot.runner.load import Model
from qddot.runner.problem import Problem, Status, Trajectory

#: Endings at which the accelerations may not exist, and those of a run that took too many or too small steps.
BROKEN = (Status.NON_FINITE, Status.STEP_UNDERFLOW, Status.NEWTON_FAILURE)
CREEPING = (Status.STEP_UNDERFLOW, Status.NEWTON_FAILURE, Status.TOO_MANY_STEPS, Status.TIME_LIMIT, Status.INTERRUPTED)
#: States beyond which whatever is not finite is but a consequence of their size.
OVERFLOWING = 1e30


def diagnosis(model: Model, problem: Problem, trajectory: Trajectory) -> str:
    """What is wrong at the last good state of a run that failed, and what to do; "" where nothing is to be seen."""
    t, x, c = float(trajectory.t[-1]), trajectory.states[-1].copy(), problem.constants
    u = np.zeros(max(1, len(problem.inputs.first)))
    evaluate(problem.inputs, reader_for(problem.inputs), t, t, len(problem.inputs.first), u)

    def slope(state: NDArray[np.float64]) -> NDArray[np.float64]:
        dx = np.zeros(len(x))
        model.kernel("rhs")(t, state, u, c, dx)
        return dx

    if trajectory.status in BROKEN and (np.abs(x) < OVERFLOWING).all():
        why = singular_mass(model, t, x, u, c)
        if why:
            return f"{why}; start elsewhere, or choose coordinates that keep away from such states"
        names = ", ".join(model.state_names[i] for i in np.flatnonzero(~np.isfinite(slope(x))))
        if names:
            return f"the rate of {names} is not finite at this state; start elsewhere, or check the parameters"
        if any(each.outside == "refuse" for each in model.tables.lookups):
            return _beyond(model)
    if trajectory.status in CREEPING:
        reach = np.abs(slope(x)) * (t - float(trajectory.t[0]))  # of a state that sticks from the start
        found = jump(slope, x, np.maximum(np.abs(trajectory.states).max(axis=0), np.nan_to_num(reach)))
        return _told(model, x, *found) if found else ""
    return ""


def _beyond(model: Model) -> str:
    """Tables that have no value outside, where the next step leads."""
    found = [each for each in model.tables.lookups if each.outside == "refuse"]
    told = (f"{each.name} ({f'{each.first:.6g} to {each.last:.6g} {each.argument}'.rstrip()})" for each in found)
    return f"the next step may lead beyond the points of a table that refuses it: {', '.join(told)}"


def _told(model: Model, x: NDArray[np.float64], rate: int, passing: int, height: float) -> str:
    states = model.tables.states
    return (
        f"the rate of {states[rate].name} jumps by {height:.4g} {states[rate].unit} per s where {states[passing].name} "
        f"passes {x[passing]:.3g} {states[passing].unit}, so that the solution sticks or chatters there; smooth the "
        "jump (tanh(v/v_0) for sign(v), or DryFriction with smooth), or take a method that locates switches, or one of "
        "constant step"
    )
