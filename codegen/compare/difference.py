"""Comparing each equation of a sheet with the one derived: equal, equal up to a factor, or what must change."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import symengine as se

from qddot.codegen.calculus import terms
from qddot.codegen.canonical import AlgebraError, canonical
from qddot.codegen.compare.edits import Change, explain
from qddot.codegen.compare.sheet import Sheet, Written
from qddot.codegen.compare.tree import Addend, CompareError, addends, symbols
from qddot.codegen.compare.values import Reading
from qddot.codegen.compare.zero import vanishes
from qddot.codegen.convert import free
from qddot.codegen.equations.legible import legible
from qddot.codegen.equations.order import Order
from qddot.codegen.identities import Polynomial, total
from qddot.codegen.lagrange import Equations
from qddot.codegen.rewrite import replaced, rewrite
from qddot.codegen.symbols import named
from qddot.model.table import Table, ending

#: Whether two expressions are equal.
_Same = Callable[[Any, Any], bool]


@dataclass(frozen=True)
class Comparison:
    """One equation: what changes make it the derived one.

    derived_terms: of the derived equation as left - right, in the model's quantities; the first n_left stand on the
    left. factor: what the derived equation is to be multiplied by to give the printed one, 1 in most cases.
    changes: none where both are equal; those of kind missing point at a derived term. printed, derived: left - right,
    SymEngine expressions in which the quantities that the file uses stay symbols; the changes' expressions add up to
    printed - factor*derived.
    """

    written: Written
    coordinate: int
    derived_terms: tuple[Any, ...]
    n_left: int
    factor: Any
    changes: tuple[Change, ...]
    printed: Any
    derived: Any

    @property
    def equal(self) -> bool:
        """Whether nothing is to be changed."""
        return not self.changes


def compare(sheet: Sheet, equations: Equations) -> tuple[Comparison, ...]:
    """Compare every equation of a sheet with the model's; CompareError for names that the model does not have."""
    coordinates = [str(q) for q in (*equations.coordinates, *equations.states)]
    tables = {f"{table.name}{ending(orders)}": (table.name, orders) for table, orders in _looked_up(equations)}
    sheet = sheet.checked(_known(equations), coordinates, tables)
    judge = _Judge(sheet, equations)
    return tuple(judge.comparison(written, coordinates.index(written.coordinate)) for written in sheet.equations)


def _looked_up(equations: Equations) -> Iterator[tuple[Table, tuple[int, ...]]]:
    for table in equations.system.tables:
        yield from ((table, orders) for orders in table.all_orders)


def _known(equations: Equations) -> list[str]:
    moving = (*equations.state, *equations.accelerations)
    given = (*equations.parameters, *equations.inputs, *equations.rates, equations.time)
    moving += equations.constraints.multipliers
    return [str(symbol) for symbol in (*moving, *given, *equations.definitions.expressions)]


