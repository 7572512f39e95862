"""Common subexpressions: what occurs twice is computed once, parts of sums and products included."""

from collections import defaultdict
from collections.abc import Mapping, Reversible
from itertools import chain
from operator import is_
from typing import Any

import symengine as se

from qddot.codegen.convert import function_name
from qddot.codegen.kernel import Assignment, Kernel
from qddot.codegen.nodes import operands
from qddot.codegen.rewrite import (
    MINUS_ONE,
    ONE,
    ZERO,
    Names,
    is_condition,
    is_number,
    is_one,
    is_signed_symbol,
    is_square,
    leading_number,
    opposite,
    rebuild,
    split_number,
)

#: Parts of a sum (term -> number) or of a product (factor -> 1).
Parts = dict[Any, Any]


def share(kernel: Kernel, names: Names, known: Mapping[Any, Any] | None = None) -> Kernel:
    """Give every repeated subexpression a temporary right before its first use.

    known: expression -> the symbol that has its value and is read where the expression is a part of a sum or product.
    """
    sharing = _Sharing(names)
    for expression, symbol in sorted((known or {}).items(), key=lambda item: -len(operands(item[0]))):
        sharing.give(expression, symbol)
    for expression in kernel.expressions:
        sharing.survey(expression)
    sharing.match(se.Mul)
    sharing.match(se.Add)
    sharing.count(kernel.expressions)
    temporaries: list[Assignment] = []
    for symbol, expression in kernel.temporaries:
        value = sharing.emit(expression, temporaries, wish=symbol)
        temporaries.append((symbol, value))
    writes = [(slot, sharing.emit(expression, temporaries)) for slot, expression in kernel.writes]
    return kernel.replace(temporaries, writes)


