"""The table of a model: what its states and accelerations are in the nodes of `recurrences`."""

from collections.abc import Mapping
from typing import Any

import symengine as se

from qddot.codegen.kernel import Kernel
from qddot.codegen.lagrange import Equations
from qddot.codegen.ranges import compressed
from qddot.codegen.recurrences import ONE, Form, NoRecurrenceError, Recurrences, added, alone, scaled
from qddot.codegen.recurrences_cells import Cells, with_rates
from qddot.codegen.recurrences_solved import lagging, solve, written
from qddot.codegen.rewrite import Names


def recurrences(
    equations: Equations, kernels: Mapping[str, Kernel], constants: tuple[Any, ...]
) -> tuple[tuple[str, ...], str]:
    """The rows of a model's table; none, and the function that is in the way, where one has no recurrence.

    kernels: `rhs`, and `balance` where the mass matrix moves.
    """
    kernel = _free(kernels.get("balance", kernels["rhs"]), equations)
    standing = (*kernel.kept, *(each for loop in kernel.loops for each in loop.symbols))
    taken = (*equations.state, *equations.accelerations, *equations.constraints.multipliers, *equations.channels)
    names = Names(map(str, (*taken, equations.time, *constants, *(s for s, _ in kernel.temporaries), *standing)))
    rates = dict(zip(equations.coordinates, equations.velocities, strict=True))
    kernel, of_cells = with_rates(kernel, rates, names)
    fixed = {*constants, *equations.parameters}
    fixed |= {each for loop in kernel.loops for each, column in loop.symbols.items() if fixed.issuperset(column)}
    table = Recurrences(fixed, {equations.time: se.Integer(1), **rates, **of_cells}, names)
    try:
        for symbol, expression in kernel.temporaries:
            table.assign(symbol, expression)
        writes = {(s.argument, s.index): table.form(value) for s, value in kernel.writes if s.loop is None}
        if kernel.loops:
            Cells(kernel, names).write(table, writes)
        rows = _motion(equations, table, writes)
    except NoRecurrenceError as error:
        return (), str(error)
    rows |= table.needed(row[-1] for row in rows.values())
    found = [" ".join((name, *row)) for name, row in rows.items()]
    if not kernel.loops:
        return tuple(found), ""
    return tuple(
        row for rows in compressed(found, turns=True) for row in ((rows,) if isinstance(rows, str) else rows)
    ), ""


def _free(kernel: Kernel, equations: Equations) -> Kernel:
    """A kernel without modes: series hold conditions by themselves."""
    modes = equations.modes.functions.keys()
    standing = {each for loop in kernel.loops for each, column in loop.symbols.items() if modes >= set(column)}
    nothing = dict.fromkeys((*modes, *standing), se.Integer(0))
    if not kernel.used & nothing.keys():
        return kernel
    temporaries = [(symbol, expression.subs(nothing)) for symbol, expression in kernel.temporaries]
    return kernel.replace(temporaries, [(slot, expression.subs(nothing)) for slot, expression in kernel.writes])


def _motion(
    equations: Equations, table: Recurrences, writes: Mapping[tuple[str, tuple[int, ...]], Form]
) -> dict[str, tuple[str, ...]]:
    """The rows of the states."""
    count = len(equations.coordinates)
    speeds = [alone(str(v)) for v in equations.velocities]
    if any(argument == "force" for argument, _ in writes):
        move = _from_squares if any(argument == "weight" for argument, _ in writes) else _from_matrix
        move(equations, table, writes)
        rates = [alone(str(a)) for a in equations.accelerations]
        rates += [writes["rate", (k,)] for k in range(len(equations.states))]
    else:
        rates = [writes["derivative", (k,)] for k in range(count, len(equations.state))]
    rows: dict[str, tuple[str, ...]] = {}
    for symbol, rate in zip(equations.state, (*speeds, *rates), strict=True):
        rows[str(symbol)] = ("integral", "1", table.linear(rate))
    return rows


def _from_matrix(equations: Equations, table: Recurrences, writes: Mapping[Any, Form]) -> None:
    """M_0 a_k = f_k - sum of M_{k-j} a_j, j < k."""
    count = len(equations.coordinates)
    entries = dict(written(writes, "matrix"))
    forces = []
    for i in range(count):
        terms = [writes["force", (i,)]]
        for j, a in enumerate(equations.accelerations):
            terms.append(lagging(table, entries.get((max(i, j), min(i, j)), {}), str(a)))
        forces.append(added(terms))
    solve(equations, table, entries, forces, writes)


def _from_squares(equations: Equations, table: Recurrences, writes: Mapping[Any, Form]) -> None:
    """Sum m J_i dw/dt = Q_i; what holds a_k in dw/dt is left out of f and makes up M_0."""
    places = sorted(index for argument, index in writes if argument == "turning")
    turning = [writes["turning", place] for place in places]
    weights = dict(written(writes, "weight"))
    rates = [_rate_of_product(equations, table, i, g) for (_, i), g in zip(places, turning, strict=True)]
    entries: dict[tuple[int, int], Form] = {}
    forces = [writes["force", (i,)] for i in range(len(equations.coordinates))]
    for a, i in places:
        found = []
        for b, j in places:
            weight = weights.get((max(a, b), min(a, b)))
            if weight:
                found.append(table.multiply(weight, rates[b]))
                if i >= j:
                    product = table.multiply(table.multiply(turning[a], turning[b]), weight)
                    entries[i, j] = added([entries.get((i, j), {}), product])
        forces[i] = added([forces[i], scaled(table.multiply(turning[a], added(found)), -1.0, ())])
    solve(equations, table, entries, forces, writes)


def _rate_of_product(equations: Equations, table: Recurrences, i: int, g: Form) -> Form:
    """d(g v_i)/dt; the product becomes the integral of it."""
    v, a = str(equations.velocities[i]), str(equations.accelerations[i])
    if all(node == ONE for node, _ in g):
        return table.multiply(g, alone(a))
    product = table.multiply(g, alone(v))
    (((node, names), number),) = product.items()
    (((turning, _), _),) = g.items()
    return {(table.rate_of_product(node, turning, v, a), names): number}