class _Judge:
    def __init__(self, sheet: Sheet, equations: Equations) -> None:
        self._sheet, self._equations = sheet, equations
        self._fixed = Order(equations).fixed
        usual = {p.symbol.name: float(p.default) for p in equations.system.parameters}
        self._same: _Same = partial(_equal, {s: usual[str(s)] for s in equations.parameters})
        used = {symbol.name for written in sheet.equations for symbol in _symbols_of(written)}
        used |= {symbol.name for meaning in sheet.meanings.values() for symbol in symbols(meaning)}
        self._kept = {s for s in equations.definitions.expressions if str(s) in used}
        self._readings = {highest: self._read(highest) for highest in (None, *equations.state_rates)}

    def comparison(self, written: Written, k: int) -> Comparison:
        """The comparison of one equation, by the reading that needs the fewest changes."""
        found: list[Comparison] = []
        for reading, kept in self._readings[self._rate(k)]:
            found.append(self._by_reading(written, k, reading, kept))
            if found[-1].equal:
                return found[-1]
        return min(found, key=lambda each: len(each.changes))

    def _by_reading(self, written: Written, k: int, reading: Reading, definitions: Mapping[Any, Any]) -> Comparison:
        printed_terms = _one_side(written)
        left, right = self._derived(k)
        case = (written, k, (*left, *right), len(left))
        derived_terms = [_replaced(term, definitions) for term in (*left, *right)]
        try:
            printed = se.Add(*(reading.addend(term) for term in printed_terms))
            derived = se.Add(*derived_terms)
            rate = self._rate(k)
            highest = self._equations.accelerations if rate is None else (rate,)
            factor = _factor(printed, derived, highest, self._same)
            if self._same(printed, factor * derived):
                return Comparison(*case, factor, (), printed, derived)
            wanted = [factor * term for term in derived_terms]
            changes = explain(printed_terms, wanted, reading, self._roles())
        except (CompareError, AlgebraError) as error:
            raise self._sheet.error(written.at, str(error)) from None
        return Comparison(*case, factor, tuple(changes), printed, derived)

    def _rate(self, k: int) -> Any:
        """The rate that equation k is solved for where it is a state's, or None."""
        n = len(self._equations.coordinates)
        return None if k < n else self._equations.state_rates[k - n]

    def _derived(self, k: int) -> tuple[list[Any], list[Any]]:
        """The terms of M qddot + gyroscopic + dPi/dq + dPhi/dqdot for coordinate k, and those of -Q; of zdot = ..."""
        equations, rate = self._equations, self._rate(k)
        if rate is not None:
            definition = self._as_written(equations.definitions.expressions[rate])
            return [rate], [-term for term in terms(definition) if term != 0]
        inertia = [
            self._as_written(equations.mass[max(k, j), min(k, j)]) * acceleration
            for j, acceleration in enumerate(equations.accelerations)
            if (max(k, j), min(k, j)) in equations.mass
        ]
        own = (equations.gyroscopic[k], equations.conservative[k], equations.dissipative[k])
        others = (*own, *equations.constraints.pull(k))
        found = [term for part in map(self._as_written, others) for term in terms(legible(part, self._fixed))]
        applied = [-term for term in terms(self._as_written(equations.applied[k]))]
        return [term for term in (*inertia, *found) if term != 0], [term for term in applied if term != 0]

    def _as_written(self, expression: Any) -> Any:
        """The expression with its conditions and tables as the author wrote them, without their modes."""
        written = self._equations.modes.written
        plain = replaced(expression, written) if written else expression
        return rewrite(plain, lambda node: free(node) if isinstance(node, se.FunctionSymbol) else node, {})

    def _read(self, rate: Any) -> list[tuple[Reading, Mapping[Any, Any]]]:
        """From the reading nearest to the author's, quantities of his kept, to all written out but this rate."""
        least = set() if rate is None else {rate}
        kept = self._kept | least
        return [self._reading(keep) for keep in ([kept] if kept != least else []) + [least]]

    def _reading(self, kept: set[Any]) -> tuple[Reading, Mapping[Any, Any]]:
        """How names are to be read where some quantities stay symbols: the author's names; the model's quantities."""
        definitions: dict[Any, Any] = {}
        for symbol, expression in self._equations.definitions.expressions.items():
            if symbol not in kept:
                definitions[symbol] = _replaced(self._as_written(expression), definitions)
        meanings = {str(s): e for s, e in definitions.items()} | {"pi": se.pi}
        own = {name: named(f"{name} of the file") for name in self._sheet.own if named(name) in self._names()}
        reading = Reading({**meanings, **own})
        for name, node in self._sheet.meanings.items():
            reading = Reading({**reading.meanings, name: reading.value(node)})
        return reading, definitions

    def _names(self) -> set[Any]:
        return {named(name) for name in _known(self._equations)}

    def _roles(self) -> list[list[str]]:
        equations = self._equations
        held = equations.constraints.multipliers
        moving = (equations.coordinates, equations.velocities, (*equations.accelerations, *held))
        quantities = tuple(equations.definitions.expressions)
        others = (equations.states, equations.parameters, equations.inputs, equations.rates, quantities)
        own = self._sheet.own
        return [[str(symbol) for symbol in group if str(symbol) not in own] for group in (*moving, *others)]


def _one_side(written: Written) -> list[Addend]:
    """The terms of left - right."""
    right = [Addend(not term.negative, term.node, term.at) for term in addends(written.right)]
    return [*addends(written.left), *right]


def _symbols_of(written: Written) -> list[Any]:
    return [*symbols(written.left), *symbols(written.right)]


def _replaced(expression: Any, values: Mapping[Any, Any]) -> Any:
    held = expression.free_symbols & values.keys()
    return expression.subs({symbol: values[symbol] for symbol in held}) if held else expression


def _equal(typical: Mapping[Any, float], one: Any, other: Any) -> bool:
    difference = canonical(one - other)
    return not difference or vanishes(total(difference), typical)


def _factor(printed: Any, derived: Any, accelerations: Sequence[Any], same: _Same) -> Any:
    """What the printed equation is multiplied by as a whole: 1 unless something else explains more than half."""
    one = se.Integer(1)
    if same(printed, derived):
        return one
    mine, theirs = canonical(printed), canonical(derived)
    wrong = _disagreeing(mine, theirs)
    counted = {ratio: _disagreeing(mine, canonical(ratio * derived)) for ratio in _ratios(mine, theirs, accelerations)}
    best = min(counted, key=lambda ratio: (counted[ratio], str(ratio)), default=one)
    if best in counted and counted[best] < 0.5 * wrong:
        return best
    for acceleration in accelerations:
        above, below = printed.diff(acceleration), derived.diff(acceleration)
        if above != 0 and below != 0 and same(printed * below, derived * above):
            return above / below
    return one


def _ratios(mine: Polynomial, theirs: Polynomial, accelerations: Sequence[Any]) -> set[Any]:
    """The ratios of the two equations' coefficients, product by product and acceleration by acceleration."""
    found = {mine[product] / theirs[product] for product in mine.keys() & theirs.keys()}
    for acceleration in ((acceleration, se.Integer(1)) for acceleration in accelerations):
        ours, yours = ({p: n for p, n in terms.items() if acceleration in p} for terms in (mine, theirs))
        found |= {total({p: n}) / total({r: m}) for p, n in ours.items() for r, m in yours.items()}
    return {ratio for ratio in found if ratio != 1}


def _disagreeing(mine: Polynomial, theirs: Polynomial) -> int:
    return sum(mine.get(product, 0) != theirs.get(product, 0) for product in mine.keys() | theirs.keys())