class _Sharing:
    """One pass over a kernel.

    parts: sums and products as what they are made of. common: what several of them share, by a symbol that stands for
    it. uses: how often each node is referred to. symbols: the temporaries given so far by node, values: by what they
    are assigned. given: products and sums that have a symbol beforehand. changed: those that common parts left.
    """

    def __init__(self, names: Names) -> None:
        self.names = names
        self.parts: dict[Any, Parts] = {}
        self.common: dict[Any, tuple[type, Parts]] = {}
        self.uses: defaultdict[Any, int] = defaultdict(int)
        self.symbols: dict[Any, Any] = {}
        self.values: dict[Any, Any] = {}
        self.given: dict[Any, Any] = {}
        self.changed: set[Any] = set()

    def survey(self, expression: Any) -> None:
        """Note the parts of every sum and product, each once."""
        waiting = [split_number(expression)[1]]
        while waiting:
            node = waiting.pop()
            if node in self.parts or not operands(node):
                continue
            if isinstance(node, se.Add):
                self.parts[node] = {rest: number for number, rest in map(split_number, operands(node))}
            else:
                self.parts[node] = dict.fromkeys(operands(node), ONE) if isinstance(node, se.Mul) else {}
            waiting += reversed(self.children(node))

    def give(self, expression: Any, symbol: Any) -> None:
        """Let a sum or product be known by a symbol."""
        self.values[expression] = symbol
        number, node = split_number(expression)
        if is_one(number) and isinstance(node, se.Add | se.Mul):
            self.survey(expression)
            self.symbols[node] = self.given[node] = symbol

    def children(self, node: Any) -> Reversible[Any]:
        """What a node is made of; numbers in front stripped."""
        if parts := self.common[node][1] if node in self.common else self.parts[node]:
            return parts
        found = [split_number(part)[1] for part in operands(node)]
        return [*found, operands(node)[0]] if is_square(node) else found

    def match(self, kind: type) -> None:
        """Name what two or more sums (or products) have in common; sums may have it with opposite signs."""
        nodes = [node for node in self.parts if isinstance(node, kind)]
        holders: dict[Any, dict[int, None]] = {}
        for i, node in enumerate(nodes):
            for part in self.parts[node]:
                holders.setdefault(part, {})[i] = None
        for i, node in enumerate(nodes):
            met = [others for others in map(holders.__getitem__, self.parts[node]) if len(others) > 1]
            for j in self._companions(i, met) if len(met) > 1 else ():
                self._join(kind, nodes, holders, i, j)

    @staticmethod
    def _companions(i: int, met: list[dict[int, None]]) -> list[int]:
        """Who behind i is met in two or more parts, most often first. met: who holds each part."""
        *few, many = sorted(met, key=len)  # who meets in two parts meets in one of the few
        if len(few) == 1:
            return sorted(j for j in few[0].keys() & many.keys() if j > i)
        meetings = dict[int, int]()
        for j in chain.from_iterable(few):
            meetings[j] = meetings.get(j, 0) + 1
        counts = ((count + (j in many), j) for j, count in meetings.items() if j > i)
        return [j for _, j in sorted((-count, j) for count, j in counts if count > 1)]

    def _join(self, kind: type, nodes: list[Any], holders: dict[Any, dict[int, None]], i: int, j: int) -> None:
        """Give what two nodes share a symbol, in all nodes from these on that hold it."""
        left, right = nodes[i], nodes[j]
        mine, theirs = self.parts[left], self.parts[right]
        same = [part for part in mine if part in theirs and theirs[part] == mine[part]]
        opposite = [part for part in mine if part in theirs and theirs[part] == -mine[part]]
        shared = same if len(same) >= len(opposite) or kind is se.Mul else opposite
        if len(shared) < 2 or right in self.given or (left in self.given and len(shared) < len(mine)):
            return
        whole = len(shared) == len(mine) and left not in self.common
        symbol = self.given.get(left, left) if whole else se.Dummy()  # all of the left one is what is shared
        mood = -1 if not whole and sum(mine[part].is_negative for part in shared) * 2 > len(shared) else 1
        found = {part: mood * mine[part] for part in shared}
        if not whole:
            self.common[symbol] = (kind, found)
        for k in sorted(set.intersection(*(set(holders[part]) for part in shared))):
            sign = self._sign(found, self.parts[nodes[k]]) if k >= i + whole and nodes[k] not in self.given else 0
            if sign and not (kind is se.Mul and symbol in self.parts[nodes[k]]):
                self._take(self.parts[nodes[k]], found, symbol, sign)
                self.changed.add(nodes[k])
                if symbol in self.parts[nodes[k]]:  # it may have cancelled
                    holders.setdefault(symbol, {})[k] = None
                else:
                    del holders[symbol][k]
                for part in shared:
                    del holders[part][k]

    @staticmethod
    def _take(parts: Parts, found: Parts, symbol: Any, sign: int) -> None:
        """Let a symbol stand for what was found in parts, which may hold it already: (x + y) - 2*(x + y)."""
        for part in found:
            del parts[part]
        parts[symbol] = parts.get(symbol, 0) + se.Integer(sign)
        if parts[symbol] == ZERO:
            del parts[symbol]

    @staticmethod
    def _sign(found: Parts, parts: Parts) -> int:
        """1 where the parts hold all that was found, -1 where they hold its opposite, 0 where neither."""
        for sign in (1, -1):
            if all(parts[part] == sign * number for part, number in found.items()):
                return sign
        return 0

    def count(self, expressions: tuple[Any, ...]) -> None:
        """Count how often each node is referred to."""
        references = [split_number(expression)[1] for expression in expressions]
        for node in references:
            self.uses[node] += 1
            if self.uses[node] == 1 and (node in self.parts or node in self.common):
                references.extend(self.children(node))

    def emit(self, expression: Any, out: list[Assignment], wish: Any = None) -> Any:
        """An expression in terms of temporaries; those not yet assigned are appended to `out`."""
        number, node = split_number(expression)
        return _times(number, self._emit(node, out, wish if is_one(number) else None))

    def _emit(self, node: Any, out: list[Assignment], wish: Any = None) -> Any:
        """The same of a node without a number in front. wish: what is about to be assigned, which serves as a name."""
        if node in self.symbols:
            return self.symbols[node]
        if node not in self.parts and node not in self.common:
            return node
        value = self._build(node, out)
        if value in self.values:
            return self.values[value]
        if wish is not None:
            self._name(node, value, wish)
            return value
        sign = ONE
        if isinstance(value, se.Add) and all(leading_number(term).is_negative for term in operands(value)):
            sign, value = MINUS_ONE, opposite(value)
        if self.uses[node] > 1 and not is_signed_symbol(value) and not is_condition(value):
            symbol = self.names.fresh(_wish(value))
            out.append((symbol, value))
            self._name(node, value, symbol)
            self.symbols[node], value = _times(sign, symbol), symbol
        return _times(sign, value)

    def _name(self, node: Any, value: Any, symbol: Any) -> None:
        self.symbols[node] = self.values[value] = symbol
        if isinstance(value, se.Add):
            self.values[opposite(value)] = -symbol

    def _build(self, node: Any, out: list[Assignment]) -> Any:
        kind, parts = self.common.get(node) or (type(node), self.parts.get(node))
        if parts:
            values = [self._emit(part, out) for part in parts]
            if node not in self.common and node not in self.changed and all(map(is_, values, parts)):
                return node
            terms = list(map(_times, parts.values(), values))
            return se.Mul(*terms) if issubclass(kind, se.Mul) else se.Add(*terms)
        return rebuild(node, [part if is_number(part) else self.emit(part, out) for part in operands(node)])


def _times(number: Any, value: Any) -> Any:
    """A product, for which SymEngine need not be asked where the number is one."""
    return value if is_one(number) else number * value


def _wish(value: Any) -> str:
    """A telling name for a temporary where there is one: sin_theta, qdot_squared, inverse_m."""
    inner = operands(value)[0] if operands(value) else None
    if inner is not None and inner.is_Symbol:
        if isinstance(value, se.Pow):
            power = {2: "squared", 3: "cubed"}.get(operands(value)[1])
            if power:
                return f"{inner}_{power}"
            if operands(value)[1] == MINUS_ONE:
                return f"inverse_{inner}"
        elif isinstance(value, se.FunctionSymbol):
            return f"{function_name(value)}_{inner}"
        elif len(operands(value)) == 1:
            return f"{type(value).__name__}_{inner}"
    return "tmp_"
