"""Nodes of one kind side by side in vectors, and the order in which they are computed.

An order of the series takes its nodes level by level, a level being what depends on lower levels alone. Nodes of one
level and rule go together, `width` of them in a vector: a group. In lanes a group is one node, and a vector its runs.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from qddot.runner.machine.recurrences import FUNCTIONS, HELD, ONE, SOLVED, TIME, Node, RecurrenceError, Recurrences

#: Rules of functions, which go on from their slopes.
CHAINED = (*FUNCTIONS, "atan2")
#: About how many cycles a processor takes for a node when its parts are known, or for the last term of a sum.
_CYCLES, _SUM = {"integral": 3, "linear": 7, "lagging": 6}, 4


@dataclass(frozen=True, eq=False)
class Group:
    """Nodes in a vector. kind: their rule, and that of their start for an integral; "one", "time", "input" are given.

    live: needed at every order, not just at the first. late: complete only when the unknowns of the order are known.
    """

    index: int
    kind: str
    nodes: tuple[Node, ...]
    live: bool
    late: bool


@dataclass(frozen=True, eq=False)
class Packing:
    """All groups, and where a node is: (group, place). first, later: groups in the order of computing order 0, and k.

    depths: how long after the unknowns of the order before a node's coefficient is known.
    """

    table: Recurrences
    width: int
    groups: tuple[Group, ...]
    home: Mapping[str, tuple[int, int]]
    first: tuple[Group, ...]
    later: tuple[Group, ...]
    depths: Mapping[str, int]

    def kind(self, *kinds: str) -> tuple[Group, ...]:
        """The groups of these kinds."""
        return tuple(group for group in self.groups if group.kind in kinds)


def pack(table: Recurrences, width: int) -> Packing:
    """The groups of a table."""
    live, late = live_nodes(table), _late(table)
    _check_late(table, late)
    levels = _levels(table, later=True)
    try:
        return _packed(table, width, levels, live, late)
    except _CircularError:
        return _packed(table, width, _levels(table, later=False), live, late)


class _CircularError(Exception):
    pass


def _packed(table: Recurrences, width: int, levels: Mapping[str, int], live: set[str], late: set[str]) -> Packing:
    groups: list[Group] = []

    def group(kind: str, nodes: Iterable[Node]) -> None:
        found = list(nodes)
        for start in range(0, len(found), width):
            part = tuple(found[start : start + width])
            names = [node.name for node in part]
            groups.append(Group(len(groups), kind, part, live.isdisjoint(names) is False, not late.isdisjoint(names)))

    group("state", (table.nodes[name] for name in table.states))
    group("one", [Node(ONE, "one", ())])
    if any(TIME in node.arguments for node in table.nodes.values()):
        group("time", [Node(TIME, "time", ())])
    group("input", [Node(name, "input", ()) for name in table.inputs])
    group("unknown", (table.nodes[name] for name in table.unknowns))
    group("side", (table.nodes[name] for name in table.sides))
    kinds: dict[tuple[int, str, bool, bool], list[Node]] = {}
    for node in table.nodes.values():
        if node.rule not in (SOLVED, HELD, "side") and node.name not in table.states:
            key = (levels[node.name], _kind(node), node.name in live, node.name in late)
            kinds.setdefault(key, []).append(node)
    for key in sorted(kinds):
        group(key[1], kinds[key])
    home = {node.name: (each.index, place) for each in groups for place, node in enumerate(each.nodes)}
    first = _ordered(groups, home, later=False)
    later = [each for each in _ordered(groups, home, later=True) if each.live]
    return Packing(table, width, tuple(groups), home, tuple(first), tuple(later), _depths(table, late))


def _kind(node: Node) -> str:
    if node.rule == "product" and node.arguments[0] == node.arguments[1]:
        return "square"
    return f"integral {node.start.rule}" if node.rule == "integral" and node.start else node.rule


def arity(rule: str) -> int:
    """How many nodes give the first value of one of this rule; a function's slopes do not."""
    return 1 if rule in (*FUNCTIONS, "power", "lagging") else 2


def needs(node: Node, later: bool) -> tuple[str, ...]:
    """The nodes whose coefficient of this order a node takes before its own can be computed."""
    if node.rule == "integral":
        return () if later or node.start is None else needs(node.start, later)
    if node.rule in CHAINED:
        return node.arguments[: arity(node.rule)]
    if node.rule == "lagging":
        return node.arguments[:1]
    if node.rule == "rate":
        return node.arguments[:2]
    if node.rule == "where" and later:
        return node.arguments[1:]
    return () if node.rule in (SOLVED, HELD, "side") else node.arguments


