"""What each kernel computes, written down plainly: assignments and writes before any optimization."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import islice
from typing import Any

import symengine as se

from qddot.codegen.calculus import by, dot
from qddot.codegen.convert import convert, symbol
from qddot.codegen.elimination import Factors, factorize, solve
from qddot.codegen.kernel import Assignment, Slot
from qddot.codegen.lagrange import Equations
from qddot.codegen.nodes import symbols_of
from qddot.codegen.recurrences_squares import squares
from qddot.codegen.rewrite import Names
from qddot.model.contents import accelerations
from qddot.model.definitions import as_expression
from qddot.model.events import Event, Impact

Matrix = dict[tuple[int, int], Any]
Write = tuple[Slot, Any]


@dataclass(frozen=True)
class Draft:
    """Temporaries and writes of a kernel; temporaries may be more than it needs."""

    temporaries: tuple[Assignment, ...]
    writes: tuple[Write, ...]


class Drafts:
    """The drafts of all kernels of one system; accelerations come from one LDL^T of the mass matrix."""

    def __init__(self, equations: Equations, names: Names) -> None:
        self._equations = equations
        self._names = names
        self._n = len(equations.coordinates)
        self._factors: Factors = factorize(equations.mass, equations.elimination, names.fresh)
        self._fixed_mass = equations.mass_matrix != "configuration-dependent"
        self._wishes = [str(acceleration) for acceleration in equations.accelerations]
        self._solution, accelerations = solve(self._factors, _sparse(equations.forces), names.fresh, self._wishes)
        still = [(names.fresh(wish), se.Integer(0)) for k, wish in enumerate(self._wishes) if k not in accelerations]
        self._solution += still
        self._accelerations = [accelerations.get(k, se.Integer(0)) for k in range(self._n)]

    @cached_property
    def parameter_assignments(self) -> tuple[Assignment, ...]:
        """Quantities that are constant during a run, and the factors of a constant mass matrix."""
        return self._equations.fixed_quantities + (self._factors.assignments if self._fixed_mass else ())

    def rhs(self) -> Draft:
        """Dx = [qdot, M^-1 f, zdot]."""
        derivatives = (*self._equations.velocities, *self._accelerations, *self._equations.state_rates)
        return Draft((*self._moving, *self._solution), vector_writes("derivative", derivatives))

    def balance(self) -> Draft | None:
        """M and f for the recurrences; None where M is constant: then the right-hand side says it all."""
        return None if self._fixed_mass else balance(self._equations)

    def others(self) -> Mapping[str, Draft]:
        """Every other kernel but `constants`."""
        slopes = {"jacobian": self._jacobian(), "input_jacobian": self._input_jacobian()}
        events = {"events": Draft(self._moving, event_writes(self._equations))}
        return {
            "mass": self._mass(),
            "energy": self._energy(),
            "outputs": self._outputs(),
            **(events if self._equations.events else {}),
            **({"scene": self._values(self._equations.scene)} if self._equations.scene else {}),
            **slopes,
        }

    @cached_property
    def linear(self) -> bool:
        """Whether dx = A x + B u + b with A, B and b constant during a run."""
        equations = self._equations
        if not self._fixed_mass or self._switched:
            return False
        (steps, entries), (input_steps, input_entries) = self._state_slopes, self._input_slopes
        nothing = dict.fromkeys((*equations.state, *equations.channels), se.Integer(0))
        rest = equations.definitions.substitute((*equations.forces, *equations.state_rates), nothing)
        if rest is None:
            return False
        temporaries = (*self.parameter_assignments, *steps, *input_steps)
        known = set(equations.parameters) | {symbol for symbol, _ in temporaries}
        values = (*entries.values(), *input_entries.values(), *rest, *(e for _, e in (*steps, *input_steps)))
        return all(symbols_of(value) <= known for value in values)

    @property
    def _switched(self) -> bool:
        """Whether conditions in time change the equations of motion."""
        equations = self._equations
        held = (*equations.forces, *equations.state_rates)
        return any(equations.definitions.base_symbols(each) & equations.switches.functions.keys() for each in held)

    @property
    def _moving(self) -> tuple[Assignment, ...]:
        """Quantities that move, and the factors of a mass matrix that does."""
        return self._equations.moving_quantities + (() if self._fixed_mass else self._factors.assignments)

    @cached_property
    def _state_slopes(self) -> tuple[list[Assignment], Matrix]:
        return self._slopes(self._equations.state)

    @cached_property
    def _input_slopes(self) -> tuple[list[Assignment], Matrix]:
        return self._slopes(self._equations.channels)

    def _slopes(self, variables: tuple[Any, ...]) -> tuple[list[Assignment], Matrix]:
        """Assignments and entries of d [qddot, zdot] / d variables: M^-1 (df/ds - dM/ds qddot), column by column."""
        equations = self._equations
        wanted = frozenset(variables)
        gradients = [equations.definitions.gradient(force, wanted) for force in equations.forces]
        inertia = {pair: equations.definitions.gradient(entry, wanted) for pair, entry in equations.mass.items()}
        assignments: list[Assignment] = []
        entries: Matrix = {}
        columns: dict[Any, dict[int, Any]] = {variable: {} for variable in variables}

        def add(row: int, variable: Any, value: Any) -> None:
            columns[variable][row] = columns[variable].get(row, se.Integer(0)) + value

        for row, gradient in enumerate(gradients):
            for variable, value in gradient.items():
                add(row, variable, value)
        for (k, j), gradient in inertia.items():
            for variable, value in gradient.items():
                add(k, variable, -value * equations.accelerations[j])
                if j != k:
                    add(j, variable, -value * equations.accelerations[k])
        for column, variable in enumerate(variables):
            steps, values = solve(self._factors, columns[variable], self._names.fresh)
            assignments += steps
            entries.update({(row, column): value for row, value in values.items()})
        place = {variable: column for column, variable in enumerate(variables)}
        for row, rate in enumerate(equations.state_rates, self._n):
            gradient = equations.definitions.gradient(rate, wanted)
            entries.update({(row, place[variable]): value for variable, value in gradient.items()})
        return assignments, entries

    def _jacobian(self) -> Draft:
        steps, entries = self._state_slopes
        velocities: Matrix = {(k, self._n + k): se.Integer(1) for k in range(self._n)}
        return Draft((*self._moving, *self._solution, *steps), matrix_writes(velocities | self._below(entries)))

    def _input_jacobian(self) -> Draft:
        """Its columns: all inputs, then their derivatives."""
        steps, entries = self._input_slopes
        return Draft((*self._moving, *self._solution, *steps), matrix_writes(self._below(entries)))

    def _below(self, entries: Matrix) -> Matrix:
        """Entries of d [qddot, zdot] / d something in the rows of dx = [qdot, qddot, zdot]."""
        return {(self._n + row, column): value for (row, column), value in entries.items()}

    def _mass(self) -> Draft:
        return Draft(self._moving, matrix_writes(self._equations.mass))

    def _energy(self) -> Draft:
        equations = self._equations
        powers = (equations.dissipated_power, equations.input_power)
        return self._values((equations.kinetic, equations.potential, *powers))

    def _outputs(self) -> Draft:
        return self._values(self._equations.outputs)

    def _values(self, values: Iterable[Any]) -> Draft:
        return Draft((*self._moving, *self._solution), vector_writes("values", values))


def switching(equations: Equations) -> Draft:
    """What changes sign at the conditions in time, its slope and how it bends: see `Switches.rows`."""
    values = [value for row in equations.switches.rows() for value in row]
    return Draft(tuple(equations.switches.definitions.expressions.items()), vector_writes("values", values))


def switching_functions(equations: Equations, modes: Sequence[Any]) -> Draft:
    """What changes sign at the conditions that have these modes."""
    writes = vector_writes("values", (equations.modes.functions[mode] for mode in modes))
    return Draft(equations.moving_quantities, writes)


def approach(equations: Equations, modes: Sequence[Any]) -> Draft:
    """How fast these move: derivatives by the states, beside them the rest of d/dt, and how far they are held.

    Rows of those that no velocity and no internal state moves, and of those that depend on the rate of an input whose
    second rate is no channel, are empty: nothing can be held where these vanish.
    """
    definitions, states = equations.definitions, equations.state
    clock = clock_of(equations)
    fast = frozenset(states[len(equations.coordinates) :])
    entries: Matrix = {}
    for k, mode in enumerate(modes):
        function = equations.modes.functions[mode]
        held = definitions.base_symbols(function)
        if not held & fast or held & frozenset(equations.rates) - clock.keys():
            continue
        slopes = definitions.gradient(function, (*states, *clock))
        entries |= {(k, column): slopes[each] for column, each in enumerate(states) if each in slopes}
        rest = se.Add(*(slopes[each] * speed for each, speed in clock.items() if each in slopes))
        if rest != 0:
            entries[k, len(states)] = rest
        if mode in equations.modes.bounds:
            entries[k, len(states) + 1] = equations.modes.bounds[mode]
    return Draft(equations.moving_quantities, matrix_writes(entries))


def clock_of(equations: Equations) -> dict[Any, Any]:
    """What no state moves -> how fast it goes: time, inputs, and rates of those that are prescribed."""
    second = {symbol(u.rate): symbol(a) for u in equations.system.inputs for a in accelerations(u)}
    return {equations.time: se.Integer(1), **dict(zip(equations.inputs, equations.rates, strict=True)), **second}


def event_writes(equations: Equations) -> tuple[Write, ...]:
    """Functions of the events, then the values that they give: of an impact what its impulse follows from.

    That is its restitution, how fast its gap changes, and the slope of the gap by each coordinate. The function of one
    that can rest is its gap above what stands for `rests`, which is 0 or less, or while it rests its force.
    """
    events = equations.system.events
    given = iter(equations.events)
    functions = list(islice(given, len(events)))
    values = [_watched(event, gap, equations) for event, gap in zip(events, functions, strict=True)]
    clock = clock_of(equations) | dict(zip(equations.states, equations.state_rates, strict=True))
    for event, gap in zip(events, functions, strict=True):
        if not isinstance(event, Impact):
            values += islice(given, len(event.then))
            continue
        slopes = equations.definitions.gradient(gap, (*equations.coordinates, *clock))
        along = by(slopes, equations.coordinates)
        driven = (slopes[each] * rate for each, rate in clock.items() if each in slopes)
        speed = dot(along, equations.velocities) + se.Add(*driven)
        values += [convert(as_expression(event.restitution)), speed, *along]
    return vector_writes("values", values)


def _watched(event: Event, function: Any, equations: Equations) -> Any:
    """What passes zero where an event happens."""
    if not isinstance(event, Impact) or symbol(event.rests_symbol) not in equations.contacts:
        return function
    sign = symbol(event.rests_symbol)
    force = symbol(event.force_symbol)
    apart = function - sign
    holds = force in equations.constraints.multipliers
    return se.Piecewise((force, se.Lt(0, sign)), (apart, True)) if holds else apart


def balance(equations: Equations) -> Draft:
    """M and f of M qddot = f, or, where T is a sum of squares, its weights and f without them; and rates of states.

    See `recurrences`. turning: of place k the coordinate i, and g.
    """
    weights, rates = squares(equations), vector_writes("rate", equations.state_rates)
    moving = equations.moving_quantities
    if weights is None:
        return Draft(moving, (*vector_writes("force", equations.forces), *matrix_writes(equations.mass), *rates))
    places = list(weights)
    rows = zip(equations.applied, equations.dissipative, equations.conservative, strict=True)
    entries = {
        (a, b): weights[place].get(places[b], se.Integer(0)) for a, place in enumerate(places) for b in range(a + 1)
    }
    forces = vector_writes("force", [se.Add(q, -phi, -pi) for q, phi, pi in rows])
    turning = ((Slot("turning", (k, i)), g) for k, (i, g) in enumerate(places))
    weighing = ((Slot("weight", place), value) for place, value in entries.items())
    return Draft(moving, (*forces, *turning, *weighing, *rates))


def _sparse(values: Iterable[Any]) -> dict[int, Any]:
    return {index: value for index, value in enumerate(values) if value != 0}


def vector_writes(argument: str, values: Iterable[Any]) -> tuple[Write, ...]:
    """What fills a vector."""
    return tuple((Slot(argument, (index,)), value) for index, value in enumerate(values))


def matrix_writes(entries: Mapping[tuple[int, int], Any], argument: str = "matrix") -> tuple[Write, ...]:
    """What fills these entries of a matrix, row by row."""
    return tuple((Slot(argument, index), entries[index]) for index in sorted(entries))
