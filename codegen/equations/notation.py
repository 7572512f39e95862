"""The equations of a model as a document: symbols with units and meanings, and formulas made of signed terms.

It knows no layout and no script; `tex`, `page` and `terminal` write it down.
"""

from collections.abc import Iterator, Mapping, Set
from dataclasses import dataclass
from functools import partial
from itertools import accumulate
from math import inf
from typing import Any

import symengine as se

from qddot.codegen.calculus import terms
from qddot.codegen.cells import LEAST
from qddot.codegen.constrained import in_order
from qddot.codegen.convert import convert
from qddot.codegen.convert import symbol as convert_symbol
from qddot.codegen.equations.entries import Entry, ParameterEntry, ranged
from qddot.codegen.equations.legible import legible
from qddot.codegen.equations.order import Order
from qddot.codegen.equations.phrases import Factor, Formula, Indexed, Name, Sum, term
from qddot.codegen.equations.reading import Reader
from qddot.codegen.equations.repeating import Repeating, Rows
from qddot.codegen.equations.spelling import alike
from qddot.codegen.lagrange import Equations
from qddot.codegen.rewrite import replaced
from qddot.model.contents import declared
from qddot.model.definitions import as_expression
from qddot.model.events import Impact
from qddot.model.friction import Friction
from qddot.model.system import ModelError, Quantity

#: Entries of M a coordinate, of models whose rows are looked through for what repeats.
_SPARSE = 4


@dataclass(frozen=True, slots=True)
class Occurrence:
    """An event: what it is, what vanishes where it happens, and what states are behind it, made of those before it."""

    heading: str
    formulas: tuple[Formula, ...]


@dataclass(frozen=True, slots=True)
class MassMatrix:
    """The entries (k, j) with k >= j that do not vanish by structure; kind as in `Equations.mass_matrix`.

    left_out: rows that are not here.
    """

    size: int
    kind: str
    entries: Mapping[tuple[int, int], Sum]
    left_out: int = 0

    @property
    def is_diagonal(self) -> bool:
        """Whether all entries are on the diagonal."""
        return all(k == j for k, j in self.entries)

    @property
    def multiple(self) -> Sum | None:
        """What stands on the diagonal of a large matrix that is a multiple of the identity."""
        alike = self.is_diagonal and self.size >= LEAST and len(set(self.entries.values())) == 1
        return self.entries[0, 0] if alike else None

    def entry(self, k: int, j: int) -> Sum:
        """Any entry of the symmetric matrix; an empty sum where it vanishes."""
        return self.entries.get((max(k, j), min(k, j)), Sum(()))

    @property
    def formulas(self) -> tuple[Formula, ...]:
        """The entries one by one, row by row."""
        return tuple(
            Formula(_alone(Indexed("M", (k + 1, j + 1))), entry) for (k, j), entry in sorted(self.entries.items())
        )


@dataclass(frozen=True, slots=True)
class Document:
    """What a reader is told of a model.

    definitions: of the quantities, each one's rate behind it; energies: T, Pi, Phi; forces: Q of each coordinate that
    has one; motion: one per coordinate, in order, M qddot + gyroscopic terms + dPi/dq + dPhi/dqdot + G' lambda = Q;
    of large models only the first, and of M their rows, left_out more; subjects: what each is of, where cells of the
    model are alike all of them at once; state_motion: one per internal state, zdot = derivative; state_subjects: what
    each of these is of, where `states` has one line for many.
    multipliers: of the constraints, and constraints what vanishes, in the same order.
    is_generalized: Pi depends on velocities, so that L = T - Pi takes the place of T and Pi in Lagrange's equations.
    dotted: the words that may carry dots.
    """

    name: str
    title: str
    source: str
    coordinates: tuple[Entry, ...]
    states: tuple[Entry, ...]
    parameters: tuple[ParameterEntry, ...]
    parameter_sets: tuple[str, ...]
    inputs: tuple[Entry, ...]
    quantities: tuple[Entry, ...]
    tables: tuple[Entry, ...]
    outputs: tuple[Entry, ...]
    definitions: tuple[Formula, ...]
    energies: tuple[Formula, ...]
    forces: tuple[Formula, ...]
    multipliers: tuple[Entry, ...]
    constraints: tuple[Formula, ...]
    events: tuple[Occurrence, ...]
    subjects: tuple[Entry, ...]
    motion: tuple[Formula, ...]
    left_out: int
    state_subjects: tuple[Entry, ...]
    state_motion: tuple[Formula, ...]
    mass: MassMatrix
    output_definitions: tuple[Formula, ...]
    is_generalized: bool
    dotted: Set[str]

    @property
    def equations(self) -> tuple[tuple[Entry, Formula], ...]:
        """What each equation is of, with the equation: of the coordinates, then of the states."""
        entries, formulas = (*self.subjects, *self.state_subjects), (*self.motion, *self.state_motion)
        return tuple(zip(entries, formulas, strict=True))


