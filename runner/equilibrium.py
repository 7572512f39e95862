"""The static state of a model: where it rests under its weight and its inputs as they are at t0.

Newton's method with the exact Jacobian and backtracking on the accelerations at rest (Deuflhard, Newton Methods for
Nonlinear Problems, chapter 3), every equation scaled by its row of the Jacobian, which turns accelerations into
displacements.
"""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from qddot.runner.checks import finite, finite_state, unknown
from qddot.runner.inertia import singular_mass
from qddot.runner.inputs.bind import bind
from qddot.runner.inputs.reader import evaluate, reader_for
from qddot.runner.inputs.signal import InputTable, Signal
from qddot.runner.load import Model, Parameters, as_model
from qddot.runner.manifold import Manifold
from qddot.runner.sparse import LARGE, Factors
from qddot.runner.switching import sides

Vector = NDArray[np.float64]
Integers = NDArray[np.int64]
#: Where the search for a static state starts: coordinates (and internal states) by name, the others 0; or a state.
Guess = Mapping[str, float] | ArrayLike | None

#: Iterations and halvings of a step before Newton's method gives up.
MOST_ITERATIONS, MOST_HALVINGS = 60, 40
#: Residual, relative to the terms that must cancel, below which the model rests.
AT_REST = 1e-10
#: Reciprocal condition, rows and columns scaled, below which a Jacobian is singular.
SINGULAR = 1e-12
#: Components of the null vector relative to the largest that are named.
NAMED = 0.1
#: What stands for an infinite stiffness where directions without any are looked for.
HUGE = 1e200
#: Coordinates of which a message gives the values.
MOST_TOLD = 8
#: What to do about it.
ADVICE = "give the initial state (initial= in Python, [initial] in a study)"


class EquilibriumError(ValueError):
    """There is no static state, or it is not isolated; the message names the coordinates."""


def equilibrium(
    model: Model,
    parameters: Parameters = None,
    inputs: Mapping[str, Signal | float] | None = None,
    t0: float = 0.0,
    guess: Guess = None,
) -> Vector:
    """The state [q, 0, z] (n_states,) that stays, with the inputs at t0 and their rates 0.

    All accelerations vanish there, and the rates of internal states z. An internal state that rests wherever it is, as
    that of a hysteresis does, keeps the value of the guess. Where internal states make a whole family of static states,
    the guess itself is the one if it is of the family. Constraints are fulfilled.

    guess: where the search starts, coordinates and internal states by name or a state (n_states,) whose velocities are
    not used; 0 where not given. Raises EquilibriumError where the accelerations do not vanish (naming the coordinate
    with the largest), where they are not finite (naming the coordinates, and the singular mass matrix where it is one),
    or where the state can be moved without force (naming the coordinates that move).
    """
    model, t0 = as_model(model), finite("t0", t0)
    c = model.constants(model.parameter_values(parameters))
    return rest(model, c, bind(model.tables, inputs, sides(model, c, t0, t0)), t0, guess)


def rest(model: Model, c: Vector, table: InputTable, t0: float, guess: Guess = None) -> Vector:
    """As `equilibrium`, for constants c and bound inputs."""
    u, (free, _) = resting_inputs(table, t0), still(model)
    residual, jacobian = _at_rest(model, c, u, t0)
    start = _start(model, guess)[free]
    with np.errstate(all="ignore"):
        sought = _sought(model, residual(start), jacobian(start))
        q, r, J = _newton(residual, jacobian, start, sought)
        resting = np.flatnonzero(~sought)
        if r[resting].any() or J[resting].any():  # they rested at the guess alone
            sought[:] = True
            q, r, J = _newton(residual, jacobian, start, sought)
    if not (np.isfinite(r).all() and (np.isfinite(J).all() or not r.any())):
        x = _state(model, q)
        where = "where the search starts" if (q == start).all() else "where the search leads"
        why = singular_mass(model, t0, x, u, c)
        raise EquilibriumError(
            f"{_not_finite(model, r, J, x)}, {where}{f': {why}' if why else ''}; "
            f"start it elsewhere (guess=), or {ADVICE}"
        )
    if not _vanishes(r, J, q):
        raise EquilibriumError(_none_message(model, r, t0))
    known = np.nan_to_num(J, nan=HUGE, posinf=HUGE, neginf=-HUGE)
    loose = _free_directions(np.delete(known, np.flatnonzero(~sought), axis=0)[:, sought])
    if loose is not None:
        moving = np.flatnonzero(sought)[np.abs(loose) > NAMED * np.abs(loose).max()]
        if (moving >= model.tables.coordinates).any() and _vanishes(residual(start), jacobian(start), start):
            return _state(model, start)
        names = [model.state_names[i] for i in free[moving]]
        raise EquilibriumError(
            f"model {model.name}: the static state is not isolated: nothing holds {', '.join(names)}; "
            f"{ADVICE}, or add a spring"
        )
    return _state(model, q)


