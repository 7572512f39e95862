"""Initial states that fulfil the constraints of a model: what is given is held, what is not is found.

Gauss and Newton's iteration with halved steps on the coordinates that may move, of many steps the shortest in the
metric of the masses; then the velocities, which the constraints hold linearly.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from qddot.runner.checks import finite, finite_state, unknown
from qddot.runner.inputs.bind import bind
from qddot.runner.inputs.reader import evaluate, reader_for
from qddot.runner.inputs.signal import InputTable, Signal
from qddot.runner.load import Model, Parameters, as_model
from qddot.runner.manifold import Manifold, terms
from qddot.runner.switching import sides

Vector = NDArray[np.float64]
Values = Mapping[str, float] | ArrayLike

#: Iterations, and halvings of one step.
MOST_ITERATIONS, MOST_HALVINGS = 100, 40
#: Singular value relative to the largest below which a direction is none.
SINGULAR = 1e-10
#: What a residual may be relative to the size of its terms where all that it depends on is given; what rounding leaves;
#: and what leaves nothing to be found.
GIVEN, FOUND, NOTHING = 1e-6, 1e-11, 1e-14
#: Part of the largest residual from which on others are named.
NAMED = 0.1


class AssemblyError(ValueError):
    """There is no state that fulfils the constraints; the message names them and the states that were held."""


def assemble(
    model: Model,
    initial: Values | None = None,
    *,
    guess: Values | None = None,
    parameters: Parameters = None,
    inputs: Mapping[str, Signal | float] | None = None,
    t0: float = 0.0,
) -> Vector:
    """A state (n_states,) that fulfils the constraints of a model at t0.

    initial: states by name, which are held; or all of them (n_states,), which must fulfil the constraints but for what
    rounding to six digits leaves. guess: where the search for the others starts, by name or (n_states,), 0 where not
    given: where there are several assemblies, it leads to one near it. What remains free after that moves no farther
    than it must, in the metric of the masses.
    Raises AssemblyError where no such state is found, naming the constraints that are not fulfilled.
    """
    model, t0 = as_model(model), finite("t0", t0)
    c = model.constants(model.parameter_values(parameters))
    table = bind(model.tables, inputs, sides(model, c, t0, t0))
    return assembled(model, c, table, t0, {} if initial is None else initial, guess)


def assembled(
    model: Model, c: Vector, table: InputTable, t0: float, initial: Values, guess: Values | None = None
) -> Vector:
    """As `assemble`, for constants c and bound inputs."""
    if not model.tables.constraints:
        return _start(model, initial, guess)[0]
    return assembled_on(manifold_of(model, c, table, t0), initial, guess)


def assembled_on(manifold: Manifold, initial: Values, guess: Values | None = None) -> Vector:
    """The same on constraints that are known."""
    return _found(manifold, *_start(manifold.model, initial, guess))


def manifold_of(model: Model, c: Vector, table: InputTable, t0: float) -> Manifold:
    """The constraints with the inputs at an instant."""
    u = np.zeros(max(1, len(table.first)))
    evaluate(table, reader_for(table), t0, t0, len(table.first), u)
    return Manifold(model, c, t0, u)


def _found(manifold: Manifold, x: Vector, held: NDArray[np.bool_]) -> Vector:
    """The state on the constraints, from x; held: which of its entries are to stay."""
    if held.all() and manifold.holds(x, NOTHING):
        return x
    search = _Search(manifold, held)
    x = search.velocities(search.positions(x))
    everything = _Search(manifold, np.zeros(len(x), dtype=bool))  # for what rounding of the given ones left
    return everything.velocities(everything.positions(x)) if held.any() else x


def _start(model: Model, initial: Values, guess: Values | None) -> tuple[Vector, NDArray[np.bool_]]:
    """The state at which the search starts, and which of its entries are held."""
    names = model.state_names
    if not isinstance(initial, Mapping):
        return model.state(initial), np.ones(len(names), dtype=bool)
    x, held = np.zeros(len(names)), np.zeros(len(names), dtype=bool)
    if guess is not None and not isinstance(guess, Mapping):
        x = finite_state(f"model {model.name}", guess, names, "guess")
    elif guess is not None:
        for name, value in guess.items():
            if name not in names:
                raise ValueError(f"model {model.name}: guess: {unknown('state', name, names)}")
            x[names.index(name)] = finite(f"model {model.name}: guess of {name}", value)
    given = model.state(initial)
    for name in initial:
        place = names.index(name)
        x[place], held[place] = given[place], True
    return x, held


@dataclass(frozen=True)
class _Search:
    """The search for a state on a manifold with some of its entries (n_states,) held."""

    manifold: Manifold
    held: NDArray[np.bool_]

    @property
    def coordinates(self) -> int:
        """How many coordinates there are."""
        return self.manifold.model.tables.coordinates

    def positions(self, x: Vector) -> Vector:
        """The state with its coordinates on the constraints."""
        n = self.coordinates
        free = ~self.held[:n]
        count = self.manifold.n_positions
        point = self.manifold.at(x)
        for _ in range(MOST_ITERATIONS):
            scale = _sizes(point.G[:count], point.masses)
            r = point.positions / scale
            if not np.isfinite(r).all() or not r.any():
                break
            step = np.zeros(n)
            step[free] = _shortest(point.G[:count][:, free] / scale[:, None], -r, point.masses[free])
            found = self._shortened(x, step, scale, float(np.linalg.norm(r)))
            if found is None:
                break
            x, point = found
        self._check(x, point.positions, point.G[:count], x[:n], "position")
        return x

    def _shortened(self, x: Vector, step: Vector, scale: Vector, before: float):  # type: ignore[no-untyped-def]
        """The state, and the constraints there, after as much of a step as brings it nearer; None where none does."""
        n = len(step)
        for halving in range(MOST_HALVINGS):
            tried = x.copy()
            tried[:n] += 0.5**halving * step
            point = self.manifold.at(tried)
            if np.linalg.norm(point.positions / scale) < before:
                return tried, point
        return None

    def velocities(self, x: Vector) -> Vector:
        """The state with its velocities on the constraints."""
        n = self.coordinates
        free, x = n + np.flatnonzero(~self.held[n : 2 * n]), x.copy()
        for _ in range(2):  # once more for what rounding left
            point = self.manifold.at(x)
            scale = _sizes(point.G, point.masses)
            rows = point.G[:, free - n] / scale[:, None]
            x[free] += _shortest(rows, -point.velocities / scale, point.masses[free - n])
        point = self.manifold.at(x)
        self._check(x, point.velocities, point.G, x[n : 2 * n], "velocity")
        return x

    def _check(self, x: Vector, residuals: Vector, G: Vector, values: Vector, what: str) -> None:
        """AssemblyError where residuals are more than rounding may leave of their terms, or of states of order 1."""
        constraints, names = self.manifold.constraints, self.manifold.model.state_names
        size = terms(G, values)
        some_free = np.array([(~self._held_of(what) & (row != 0)).any() for row in G], dtype=bool)
        allowed = np.where(some_free, FOUND, GIVEN) * size
        share = np.abs(residuals) / np.where(allowed > 0, allowed, FOUND)
        if not len(share) or share.max() <= 1.0:
            return
        off = np.flatnonzero(~(share <= max(1.0, NAMED * share.max())))
        told = ", ".join(f"{constraints[j].name} ({constraints[j].meaning})" for j in off)
        held = [f"{name} = {value:.6g}" for name, value, is_held in zip(names, x, self.held, strict=True) if is_held]
        model = self.manifold.model.name
        if held:
            raise AssemblyError(
                f"model {model}: the initial values {', '.join(held)} contradict the constraint{'s' * (len(off) > 1)} "
                f"{told}, whose {what} is off by {residuals[off[0]]:.4g}; leave out one of them, and it is found, or "
                "start the search elsewhere (guess= in Python, [assemble] in a study)"
            )
        raise AssemblyError(
            f"model {model}: no {what} fulfils the constraint{'s' * (len(off) > 1)} {told}: off by "
            f"{residuals[off[0]]:.4g} where the search ends; check the parameters, or start it elsewhere (guess= in "
            "Python, [assemble] in a study)"
        )

    def _held_of(self, what: str) -> NDArray[np.bool_]:
        n = self.coordinates
        return self.held[:n] if what == "position" else self.held[n : 2 * n]


def _sizes(G: Vector, masses: Vector) -> Vector:
    """The size of each row of G in the metric of the masses, 1 where it vanishes."""
    weights = np.where(masses > 0, masses, masses.max(initial=0.0) or 1.0)
    sizes: Vector = np.sqrt((G**2 / weights).sum(axis=1))
    return np.where(sizes > 0, sizes, 1.0)


def _shortest(rows: Vector, right: Vector, masses: Vector) -> Vector:
    """The least solution (n,) of rows x = right, of those that fit best, in the metric of the masses."""
    if not rows.size:
        return np.zeros(rows.shape[1])
    weights = np.sqrt(np.where(masses > 0, masses, masses.max(initial=0.0) or 1.0))
    found: Vector = np.linalg.lstsq(rows / weights, right, rcond=SINGULAR)[0] / weights
    return found