def describe(equations: Equations, source: str, most: int | None = None) -> Document:
    """Write the derived equations down as a document; `source` names the model's file.

    most: terms of the equations of motion, as they were derived or as they are written, after which no further equation
    is written. Where it is given, what repeats is written once, in symbols with an index.
    Raises ModelError where two symbols would look the same.
    """
    system = equations.system
    dotted = with_dots(equations)
    for one, other in alike((str(symbol) for _, symbol in declared(system)), dotted):
        raise ModelError(f"model {system.name}: {one} and {other} are typeset alike; rename one of them")
    writing = _Writing(equations, most)
    states = tuple(Entry(str(z.symbol), z.unit, z.meaning, str(z.rate)) for z in system.states)
    return Document(
        name=system.name,
        title=system.title,
        source=source,
        coordinates=writing.ranged(_coordinates(equations)),
        states=writing.ranged(states),
        parameters=_parameters(equations),
        parameter_sets=tuple(system.parameter_sets),
        inputs=writing.ranged(_inputs(equations)),
        quantities=tuple(Entry(str(q.symbol), q.unit, _told(q), _text(q.rate)) for q in system.quantities),
        tables=tuple(Entry(table.name, table.unit, table.description) for table in system.tables),
        outputs=tuple(Entry(str(o.symbol), o.unit, o.meaning) for o in system.output_expressions),
        definitions=writing.definitions(),
        energies=writing.energies(),
        forces=writing.forces(),
        multipliers=tuple(Entry(str(c.symbol), c.unit, c.meaning) for c in in_order(system)),
        constraints=writing.constraints(),
        events=writing.events(),
        subjects=tuple(entry for entry, _ in writing.motion),
        motion=tuple(formula for _, formula in writing.motion),
        left_out=writing.left_out,
        state_subjects=states,
        state_motion=tuple(map(writing.definition, equations.state_rates)),
        mass=writing.mass(),
        output_definitions=writing.outputs(),
        is_generalized=bool(equations.definitions.base_symbols(equations.potential) & set(equations.velocities)),
        dotted=dotted,
    )


def with_dots(equations: Equations) -> frozenset[str]:
    """The words that may carry dots: names of what moves."""
    return frozenset(map(str, (*equations.coordinates, *equations.states, *equations.inputs)))


