"""The table RECURRENCE of a generated module, read and checked: nodes from which Taylor coefficients follow.

A row is `name rule operands`, on more lines where these are indented; one with ranges is many, see `ranges`.
docs/taylor.md says what each rule means.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from qddot.runner.ranges import expanded

#: Functions of one argument, by their names in `math`; atan2 takes two.
FUNCTIONS = (
    *("sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh", "asinh", "acosh", "atanh"),
    *("exp", "log", "erf"),
)
#: Rule -> what its operands are: f a factor, n a node, * any number of what stands before it.
_OPERANDS = {
    **{"product": "nn", "quotient": "nn", "lagging": "nn", "power": "nf", "rate": "nnn", "side": "n", "where": "nnn"},
    **dict.fromkeys(FUNCTIONS, "nfn"),
    "atan2": "nnfnfn",
}
#: Nodes that every table has: the constant one, and time.
ONE, TIME = "1", "t"
#: Rules of unknowns: accelerations, and the multipliers of constraints.
SOLVED, HELD = "solved", "held"


class RecurrenceError(ValueError):
    """A table that is not as it should be; names the row."""


@dataclass(frozen=True)
class Factor:
    """A number times constants of the model, by their places in CONSTANT."""

    number: float
    constants: tuple[int, ...] = ()


@dataclass(frozen=True)
class Node:
    """A power series: its rule, the nodes it is made of, and the factors beside them.

    An integral of a rate has one argument; start: what gives its value at first, None for a state.
    """

    name: str
    rule: str
    arguments: tuple[str, ...]
    factors: tuple[Factor, ...] = ()
    start: "Node | None" = None

    @property
    def entries(self) -> Iterator[tuple[str, Factor, str]]:
        """What stands in the row of an unknown: beside which one, the factor and the node."""
        nodes = self.arguments[2 if self.rule == HELD else 1 :]
        return zip(nodes[1::2], self.factors, nodes[::2], strict=True)


@dataclass(frozen=True)
class Recurrences:
    """A table. states, inputs: names in order; nodes: by name, in the order of the rows."""

    states: tuple[str, ...]
    inputs: tuple[str, ...]
    nodes: Mapping[str, Node]

    @property
    def unknowns(self) -> tuple[str, ...]:
        """The nodes that a set of linear equations gives, multipliers last."""
        return tuple(node.name for rule in (SOLVED, HELD) for node in self.nodes.values() if node.rule == rule)

    @property
    def multipliers(self) -> tuple[str, ...]:
        """The multipliers of constraints among them."""
        return tuple(node.name for node in self.nodes.values() if node.rule == HELD)

    @property
    def sides(self) -> tuple[str, ...]:
        """The nodes that say on which side a condition is."""
        return tuple(node.name for node in self.nodes.values() if node.rule == "side")


def read_recurrences(text: str, states: Sequence[str], inputs: Sequence[str], constants: Sequence[str]) -> Recurrences:
    """The table in this text; RecurrenceError naming the row that is wrong."""
    places = {name: place for place, name in enumerate(constants)}
    nodes: dict[str, Node] = {}
    for line in _lines(text):
        words = line.split()
        if not words:
            continue
        try:
            name, rule, *operands = words
            if name in nodes:
                raise ValueError(f"{name} stands twice")
            nodes[name] = _node(name, rule, operands, places)
        except (ValueError, KeyError) as error:
            raise RecurrenceError(f"RECURRENCE: {line!r}: {error}") from None
    table = Recurrences(tuple(states), tuple(inputs), nodes)
    _check_known(table)
    return table


def _lines(text: str) -> list[str]:
    """The rows of a table; one with ranges is many."""
    try:
        return [str(line) for line in expanded(text.replace("\n    ", " ").splitlines())]
    except ValueError as error:
        raise RecurrenceError(f"RECURRENCE: {error}") from None


def _node(name: str, rule: str, operands: list[str], places: Mapping[str, int]) -> Node:
    if rule == "integral":
        factor, rate, *start = operands
        begins = _start(name, start, places) if start else None
        return Node(name, rule, (rate,), (_factor(factor, places),), begins)
    if rule == "linear":
        kinds = "fn" * (len(operands) // 2)
    elif rule in (SOLVED, HELD):
        kinds = ("n" if rule == SOLVED else "nn") + "fnn" * (len(operands) // 3)
    elif rule in _OPERANDS:
        kinds = _OPERANDS[rule]
    else:
        raise ValueError(f"there is no rule {rule!r}")
    if len(kinds) != len(operands) or not operands:
        raise ValueError(f"{len(operands)} operands, expected {len(kinds)}")
    arguments = tuple(word for word, kind in zip(operands, kinds, strict=True) if kind == "n")
    factors = tuple(_factor(word, places) for word, kind in zip(operands, kinds, strict=True) if kind == "f")
    return Node(name, rule, arguments, factors)


def _start(name: str, start: list[str], places: Mapping[str, int]) -> Node:
    """The value of an integral at first; a function's slopes are the integral's matter."""
    rule, *operands = start
    if rule in (*FUNCTIONS, "atan2") and len(operands) == (2 if rule == "atan2" else 1):
        return Node(name, rule, tuple(operands))
    return _node(name, rule, operands, places)


def _factor(text: str, places: Mapping[str, int]) -> Factor:
    """-2*k_1*k_1 as a number and places of constants."""
    number = -1.0 if text.startswith("-") else 1.0
    constants = []
    for word in text.removeprefix("-").split("*"):
        if word in places:
            constants.append(places[word])
        else:
            number *= float(word)
    return Factor(number, tuple(constants))


def _check_known(table: Recurrences) -> None:
    known = {ONE, TIME, *table.inputs, *table.nodes}
    for state in table.states:
        if state not in table.nodes or table.nodes[state].rule != "integral" or table.nodes[state].start:
            raise RecurrenceError(f"RECURRENCE has no row of the state {state}: an integral without a start")
    for node in table.nodes.values():
        for part in (node, node.start):
            for name in part.arguments if part else ():
                if name not in known:
                    raise RecurrenceError(f"RECURRENCE: {node.name} is made of {name!r}, which is no node")
        if node.rule == "integral" and node.start is None and node.name not in table.states:
            raise RecurrenceError(f"RECURRENCE: {node.name} has no start, and is no state")
        if node.rule == "rate" and table.nodes.get(node.arguments[0], node).rule != "integral":
            raise RecurrenceError(f"RECURRENCE: {node.name} is the rate of a product with what is no integral")
