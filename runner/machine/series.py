"""The emitter: machine code for the Taylor coefficients of a model's states, from its packed table of nodes.

The code loops over the orders, and within one over the orders below: one compilation serves all tolerances. The sums
over lower orders, which are all of the cost, take their factors from histories that lie side by side as vectors.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from qddot.runner.machine.packing import Group, Packing, arity
from qddot.runner.machine.recurrences import FUNCTIONS, Factor, Node
from qddot.runner.machine.series_integrals import Integrals, is_integral
from qddot.runner.machine.series_linear import linear
from qddot.runner.machine.series_memory import HIGHEST, NOW, SENSE, Memory
from qddot.runner.machine.series_solve import eliminate, solution
from qddot.runner.machine.vector_code import INTEGER, SCALAR, VectorCode

#: For each rule the sums over lower orders, as columns of its arguments: A, B, how A is taken (see `_Operand`), and
#: whether A_0 B_k belongs to it; OWN: the node itself.
OWN = -1
SUMS = {
    "product": ((0, 1, "", True),),
    "lagging": ((0, 1, "", False),),
    "rate": ((0, 1, "next", True),),
    "quotient": ((1, OWN, "", False),),
    "power": ((0, OWN, "counted", False), (0, OWN, "", False)),
    **dict.fromkeys(FUNCTIONS, ((0, 1, "counted", False),)),
    "atan2": ((0, 2, "counted", False), (1, 3, "counted", False)),
}
Names = tuple[str | None, ...]


@dataclass(eq=False)
class _Operand:
    """Coefficients of nodes side by side, as sums over lower orders take them: their history in memory.

    how: "" as they are; "counted" k times the k-th; "next" that of order k + 1. current, first: those of this order, 0.
    ahead: whether "next" ones write this history, one order ahead, so that it is theirs too.
    """

    names: Names
    how: str
    place: int
    late: bool
    ahead: bool = False
    current: Any = None
    first: Any = None


@dataclass(eq=False)
class _Sum:
    """Sum of A_j B_{k-j}, without A_0 B_k where not `whole`. between: its part 0 < j < k."""

    left: _Operand
    right: _Operand
    whole: bool
    between: Any = None


class Emitter:
    """Writes the function series(memory, order) for a packing.

    at_once: the sums that a loop over lower orders holds in registers.
    """

    def __init__(self, packing: Packing, code: VectorCode, memory: Memory, at_once: int) -> None:
        self.packing, self.code, self.memory, self.at_once = packing, code, memory, at_once
        self.table = packing.table
        self.unknowns = self.table.unknowns
        self.current: dict[int, Any] = {}
        self._gathered: dict[Names, Any] = {}
        self._operands: dict[tuple[Names, str], _Operand] = {}
        self._sums: dict[int, list[_Sum]] = {}
        self._held: dict[int, Any] = {}
        self._turned: dict[Names, tuple[Any, Any]] = {}
        self._late = {node.name for group in packing.groups if group.late for node in group.nodes}
        self._inverse: Any = None
        self._k: Any = None
        self.step: Any = None
        self._integrals = Integrals(self)

    def emit(self) -> None:
        """Order 0, and the loop over the others."""
        code, order = self.code, self.code.builder.function.args[1]
        for group in self.packing.groups:
            if group.live:
                self._sums[group.index] = self._sums_of(group)
        self._share_histories()
        sense = code.load_scalar(SENSE * self.memory.row)
        self._begin(sense, None)
        self._order(first=True)
        with code.loop(INTEGER(1), order, self._integrals.carried()) as (k, held, after):
            self._begin(sense, k, held)
            self._order(first=False)
            after.extend(self._integrals.carried())
        code.builder.ret_void()

    def _begin(self, sense: Any, k: Any, held: Sequence[Any] = ()) -> None:
        """The numbers of an order: k, 1/k, sense/(k + 1) and sense*(k + 1). held: what is carried to it."""
        code, builder = self.code, self.code.builder
        self._k, self._sense = k, sense
        self._gathered = {}
        self._integrals.begin(k, held)
        for operand in self._operands.values():
            operand.current = None
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
            self._sum_between()
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
        for operand in self._operands.values():
            if operand.current is None or operand.late:
                operand.current = None
                self._fetch(operand, final=True)
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
        ends = [self._ends(each, first) for each in self._sums.get(group.index, ())]
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
        if kind in ("product", "lagging"):
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

    # sums over lower orders

    def _sums_of(self, group: Group) -> list[_Sum]:
        found = []
        for left, right, how, whole in SUMS.get(group.kind, ()):
            names = [[node.name if i == OWN else node.arguments[i] for node in group.nodes] for i in (left, right)]
            found.append(_Sum(self._operand(names[0], how), self._operand(names[1], ""), whole))
        return found

    def _operand(self, names: Sequence[str], how: str) -> _Operand:
        key = (tuple(names), how)
        if key not in self._operands:
            late = not self._late.isdisjoint(names) or not set(self.unknowns).isdisjoint(names)
            place = self.memory.take_history((HIGHEST + 2) * self.code.size)
            self._operands[key] = _Operand(key[0], how, place, late)
        return self._operands[key]

    def _share_histories(self) -> None:
        """Let those of the next order write to the history of the same nodes, where there is one."""
        for (names, how), operand in self._operands.items():
            plain = self._operands.get((names, ""))
            if how == "next" and plain:
                plain.ahead = True
                operand.place = plain.place + self.code.size

    def _sum_between(self) -> None:
        """The parts of all sums with 0 < j < k, several sums in a loop over j."""
        sums = [each for found in self._sums.values() for each in found]
        if self.code.width == 1:  # those with a factor in common in one loop, which reads it once
            places = {id(each.right): place for place, each in reversed(list(enumerate(sums)))}
            sums.sort(key=lambda each: places[id(each.right)])
        for start in range(0, len(sums), self.at_once):
            part = sums[start : start + self.at_once]
            with self.code.loop(INTEGER(1), self._k, [self.code.zero] * len(part)) as (j, totals, after):
                back = self.code.builder.sub(self._k, j)
                loaded: dict[tuple[int, int], Any] = {}
                for each, total in zip(part, totals, strict=True):
                    # What the processor waits for, unknowns of the order before, is what is added last.
                    of_left, of_right = (back, j) if each.right.late else (j, back)
                    for operand, index in ((each.left, of_left), (each.right, of_right)):
                        key = (operand.place, id(index))
                        if key not in loaded:
                            loaded[key] = self.code.load(operand.place, index)
                    left, right = loaded[each.left.place, id(of_left)], loaded[each.right.place, id(of_right)]
                    after.append(self.code.multiply_add(left, right, total))
            for each, value in zip(part, after, strict=True):
                each.between = value

    def _ends(self, each: _Sum, first: bool) -> Any:
        """A sum with its terms of order 0 and k."""
        left, right, code = each.left, each.right, self.code
        last = self._fetch(left)
        if first:
            return code.multiply(last, self._fetch(right)) if each.whole else None
        if left is right:
            return code.multiply_add(code.add(left.first, left.first), last, each.between)
        total = code.multiply_add(last, right.first, each.between)
        return code.multiply_add(left.first, self._fetch(right), total) if each.whole else total

    def _fetch(self, operand: _Operand, final: bool = False) -> Any:
        """An operand's coefficients of this order, kept in its history once they are complete."""
        if operand.current is None:
            value = self._integrals.next(operand.names) if operand.how == "next" else self.gather(operand.names)
            if operand.how == "counted":
                value = self.code.zero if self._k is None else self.code.multiply(value, self._count)
            operand.current = value
            if final or not operand.late:
                if self._k is None or not operand.ahead:
                    self.code.store(value, operand.place, self._k)
                if self._k is None:
                    operand.first = value
        return operand.current

    # vectors

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