class _Writing:
    """Formulas of one model. What the author wrote is kept; what was derived may be rearranged to read well."""

    def __init__(self, equations: Equations, most: int | None) -> None:
        self._equations = equations
        order = Order(equations)
        self._fixed = order.fixed
        self._most = most
        self._repeating = Repeating(order) if most is not None else None
        self._author, self._derived = (
            Reader(order, turn=turn, conditions=equations.conditions, repeating=self._repeating)
            for turn in (False, True)
        )
        self._mass: dict[tuple[int, int], Any] = {}
        self._columns: list[list[int]] = [[] for _ in equations.coordinates]
        for k, j in equations.mass:
            self._columns[k].append(j)
            if j != k:
                self._columns[j].append(k)
        found = tuple(self._motion())
        self.motion = tuple((entry, formula) for _, entry, formula in found)
        self.left_out = len(equations.coordinates) - sum(count for count, _, _ in found)

    def given(self, left: Factor, expression: Any) -> Formula:
        return Formula(_alone(left), self._author.sum(expression))

    def definition(self, symbol: Any) -> Formula:
        return self.given(Name(str(symbol)), self._equations.definitions.expressions[symbol])

    def definitions(self) -> tuple[Formula, ...]:
        """Of quantities and their rates, and of those derivatives of quantities that the equations are written in."""
        defined, shown = self._equations.definitions, self._equations.written
        kept = set(map(convert_symbol, self._equations.system.definitions)) | defined.needed(shown)
        return tuple(self.definition(s) for s in defined.expressions if s in kept - set(self._equations.state_rates))

    def energies(self) -> tuple[Formula, ...]:
        equations = self._equations
        named = (("T", equations.kinetic), ("Pi", equations.potential), ("Phi", equations.dissipation))
        return tuple(
            Formula(_alone(Name(name)), self._author.sum(energy, positive_first=False, legible=self._legible))
            for name, energy in named
        )

    def forces(self) -> tuple[Formula, ...]:
        pairs = zip(self._equations.coordinates, self._equations.applied, strict=True)
        return tuple(self.given(Indexed("Q", (_index(str(q)),)), force) for q, force in pairs if force != 0)

    def constraints(self) -> tuple[Formula, ...]:
        """What the author says of positions and velocities, and that it vanishes."""
        given = (convert(each.expression) for each in in_order(self._equations.system))
        return tuple(Formula(self._author.sum(expression), Sum(())) for expression in given)

    def events(self) -> tuple[Occurrence, ...]:
        """Of each event its function, which vanishes, and the values that it gives."""
        found, ways = [], {-1: "falls through", 0: "passes", 1: "rises through"}
        for event in self._equations.system.events:
            values = [self.given(Name(str(symbol)), convert(as_expression(e))) for symbol, e in event.then.items()]
            behind = "; the values behind it, of those before" if values else ""
            if isinstance(event, Impact):
                behind = f", and parts again at {event.restitution} times its rate, by an impulse along it"
                if convert_symbol(event.rests_symbol) in self._equations.contacts:
                    behind += f"; where bounces end, it stays zero, by the force {event.force_symbol} while that pushes"
            ends = "; the run ends there" if event.terminal else ""
            heading = f"{event.meaning} ({event.name}): where this {ways[event.direction]} zero{behind}{ends}"
            where = Formula(self._author.sum(convert(as_expression(event.function))), Sum(()))
            found.append(Occurrence(heading, (where, *values)))
        return tuple(found)

    def ranged(self, entries: tuple[Entry, ...]) -> tuple[Entry, ...]:
        """Lines of a symbol table, those that repeat as one."""
        return ranged(entries, self._repeating.index if self._repeating else None)

    def _motion(self) -> Iterator[tuple[int, Entry, Formula]]:
        """The equations of motion, up to so many terms; one at least. Of each how many it is, and of what."""
        most = inf if self._most is None else self._most
        lengths, entries = _lengths(self._equations), _coordinates(self._equations)
        derived = written = 0
        for rows in self._rows():
            for k in rows.rows:
                derived += lengths[k]
                if written and derived > most:
                    return
                equation = self._equation(k, rows.range.standing if rows.range else {})
                before, written = written, written + len(equation.left.terms) + len(equation.right.terms)
                if before and written > most:
                    return
                yield rows.times, rows.entry(entries, k), equation

    def _rows(self) -> list[Rows]:
        """The coordinates, those whose equations repeat by the first of them."""
        equations, size = self._equations, len(self._equations.coordinates)
        if self._repeating is None or len(equations.mass) > _SPARSE * size:
            return [Rows((k,)) for k in range(size)]
        parts = (equations.gyroscopic, equations.conservative, equations.dissipative, equations.applied)
        return self._repeating.rows(
            [
                (
                    equations.coordinates[k],
                    *(se.Mul(equations.mass[max(k, j), min(k, j)], equations.accelerations[j]) for j in columns),
                    *(part[k] for part in parts),
                    *equations.constraints.pull(k),
                )
                for k, columns in enumerate(map(sorted, self._columns))
            ]
        )

    def _entry(self, k: int, j: int) -> Any:
        """An entry of M as it is read."""
        at = max(k, j), min(k, j)
        if at not in self._mass:
            self._mass[at] = self._legible(self._equations.mass[at])
        return self._mass[at]

    def _equation(self, k: int, standing: Mapping[Any, Any]) -> Formula:
        """The equation of coordinate k, its terms in the order of Lagrange's equation.

        standing: what stands for symbols in it.
        """
        equations, put = self._equations, partial(replaced, found=standing)
        entries = [(self._entry(k, j), equations.accelerations[j]) for j in sorted(self._columns[k])]
        inertia = [self._derived.term(put(se.Mul(entry, acceleration))) for entry, acceleration in entries]
        others = (equations.gyroscopic[k], equations.conservative[k], equations.dissipative[k])
        sums = [self._derived.sum(self._legible(put(part)), positive_first=False) for part in others]
        held = [
            self._derived.term(part)
            for pull in equations.constraints.pull(k)
            for part in terms(self._legible(put(pull)))
        ]
        left = (*inertia, *(part for found in sums for part in found.terms), *held)
        return Formula(Sum(left), self._author.sum(put(equations.applied[k])))

    def mass(self) -> MassMatrix:
        """Its rows, of a multiple of the identity all: of others no more than there would be equations one by one."""
        equations, size = self._equations, len(self._equations.coordinates)
        written = size - self.left_out
        if self._most is not None and len(set(equations.mass.values())) > 1:
            within = sum(total <= self._most for total in accumulate(_lengths(equations)))
            written = min(written, max(1, within))
        found = {at: entry for at, entry in equations.mass.items() if at[0] < written}
        read = {entry: self._derived.sum(self._entry(*at)) for at, entry in found.items()}
        return MassMatrix(written, equations.mass_matrix, {at: read[e] for at, e in found.items()}, size - written)

    def outputs(self) -> tuple[Formula, ...]:
        """Definitions of the outputs that are not quantities under their own names."""
        found = zip(self._equations.system.output_expressions, self._equations.outputs, strict=True)
        return tuple(self.given(Name(str(o.symbol)), e) for o, e in found if str(o.symbol) != str(e))

    def _legible(self, expression: Any) -> Any:
        return legible(expression, self._fixed)


