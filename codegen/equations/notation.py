"""A model and its derived equations written down as a document, before any script or layout."""

from functools import partial
from typing import Any

from qddot.codegen.constrained import in_order
from qddot.codegen.convert import convert
from qddot.codegen.convert import symbol as convert_symbol
from qddot.codegen.equations.document import Document, Occurrence
from qddot.codegen.equations.entries import Entry, ParameterEntry, ranged
from qddot.codegen.equations.legible import legible
from qddot.codegen.equations.motion import Motion
from qddot.codegen.equations.order import Order
from qddot.codegen.equations.phrases import Factor, Formula, Indexed, Name, Sum, alone
from qddot.codegen.equations.reading import Reader
from qddot.codegen.equations.repeating import Repeating
from qddot.codegen.equations.spelling import alike
from qddot.codegen.lagrange import Equations
from qddot.model.contents import declared
from qddot.model.definitions import as_expression
from qddot.model.events import Impact
from qddot.model.friction import Friction
from qddot.model.system import ModelError, Quantity


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
    order = Order(equations)
    repeating = Repeating(order) if most is not None else None
    reader = Reader(order, turn=False, conditions=equations.conditions, repeating=repeating)
    written = _Author(equations, reader, order)
    coordinates = tuple(Entry(str(c.symbol), c.unit, c.meaning, str(c.rate)) for c in system.coordinates)
    states = tuple(Entry(str(z.symbol), z.unit, z.meaning, str(z.rate)) for z in system.states)
    motion = Motion(equations, coordinates, order, repeating, reader, most)
    in_lines = partial(ranged, index=repeating.index if repeating else None)
    return Document(
        name=system.name,
        title=system.title,
        source=source,
        coordinates=in_lines(coordinates),
        states=in_lines(states),
        parameters=_parameters(equations),
        parameter_sets=tuple(system.parameter_sets),
        inputs=in_lines(_inputs(equations)),
        quantities=tuple(Entry(str(q.symbol), q.unit, _told(q), _text(q.rate)) for q in system.quantities),
        tables=tuple(Entry(table.name, table.unit, table.description) for table in system.tables),
        outputs=tuple(Entry(str(o.symbol), o.unit, o.meaning) for o in system.output_expressions),
        definitions=written.definitions(),
        energies=written.energies(),
        forces=written.forces(),
        multipliers=tuple(Entry(str(c.symbol), c.unit, c.meaning) for c in in_order(system)),
        constraints=written.constraints(),
        events=written.events(),
        subjects=tuple(entry for entry, _ in motion.found),
        motion=tuple(formula for _, formula in motion.found),
        left_out=motion.left_out,
        state_subjects=states,
        state_motion=tuple(map(written.definition, equations.state_rates)),
        mass=motion.mass(),
        output_definitions=written.outputs(),
        is_generalized=bool(equations.definitions.base_symbols(equations.potential) & set(equations.velocities)),
        dotted=dotted,
    )


def with_dots(equations: Equations) -> frozenset[str]:
    """The words that may carry dots: names of what moves."""
    return frozenset(map(str, (*equations.coordinates, *equations.states, *equations.inputs)))


class _Author:
    """Formulas that are kept as the author wrote them."""

    def __init__(self, equations: Equations, reader: Reader, order: Order) -> None:
        self._equations, self._reader = equations, reader
        self._legible = partial(legible, fixed=order.fixed)

    def given(self, left: Factor, expression: Any) -> Formula:
        return Formula(alone(left), self._reader.sum(expression))

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
            Formula(alone(Name(name)), self._reader.sum(energy, positive_first=False, legible=self._legible))
            for name, energy in named
        )

    def forces(self) -> tuple[Formula, ...]:
        pairs = zip(self._equations.coordinates, self._equations.applied, strict=True)
        return tuple(self.given(Indexed("Q", (_index(str(q)),)), force) for q, force in pairs if force != 0)

    def constraints(self) -> tuple[Formula, ...]:
        """What the author says of positions and velocities, and that it vanishes."""
        given = (convert(each.expression) for each in in_order(self._equations.system))
        return tuple(Formula(self._reader.sum(expression), Sum(())) for expression in given)

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
            where = Formula(self._reader.sum(convert(as_expression(event.function))), Sum(()))
            found.append(Occurrence(heading, (where, *values)))
        return tuple(found)

    def outputs(self) -> tuple[Formula, ...]:
        """Definitions of the outputs that are not quantities under their own names."""
        found = zip(self._equations.system.output_expressions, self._equations.outputs, strict=True)
        return tuple(self.given(Name(str(o.symbol)), e) for o, e in found if str(o.symbol) != str(e))


def _index(coordinate: str) -> str | int:
    """What Q of a coordinate is indexed by: 6 for q_6, else the coordinate itself."""
    letter, _, index = coordinate.partition("_")
    return int(index) if letter == "q" and index.isdigit() else coordinate


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