def _sought(model: Model, r: Vector, J: Vector) -> NDArray[np.bool_]:
    """Which of the states are sought: all but internal ones that rest wherever they and the coordinates are."""
    sought = np.ones(J.shape[1], dtype=bool)
    internal = slice(model.tables.coordinates, len(sought))
    sought[internal] = (r[internal] != 0) | (J[internal] != 0).any(axis=1)
    return sought


def still(model: Model) -> tuple[Integers, Integers]:
    """Indices of the states that are sought at rest, coordinates and internal ones, and of the rates that vanish."""
    n, states = model.tables.coordinates, np.arange(len(model.state_names))
    return np.concatenate([states[:n], states[2 * n :]]), states[n:]


def _state(model: Model, q: Vector) -> Vector:
    """The state (n_states,) at rest at q, coordinates and internal states."""
    return _with(q, still(model)[0], len(model.state_names))


def _with(q: Vector, free: Integers, size: int) -> Vector:
    """Zeros (size,), with q in the places `free`."""
    x = np.zeros(size)
    x[free] = q
    return x


def _start(model: Model, guess: Guess) -> Vector:
    """The state (n_states,) that a guess gives."""
    free, x = [model.state_names[i] for i in still(model)[0]], np.zeros(len(model.state_names))
    if guess is None:
        return x
    if not isinstance(guess, Mapping):
        return finite_state(f"model {model.name}", guess, model.state_names, "guess")
    for name, value in guess.items():
        if name not in free:
            raise ValueError(f"model {model.name}: guess: {unknown('coordinate', name, free)}")
        x[model.state_names.index(name)] = finite(f"model {model.name}: guess of {name}", value)
    return x


def resting_inputs(table: InputTable, t0: float) -> Vector:
    """The inputs u at t0, their rates 0: all that the static state depends on beside the constants."""
    u = np.zeros(max(1, len(table.first)))
    evaluate(table, reader_for(table), t0, t0, len(table.first), u)
    u[: len(table.order)][table.order > 0] = 0.0
    return u


def _at_rest(
    model: Model, c: Vector, u: Vector, t0: float
) -> tuple[Callable[[Vector], Vector], Callable[[Vector], Vector]]:
    """What must vanish (n,) at rest as a function of the states q (n,) that are sought, and its Jacobian (n, n).

    Below them stand the residuals of constraints on positions, where there are any.
    """
    rhs, jacobian = model.kernel("rhs"), model.matrix("jacobian")
    (free, vanishing), size = still(model), len(model.state_names)
    manifold, n = Manifold(model, c, t0, u), model.tables.coordinates

    def rates(q: Vector) -> Vector:
        x = _with(q, free, size)
        dx = np.zeros(len(x))
        rhs(t0, x, u, c, dx)
        return np.concatenate([dx[vanishing], manifold.at(x).positions]) if manifold.constraints else dx[vanishing]

    def derivative(q: Vector) -> Vector:
        x = _with(q, free, size)
        J = jacobian(t0, x, u, c)[np.ix_(vanishing, free)]
        if not manifold.constraints:
            return J
        G = manifold.at(x).G[: manifold.n_positions]
        return np.vstack([J, np.hstack([G, np.zeros((len(G), len(q) - n))])])

    return rates, derivative


def _newton(
    residual: Callable[[Vector], Vector],
    jacobian: Callable[[Vector], Vector],
    q: Vector,
    sought: NDArray[np.bool_],
) -> Any:
    """The last iterate with its residual and Jacobian; iterates until a step no longer helps.

    Only the states that are sought move.
    """
    r, J = residual(q), jacobian(q)
    for _ in range(MOST_ITERATIONS):
        if not (np.isfinite(r).all() and np.isfinite(J).all()):
            break
        scale = _scale(J, q)
        size = np.linalg.norm(r / scale)
        step = np.zeros_like(q)
        step[sought] = _least((J / scale[:, None])[:, sought], -r / scale)
        for halving in range(MOST_HALVINGS):
            tried = q + 0.5**halving * step
            if (tried == q).all():  # what is left of the step is lost in rounding
                return q, r, J
            r_tried = residual(tried)
            if np.linalg.norm(r_tried / scale) < size:
                break
        else:
            break
        q, r, J = tried, r_tried, jacobian(tried)
    return q, r, J