def _lengths(equations: Equations) -> list[int]:
    """How many terms each equation of motion has as it was derived."""
    lengths = [0] * len(equations.coordinates)
    for k, j in equations.mass:
        lengths[k] += 1
        lengths[j] += k != j
    for part in (equations.gyroscopic, equations.conservative, equations.dissipative, equations.applied):
        for k, expression in enumerate(part):
            lengths[k] += len(terms(expression))
    return lengths


def _alone(factor: Factor) -> Sum:
    return Sum((term(factor),))


def _index(coordinate: str) -> str | int:
    """What Q of a coordinate is indexed by: 6 for q_6, else the coordinate itself."""
    letter, _, index = coordinate.partition("_")
    return int(index) if letter == "q" and index.isdigit() else coordinate


def _coordinates(equations: Equations) -> tuple[Entry, ...]:
    return tuple(Entry(str(c.symbol), c.unit, c.meaning, str(c.rate)) for c in equations.system.coordinates)


def _told(quantity: Quantity) -> str:
    """What a quantity means; of dry friction what it holds at rest, where that is more than it slips at."""
    if not isinstance(quantity, Friction) or quantity.ratio == 1:
        return quantity.meaning
    return f"{quantity.meaning}; where nothing slides, up to {quantity.limit * quantity.ratio}"


def _text(symbol: Any) -> str | None:
    return None if symbol is None else str(symbol)


def _parameters(equations: Equations) -> tuple[ParameterEntry, ...]:
    sets = equations.system.parameter_sets
    return tuple(
        ParameterEntry(
            symbol=str(p.symbol),
            unit=p.unit,
            meaning=p.meaning,
            default=float(p.default),
            values={name: float(values[p.symbol]) for name, values in sets.items() if p.symbol in values},
        )
        for p in equations.system.parameters
    )


def _inputs(equations: Equations) -> tuple[Entry, ...]:
    """Inputs, with their rates where an equation or a quantity holds them."""
    held = (equations.dissipation, *equations.forces, *equations.outputs, *equations.definitions.expressions.values())
    used = set().union(*(expression.free_symbols for expression in held))
    pairs = zip(equations.system.inputs, equations.rates, strict=True)
    return tuple(Entry(str(u.symbol), u.unit, u.meaning, str(r) if r in used else None) for u, r in pairs)