def _needs_of(nodes: Mapping[str, Node], node: Node, later: bool) -> tuple[str, ...]:
    """`needs`, with what else stands before a rate of a product.

    That is the rate of the integral whose next coefficient it takes, and what holds the unknowns that complete it.
    """
    found = needs(node, later)
    if node.rule == "rate":
        found = (*found, *nodes[node.arguments[0]].arguments, node.arguments[2])
    return found


def _levels(table: Recurrences, later: bool) -> dict[str, int]:
    levels: dict[str, int] = {}

    def level(name: str, above: tuple[str, ...]) -> int:
        if name in above:
            raise RecurrenceError(f"RECURRENCE: {name} is made of itself")
        if name not in levels:
            node = table.nodes.get(name)
            parts = _needs_of(table.nodes, node, later) if node else ()
            levels[name] = max((1 + level(part, (*above, name)) for part in parts), default=0)
        return levels[name]

    for name in table.nodes:
        level(name, ())
    return levels


def _depths(table: Recurrences, late: set[str]) -> dict[str, int]:
    """About how many cycles; an integral of what is known before the unknowns are takes none."""
    found = dict.fromkeys((*table.inputs, *table.unknowns, ONE, TIME), 0)
    slow = late | set(table.unknowns)

    def depth(name: str) -> int:
        if name not in found:
            node = table.nodes[name]
            cycles = _CYCLES.get(node.rule, _SUM)
            parts = [cycles + depth(part) for part in needs(node, later=True)]
            waits = node.rule == "lagging" or (node.rule == "integral" and node.arguments[0] in slow)
            found[name] = max([*parts, cycles * waits])
        return found[name]

    for name in table.nodes:
        depth(name)
    return found


def _ordered(groups: list[Group], home: Mapping[str, tuple[int, int]], later: bool) -> list[Group]:
    """Groups so that each comes after what it needs; raises _CircularError where there is no such order."""
    table = {node.name: node for group in groups for node in group.nodes}
    found: list[Group] = []
    state: dict[int, bool] = {}

    def visit(group: Group) -> None:
        if state.get(group.index):
            return
        if group.index in state:
            raise _CircularError
        state[group.index] = False
        for node in group.nodes:
            for part in _needs_of(table, node, later):
                visit(groups[home[part][0]])
        state[group.index] = True
        found.append(group)

    for group in groups:
        visit(group)
    return found


def live_nodes(table: Recurrences) -> set[str]:
    """The nodes whose coefficients of every order are needed."""
    found: set[str] = set()
    waiting = [*table.states, *(table.nodes[side].arguments[0] for side in table.sides)]
    while waiting:
        name = waiting.pop()
        if name in found:
            continue
        found.add(name)
        node = table.nodes.get(name)
        if node is None:
            continue
        if node.rule in (SOLVED, HELD):
            waiting += [node.arguments[0], *table.unknowns]
        elif node.rule == "where":
            waiting += node.arguments[1:]
        elif node.rule != "side":
            waiting += node.arguments
    return found


def _late(table: Recurrences) -> set[str]:
    """The nodes that hold unknowns of the same order."""
    late = {node.name for node in table.nodes.values() if node.rule == "rate"}
    unknown = set(table.unknowns)
    while True:
        more = {
            node.name
            for node in table.nodes.values()
            if node.rule in ("linear", "product", "where") and not (late | unknown).isdisjoint(node.arguments)
        }
        if more <= late:
            return late
        late |= more


def _check_late(table: Recurrences, late: set[str]) -> None:
    """What holds unknowns must be linear in them; a product of such a node is a part of the equations alone."""
    rights = {table.nodes[name].arguments[0] for name in table.unknowns}
    for node in table.nodes.values():
        parts = [part for part in needs(node, later=True) if part in late]
        nonlinear = node.rule not in ("linear", "product", "rate", SOLVED, HELD, "integral")
        both = node.rule == "product" and len(parts) > 1
        beyond = any(table.nodes[part].rule in ("product", "where") for part in parts) and node.name not in rights
        if parts and (nonlinear or both or beyond):
            raise RecurrenceError(f"RECURRENCE: {node.name} takes {parts[0]} before it is known")