def _least(A: Vector, b: Vector) -> Vector:
    """The least of the best solutions of A x = b; where A is large and regular, by its sparse factors."""
    factors = _factors(A)
    if factors is not None and factors.condition * SINGULAR < 1.0:
        return factors.solve(b)
    return np.asarray(np.linalg.lstsq(A, b, rcond=SINGULAR)[0], dtype=np.float64)


def _factors(A: Vector) -> Factors | None:
    if len(A) < LARGE or A.shape[0] != A.shape[1]:
        return None
    from scipy.sparse import csc_array  # noqa: PLC0415 - of large models alone

    return Factors(csc_array(A))


def _vanishes(r: Vector, J: Vector, q: Vector) -> bool:
    """Whether r is nothing, or the rounding left of terms J_ij q_j, or of accelerations of order 1, that cancel."""
    if not r.any():
        return True
    return bool((np.abs(r) <= AT_REST * _terms(J, q)).all())


def _terms(J: Vector, q: Vector) -> Vector:
    """How large the terms are that cancel in each row, or accelerations of order 1."""
    terms: Vector = np.abs(J) @ np.abs(q) + 1.0
    return terms


def _scale(J: Vector, q: Vector) -> Vector:
    """What each row is measured by.

    Rows more than there are states agree but for rounding, so that each counts by that: one may hold nothing else.
    """
    return _nonzero(np.abs(J).max(axis=1)) if len(J) == len(q) else _terms(J, q)


def _free_directions(J: Vector) -> Vector | None:
    """A direction (n,) in which the state moves without force; None where there is none."""
    rows = _nonzero(np.abs(J).max(axis=1))
    columns = _nonzero(np.abs(J / rows[:, None]).max(axis=0))
    scaled = J / rows[:, None] / columns
    factors = _factors(scaled)
    if factors is not None and len(J) * factors.condition * SINGULAR < 1.0:  # of the 2-norm at most n times as large
        return None
    _, singular_values, V = np.linalg.svd(scaled)
    return V[-1] / columns if singular_values[-1] <= SINGULAR * singular_values[0] else None


def _nonzero(scale: Vector) -> Vector:
    return np.where(scale > 0, scale, 1.0)


def _not_finite(model: Model, r: Vector, J: Vector, x: Vector) -> str:
    """What is not finite at rest at x."""
    free, _ = still(model)
    rows: Any = ~np.isfinite(r)
    what = "acceleration"
    if not rows.any():
        rows, what = ~np.isfinite(J).all(axis=1), "stiffness"
    names = [model.state_names[i] for i in free[rows[: len(free)]]]
    names += [each.name for each, bad in zip(model.tables.constraints, rows[len(free) :], strict=False) if bad]
    pairs = [(model.tables.states[i], x[i]) for i in free]
    told = ", ".join(f"{state.name} = {value:.6g} {state.unit}".rstrip() for state, value in pairs[:MOST_TOLD])
    more = ", ..." if len(pairs) > MOST_TOLD else ""
    return f"model {model.name}: the {what} of {', '.join(names)} is not finite at rest at {told}{more}"


def _none_message(model: Model, r: Vector, t0: float) -> str:
    (free, vanishing), states = still(model), model.tables.states
    off = np.abs(r[len(free) :])
    if off.max(initial=0.0) > AT_REST:
        j = int(np.argmax(off))
        return (
            f"model {model.name}: no static state found at t = {t0:g} that fulfils constraint "
            f"{model.tables.constraints[j].name}: it is off by {r[len(free) + j]:.6g} where the search ends; "
            f"start it elsewhere (guess=), or {ADVICE}"
        )
    i = int(np.argmax(np.abs(r[: len(free)])))
    what, unit = "an acceleration" if i < model.tables.coordinates else "a rate", states[vanishing[i]].unit
    return (
        f"model {model.name}: no static state found at t = {t0:g}: {states[free[i]].name} keeps {what} of {r[i]:.6g} "
        f"{unit} per s; {ADVICE}, other parameters or other inputs"
    )
