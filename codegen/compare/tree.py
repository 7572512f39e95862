"""An expression as its author wrote it: every symbol and every addend knows its place in the file."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from fractions import Fraction


class CompareError(ValueError):
    """Equations that cannot be read; the message names file, line, column and symbol, and what to do."""


@dataclass(frozen=True)
class Number:
    """A literal number, exact."""

    value: Fraction
    at: int


@dataclass(frozen=True)
class Symbol:
    """An occurrence of a name."""

    name: str
    at: int


@dataclass(frozen=True)
class Addend:
    """A signed part of a sum."""

    negative: bool
    node: "Node"
    at: int


@dataclass(frozen=True)
class Sum:
    """Addends in the order of writing."""

    addends: tuple[Addend, ...]
    at: int


@dataclass(frozen=True)
class Product:
    """Factors above and below the stroke, in the order of writing."""

    above: tuple["Node", ...]
    below: tuple["Node", ...]
    at: int


@dataclass(frozen=True)
class Power:
    """A power."""

    base: "Node"
    exponent: "Node"
    at: int


@dataclass(frozen=True)
class Call:
    """A function of arguments."""

    function: str
    arguments: tuple["Node", ...]
    at: int


@dataclass(frozen=True)
class Lookup:
    """The value of a table of the model, or its derivative of these orders by its arguments."""

    table: str
    orders: tuple[int, ...]
    arguments: tuple["Node", ...]
    at: int


Node = Number | Symbol | Sum | Product | Power | Call | Lookup


def addends(node: Node) -> tuple[Addend, ...]:
    """The addends of an expression; one that is no sum is its own only addend."""
    return node.addends if isinstance(node, Sum) else (Addend(False, node, node.at),)


def parts(node: Node) -> tuple[Node, ...]:
    """The nodes right below a node."""
    match node:
        case Sum(found, _):
            return tuple(addend.node for addend in found)
        case Product(above, below, _):
            return (*above, *below)
        case Power(base, exponent, _):
            return (base, exponent)
        case Call(_, arguments, _) | Lookup(_, _, arguments, _):
            return arguments
        case _:
            return ()


def exchanged(node: Node, change: Callable[[Call], Node]) -> Node:
    """The same expression with something in place of each call, from the innermost out."""

    def inside(part: Node) -> Node:
        return exchanged(part, change)

    match node:
        case Sum(found, at):
            return Sum(tuple(Addend(each.negative, inside(each.node), each.at) for each in found), at)
        case Product(above, below, at):
            return Product(tuple(map(inside, above)), tuple(map(inside, below)), at)
        case Power(base, exponent, at):
            return Power(inside(base), inside(exponent), at)
        case Call(function, arguments, at):
            return change(Call(function, tuple(map(inside, arguments)), at))
        case _:
            return node


def walk(node: Node) -> Iterator[Node]:
    """A node and all below it, in the order of writing."""
    yield node
    for part in parts(node):
        yield from walk(part)


def symbols(node: Node) -> tuple[Symbol, ...]:
    """The occurrences of names in an expression."""
    return tuple(part for part in walk(node) if isinstance(part, Symbol))


def inner_addends(node: Node) -> tuple[Addend, ...]:
    """The addends of the sums within an expression."""
    return tuple(addend for part in walk(node) if isinstance(part, Sum) for addend in part.addends)
