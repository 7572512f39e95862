"""The emitter: machine code for the Taylor coefficients of a model's states, from its packed table of nodes.

The code loops over the orders, and within one over the orders below: one compilation serves all tolerances. The sums
over lower orders, which are all of the cost, take their factors from histories that lie side by side as vectors.
"""

from collections.abc import Sequence
from typing import Any

from qddot.runner.machine.packing import Group, Packing, arity
from qddot.runner.machine.recurrences import Factor, Node
from qddot.runner.machine.series_histories import Names
from qddot.runner.machine.series_integrals import Integrals, is_integral
from qddot.runner.machine.series_linear import linear
from qddot.runner.machine.series_memory import NOW, SENSE, Memory
from qddot.runner.machine.series_solve import eliminate, solution
from qddot.runner.machine.series_sums import Sums
from qddot.runner.machine.vector_code import INTEGER, SCALAR, VectorCode


class Emitter:
    """Writes the function series(memory, order) for a packing.

    sums: doubles of a vector of sums; at_once, few: see `Sums`.
    """

    def __init__(self, packing: Packing, code: VectorCode, memory: Memory, sums: int, at_once: int, few: int) -> None:
        self.packing, self.code, self.memory = packing, code, memory
        self.table = packing.table
        self.unknowns = self.table.unknowns
        self.current: dict[int, Any] = {}
        self._gathered: dict[Names, Any] = {}
        self._held: dict[int, Any] = {}
        self._turned: dict[Names, tuple[Any, Any]] = {}
        self.late = {node.name for group in packing.groups if group.late for node in group.nodes} | {*self.unknowns}
        self._inverse: Any = None
        self._k: Any = None
        self.step: Any = None
        self._integrals = Integrals(self)
        self._sums = Sums(self, sums, at_once, few)

    def emit(self) -> None:
        """Order 0, and the loop over the others."""
        code, order = self.code, self.code.builder.function.args[1]
        sense = code.load_scalar(SENSE * self.memory.row)
        self._begin(sense, None)
        self._order(first=True)
        with code.loop(INTEGER(1), order, self._carried()) as (k, held, after):
            self._begin(sense, k, held)
            self._order(first=False)
            after.extend(self._carried())
        code.builder.ret_void()

    def _carried(self) -> list[Any]:
        """What goes on to the next order in registers."""
        return [*self._integrals.carried(), *self._sums.carried()]

    def _begin(self, sense: Any, k: Any, held: Sequence[Any] = ()) -> None:
        """The numbers of an order: k, 1/k, sense/(k + 1) and sense*(k + 1). held: what is carried to it."""
        code, builder = self.code, self.code.builder
        self._k, self._sense = k, sense
        self._gathered = {}
        integrals = len(held) - self._sums.waiting
        self._integrals.begin(k, held[:integrals])
        self._sums.begin(k, held[integrals:])
        if k is None:
            self.step, self._grown = code.splat(sense), code.splat(sense)
            return
        whole = builder.sitofp(k, SCALAR)
        self._count, self._part = code.splat(whole), code.splat(builder.fdiv(SCALAR(1.0), whole))
        more = builder.fadd(whole, SCALAR(1.0))
        self.step = code.splat(builder.fdiv(sense, more))
        self._grown = code.splat(builder.fmul(sense, more))

    def _order(self, first: bool) -> None:
        """All nodes of an order, the unknowns and what holds them last."""
        if not first:
            self._sums.add_between()
        known = set[int]()
        for group in self.packing.first if first else self.packing.later:
            if first or not is_integral(group):
                self.current[group.index] = self._value(group, first)
            if not (group.late or group.kind == "unknown"):
                known.add(group.index)
            self._integrals.follow(known)
        if self.unknowns:
            if first:
                self._inverse = eliminate(self)
            solved = solution(self, self._inverse)
            self.current |= {group.index: x for group, x in zip(self.packing.kind("unknown"), solved, strict=True)}
            self._gathered = {}
            self._complete(first)
        self._integrals.follow()
        self._sums.finish()
        self._store_compared()

    def _complete(self, first: bool) -> None:
        """Add what the unknowns of this order are worth to the nodes that hold them."""
        for group in self.packing.first if first else self.packing.later:
            if group.late and group.kind == "rate":
                accelerations = self.gather([node.arguments[2] for node in group.nodes])
                value = self.code.multiply_add(self._held[group.index], accelerations, self.current[group.index])
                self.current[group.index] = value
            elif group.late and group.kind == "linear":
                self.current[group.index] = linear(self, group.nodes, first)

    def _store_compared(self) -> None:
        memory = self.memory
        for number, group in enumerate(self.packing.kind("side")):
            compared = self.gather([node.arguments[0] for node in group.nodes])
            place = memory.compared + number * self.code.width * memory.row
            self.code.store(compared, place, self._k, memory.side_stride)

    # values of groups

    def _value(self, group: Group, first: bool) -> Any:
        if group.kind in ("state", "input", "side", "unknown", "one", "time"):
            return self._given(group, first)
        if group.kind in ("linear", "where"):
            return linear(self, group.nodes, first) if group.kind == "linear" else self._where(group, first)
        value = self._first_value(group) if first else None
        ends = self._sums.ends(group, first)
        if group.kind == "rate":
            return self.code.multiply(ends[0], self._grown)
        return value if first else self._later_value(group, ends)

    def _given(self, group: Group, first: bool) -> Any:
        """What stands in memory, or is 0 until the unknowns are known, or is time."""
        code, kind = self.code, group.kind
        if first and kind == "one":
            return code.constant([1.0])
        if first and kind == "time":
            return code.load_number(NOW * self.memory.row)
        if kind == "time":
            at_one = code.builder.icmp_signed("==", self._k, INTEGER(1))
            return code.splat(code.builder.select(at_one, self._sense, SCALAR(0.0)))
        if kind == "input" or (first and kind in ("state", "side")):
            place, stride = self.memory.place_of(self.packing, group)
            return code.load(place, self._k, stride)
        return code.zero

    def _later_value(self, group: Group, ends: list[Any]) -> Any:
        """The coefficient of order k > 0 of what has a sum over lower orders."""
        code, kind, nodes = self.code, group.kind, group.nodes
        if kind in ("product", "square", "lagging"):
            return ends[0]
        if kind == "quotient":
            above = self.gather([node.arguments[0] for node in nodes])
            return code.divide(code.subtract(above, ends[0]), self._held[group.index])
        if kind == "power":
            counted = code.multiply(ends[0], self._part)
            raised = self.scaled(counted, [node.factors[0] for node in nodes], code.subtract(counted, ends[1]))
            return code.divide(raised, self._held[group.index])
        parts = [self.scaled(end, [node.factors[i] for node in nodes]) for i, end in enumerate(ends)]
        return code.multiply(code.sum(parts), self._part)

    def _first_value(self, group: Group) -> Any:
        """The value of order 0, by the rule or that of an integral's start."""
        code = self.code
        nodes = [node.start or node for node in group.nodes]
        rule = nodes[0].rule
        columns = _columns(nodes)[: arity(rule)]
        x, *others = [self.gather(names) for names in columns]
        if rule == "rate":
            self._held[group.index] = x
        if rule == "product":
            return code.multiply(x, others[0])
        if rule in ("lagging", "rate"):
            return code.zero
        if rule == "quotient":
            self._held[group.index] = others[0]
            return code.divide(x, others[0])
        if rule == "power":
            self._held[group.index] = x
            return self._raised(x, [node.factors[0] for node in nodes])
        if rule in ("sin", "cos"):
            names = tuple(columns[0])
            if names not in self._turned:
                self._turned[names] = code.sine_and_cosine(x)
            return self._turned[names][rule == "cos"]
        return code.each(rule, x, others[0]) if rule == "atan2" else code.each(rule, x)

    def _raised(self, x: Any, factors: list[Factor]) -> Any:
        if all(factor == Factor(0.5) for factor in factors):
            return self.code.intrinsic("sqrt", x)
        if all(factor == Factor(-0.5) for factor in factors):
            return self.code.divide(self.code.splat(1.0), self.code.intrinsic("sqrt", x))
        return self.code.each("pow", x, self.row(factors))

    def _where(self, group: Group, first: bool) -> Any:
        if first:
            side = self.gather([node.arguments[0] for node in group.nodes])
            self._held[group.index] = self.code.builder.fcmp_ordered(">", side, self.code.splat(0.5))
        yes, no = (self.gather([node.arguments[i] for node in group.nodes]) for i in (1, 2))
        return self.code.builder.select(self._held[group.index], yes, no)

    # vectors

    def next(self, names: Sequence[str | None]) -> Any:
        """The next coefficients of integrals."""
        return self._integrals.next(names)

    def counted(self, values: Any) -> Any:
        """The number of the order times values."""
        return self.code.zero if self._k is None else self.code.multiply(values, self._count)

    def gather(self, names: Sequence[str | None]) -> Any:
        """The nodes' coefficients side by side; 0 for None."""
        key = tuple(names)
        if key not in self._gathered:
            self._gathered[key] = self._shuffled(key)
        return self._gathered[key]

    def _shuffled(self, names: Names) -> Any:
        width, code = self.code.width, self.code
        homes = [self.packing.home[name] if name else None for name in names]
        found = None
        for source in dict.fromkeys(home[0] for home in homes if home):
            value = self._integrals.read(source)
            if found is None:
                places = [home[1] if home and home[0] == source else width for home in homes]
                plain = all(place == i for i, place in enumerate(places))
                found = value if plain else code.shuffle(value, code.zero, places + [width] * (width - len(places)))
            else:
                places = [width + home[1] if home and home[0] == source else i for i, home in enumerate(homes)]
                found = code.shuffle(found, value, places + list(range(len(places), width)))
        return code.zero if found is None else found

    def row(self, factors: Sequence[Factor | None]) -> Any:
        """A vector of factors, read from memory where constants of the model are among them."""
        if any(factor.constants for factor in factors if factor):
            return self.code.load(self.memory.factor_row(factors, self.code.width))
        return self.code.constant([factor.number if factor else 0.0 for factor in factors])

    def scaled(self, values: Any, factors: Sequence[Factor | None], total: Any = None) -> Any:
        """Factors times values, plus a total; where there is no factor, the value must be 0."""
        plain = {factor for factor in factors if factor}
        if plain == {Factor(1.0)}:
            return values if total is None else self.code.add(total, values)
        if plain == {Factor(-1.0)}:
            return self.code.builder.fneg(values) if total is None else self.code.subtract(total, values)
        return self.code.multiply_add(values, self.row(factors), total)


def _columns(nodes: Sequence[Node]) -> list[list[str]]:
    """First arguments of all nodes, second ones, ..."""
    return [list(column) for column in zip(*(node.arguments for node in nodes), strict=True)]
