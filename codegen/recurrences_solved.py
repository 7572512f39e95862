"""The rows of accelerations and multipliers: M a + G' l = f, and G a = gamma."""

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from qddot.codegen.lagrange import Equations
from qddot.codegen.recurrences import ONE, Form, Recurrences, added, alone, scaled

#: (argument, index) -> what is written there.
Writes = Mapping[tuple[str, tuple[int, ...]], Form]
Entries = Mapping[tuple[int, int], Form]


def solve(equations: Equations, table: Recurrences, masses: Entries, forces: list[Form], writes: Writes) -> None:
    """Add the rows; forces: f without what holds a_k. The lower half of M is given."""
    n, multipliers = len(forces), [str(each) for each in equations.constraints.multipliers]
    gradients = dict(written(writes, "constraint"))
    entries = dict(masses) | {(n + j, k): form for (j, k), form in gradients.items()}
    nodes = {place: table.factor_and_node(form) for place, form in entries.items() if form}
    rights = [added([force, _pull(table, gradients, k, multipliers)]) for k, force in enumerate(forces)]
    rights += [_drift(equations, table, gradients, writes, j) for j in range(len(multipliers))]
    unknowns = [*map(str, equations.accelerations), *multipliers]
    for i, form in enumerate(rights):
        row = [(nodes[max(i, j), min(i, j)], a) for j, a in enumerate(unknowns) if (max(i, j), min(i, j)) in nodes]
        known = {key: number for key, number in form.items() if key[0] not in unknowns}
        right = table.linear(known, table.fresh(f"force_{i + 1}" if i < n else f"drift_{i - n + 1}"))
        head = ("solved", right) if i < n else ("held", right, table.linear(writes["residual", (i - n,)]))
        table.rows[unknowns[i]] = (*head, *(text for (f, node), a in row for text in (f, node, a)))


def written(writes: Writes, argument: str) -> Iterator[tuple[Any, Form]]:
    """What is written to an argument, by its index."""
    return ((index, form) for (name, index), form in writes.items() if name == argument)


def lagging(table: Recurrences, entry: Form, unknown: str) -> Form:
    """Less the product of an entry with an unknown, but for its term m_0 a_k, which the equations hold."""
    moving = {key: number for key, number in entry.items() if key[0] != ONE}
    if not moving:
        return {}
    ((node, names), number), *others = moving.items()
    if others:
        (node, names), number = (table.linear(moving), ()), 1.0
    return {(table.row("lagging", node, unknown), names): -number}


def _pull(table: Recurrences, gradients: Entries, k: int, multipliers: list[str]) -> Form:
    """What lags of the constraints' pull on coordinate k: of those that pull alike the multipliers are added first."""
    alike: dict[str, list[Form]] = {}
    for (j, i), form in gradients.items():
        if i == k:
            node, number, names = table.single(form)
            alike.setdefault(node, []).append(scaled(alone(multipliers[j]), number, names))
    pulls = ((node, table.single(added(forces))) for node, forces in alike.items())
    return added(scaled(lagging(table, alone(node), pull), number, names) for node, (pull, number, names) in pulls)


def _drift(equations: Equations, table: Recurrences, gradients: Entries, writes: Writes, j: int) -> Form:
    """Gamma of constraint j less what lags of G a.

    That is less the second derivative of its residual, and where this is linear in coordinates and in sines of what is
    linear in them, that of products g v, whose rates stand for it all.
    """
    if equations.system.baumgarte is None and j < equations.constraints.n_positions:
        turning = _second_derivative(equations, table, writes["residual", (j,)])
        if turning is not None:
            return scaled(turning, -1.0, ())
    of_row = ((k, form) for (i, k), form in gradients.items() if i == j)
    lags = [lagging(table, form, str(equations.accelerations[k])) for k, form in of_row]
    return added([writes["drift", (j,)], *lags])


def _second_derivative(equations: Equations, table: Recurrences, form: Form) -> Form | None:
    """That of a form by time; None where it is made of something else than what `_drift` says."""
    coordinates = {str(q): str(a) for q, a in zip(equations.coordinates, equations.accelerations, strict=True)}
    parts: list[Form] = []
    for (node, names), number in form.items():
        if node == ONE:
            continue
        if node in table.sums:
            found = _second_derivative(equations, table, table.sums[node])
        elif node in coordinates:
            found = alone(coordinates[node])
        else:
            found = _rate_of_slope(equations, table, table.slopes.get(node))
        if found is None:
            return None
        parts.append(scaled(found, number, names))
    return added(parts)


def _rate_of_slope(equations: Equations, table: Recurrences, slope: Form | None) -> Form | None:
    """The derivative of the slope of a sine, a factor times a product g v."""
    if slope is None or len(slope) != 1:
        return None
    (((node, names), number),) = slope.items()
    factors = _factors(table.rows.get(node, ()))
    g = next((each for each in factors if each in table.slopes), None)
    if g is None:
        return None
    v = next(each for each in factors if each != g)
    a = _acceleration(equations, table, v)
    return None if a is None else {(table.rate_of_product(node, g, v, a), names): number}


def _factors(row: Iterable[str]) -> tuple[str, ...]:
    """The factors of a product, or of what has become the integral of its rate."""
    rule, *operands = row or ("",)
    if rule == "product":
        return tuple(operands)
    return tuple(operands[3:]) if rule == "integral" and operands[2:3] == ["product"] else ()


def _acceleration(equations: Equations, table: Recurrences, v: str) -> str | None:
    """The node of dv/dt of a speed, or of a sum of such."""
    rates = {str(v): str(a) for v, a in zip(equations.velocities, equations.accelerations, strict=True)}
    if v in rates:
        return rates[v]
    form = table.sums.get(v)
    if form is None or not all(node in rates for node, _ in form):
        return None
    return table.linear({(rates[node], names): number for (node, names), number in form.items()})
