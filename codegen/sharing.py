"""Common subexpressions: what occurs twice is computed once, parts of sums and products included."""

from collections import Counter
from collections.abc import Iterator
from typing import Any

import symengine as se

from codegen.kernel import Assignment, Kernel
from codegen.rewrite import Names, is_condition, is_number, is_square, rebuild, split_number

#: Parts of a sum (term -> number) or of a product (factor -> 1).
Parts = dict[Any, Any]


def share(kernel: Kernel, names: Names) -> Kernel:
    """Give every repeated subexpression a temporary right before its first use."""
    sharing = _Sharing(names)
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
    it. uses: how often each node is referred to. symbols: the temporaries given so far.
    """

    def __init__(self, names: Names) -> None:
        self.names = names
        self.parts: dict[Any, Parts] = {}
        self.common: dict[Any, tuple[type, Parts]] = {}
        self.uses: Counter[Any] = Counter()
        self.symbols: dict[Any, Any] = {}
        self._split: dict[Any, tuple[Any, Any]] = {}

    def split(self, term: Any) -> tuple[Any, Any]:
        """`split_number`, remembered."""
        if term not in self._split:
            self._split[term] = split_number(term)
        return self._split[term]

    def survey(self, expression: Any) -> None:
        """Note the parts of every sum and product, each once."""
        _, node = self.split(expression)
        if not node.args or node in self.parts:
            return
        if isinstance(node, se.Add):
            self.parts[node] = {rest: number for number, rest in map(self.split, node.args)}
        elif isinstance(node, se.Mul):
            self.parts[node] = dict.fromkeys(node.args, se.Integer(1))
        else:
            self.parts[node] = {}
        for child in self.children(node):
            self.survey(child)

    def children(self, node: Any) -> Iterator[Any]:
        """What a node is made of; numbers in front stripped."""
        if node in self.common:
            yield from self.common[node][1]
        elif self.parts.get(node):
            yield from self.parts[node]
        else:
            yield from (self.split(part)[1] for part in node.args)
            if is_square(node):
                yield node.args[0]

    def match(self, kind: type) -> None:
        """Name what two or more sums (or products) have in common; sums may have it with opposite signs."""
        nodes = [node for node in self.parts if isinstance(node, kind)]
        holders: dict[Any, list[int]] = {}
        for i, node in enumerate(nodes):
            for part in self.parts[node]:
                holders.setdefault(part, []).append(i)
        for i, node in enumerate(nodes):
            meetings = Counter(j for part in self.parts[node] for j in holders.get(part, ()) if j > i)
            for j, count in sorted(meetings.items(), key=lambda item: (-item[1], item[0])):
                if count > 1:
                    self._join(kind, node, nodes[j])

    def _join(self, kind: type, left: Any, right: Any) -> None:
        mine, theirs = self.parts[left], self.parts[right]
        same = [part for part in mine if part in theirs and theirs[part] == mine[part]]
        opposite = [part for part in mine if part in theirs and theirs[part] == -mine[part]]
        sign, shared = (1, same) if len(same) >= len(opposite) or kind is se.Mul else (-1, opposite)
        if len(shared) < 2:
            return
        if len(shared) == len(mine) and left not in self.common:
            symbol = left  # all of the left one: the node itself is what is shared
            mood = 1
        else:
            symbol = se.Dummy()
            mood = -1 if sum(float(mine[part]) < 0 for part in shared) * 2 > len(shared) else 1
            self.common[symbol] = (kind, {part: mood * mine[part] for part in shared})
            self.parts[left] = {part: n for part, n in mine.items() if part not in shared} | {symbol: se.Integer(mood)}
        rest = {part: n for part, n in theirs.items() if part not in shared}
        self.parts[right] = rest | {symbol: se.Integer(sign * mood)}

    def count(self, expressions: tuple[Any, ...]) -> None:
        """Count how often each node is referred to."""
        stack = [self.split(expression)[1] for expression in reversed(expressions)]
        seen: set[Any] = set()
        while stack:
            node = stack.pop()
            self.uses[node] += 1
            if node not in seen and (node.args or node in self.common):
                seen.add(node)
                stack.extend(self.children(node))

    def emit(self, expression: Any, out: list[Assignment], wish: Any = None) -> Any:
        """An expression in terms of temporaries; those not yet assigned are appended to `out`."""
        number, node = self.split(expression)
        if node in self.symbols:
            return number * self.symbols[node]
        if not node.args and node not in self.common:
            return expression
        value = self._build(node, out)
        if wish is not None and number == 1:
            self.symbols[node] = wish  # the temporary that is being assigned serves as the name
            return value
        if self.uses[node] < 2 or not value.args or is_condition(value):
            return number * value
        self.symbols[node] = self.names.fresh(_wish(value))
        out.append((self.symbols[node], value))
        return number * self.symbols[node]

    def _build(self, node: Any, out: list[Assignment]) -> Any:
        kind, parts = self.common.get(node) or (type(node), self.parts.get(node))
        if parts:
            terms = [number * self.emit(part, out) for part, number in parts.items()]
            return se.Mul(*terms) if issubclass(kind, se.Mul) else se.Add(*terms)
        return rebuild(node, [part if is_number(part) else self.emit(part, out) for part in node.args])


def _wish(value: Any) -> str:
    """A telling name for a temporary where there is one: sin_theta, qdot_squared, inverse_m."""
    inner = value.args[0] if value.args else None
    if inner is not None and inner.is_Symbol:
        if isinstance(value, se.Pow):
            power = {2: "squared", 3: "cubed"}.get(value.args[1])
            if power:
                return f"{inner}_{power}"
            if value.args[1] == -1:
                return f"inverse_{inner}"
        elif len(value.args) == 1:
            return f"{type(value).__name__}_{inner}"
    return "tmp_"
