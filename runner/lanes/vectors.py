"""The passes over states and lanes in which an explicit Runge-Kutta method does its sums, unrolled from its tableau.

`combine(method, row, ...)` is one loop over the states for each row of the tableau: the row's coefficients stand in it
as numbers, those that vanish are left out, sums stay in registers. Looping over the tableau in memory instead costs
twice the whole step.
"""

from collections.abc import Sequence
from functools import cache
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils

from qddot.runner import abi
from qddot.runner.lanes.values import ROW, Value, load, over_states, splat, store, zeros
from qddot.runner.machine.memory import intrinsic
from qddot.runner.methods import find_method
from qddot.runner.tableaux.butcher import ButcherTableau


@cache
def tableau_of(method: str) -> ButcherTableau:
    """The tableau of a method, with the stages of its dense output."""
    found = find_method(method)
    tableau = found.tableau if found.pair is None else found.pair.dense
    if tableau is None:
        raise ValueError(f"method {method!r} has no tableau")
    return tableau


def weighted(builder: Any, weights: Sequence[float], slopes: Any, stride: Any, place: Any) -> Value:
    """Sum of weights[j] * slope j at `place` bytes into each; vanishing weights are left out."""
    total = zeros(builder)
    first = True
    for j, weight in enumerate(weights):
        if weight != 0.0:
            where = builder.add(builder.add(slopes, builder.mul(stride, stride.type(j))), place)
            term = load(builder, where) * float(weight)
            total, first = (term if first else load(builder, where) * float(weight) + total), False
    return total


def advanced(
    builder: Any, weights: Sequence[float], h: Value, base: Any, slopes: Any, stride: Any, place: Any
) -> Value:
    """What stands at `place` bytes into the rows at `base`, plus h * (weights times the slopes)."""
    return weighted(builder, weights, slopes, stride, place) * h + load(builder, builder.add(base, place))


@intrinsic(prefer_literal=True)
def combine(typing_context: Any, method: Any, row: Any, n: Any, h: Any, base: Any, slopes: Any, target: Any) -> Any:
    """Target = base + h * (row `row` of the method's A times the slopes), for n states of all lanes.

    Arguments after the row are addresses of rows; the slopes follow each other.
    """

    def emit(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        _, chosen, states, step, start, first, result = arguments
        h_lanes, stride = load(builder, step), builder.mul(states, states.type(ROW))
        rows = tableau_of(method.literal_value).A
        end = builder.append_basic_block("combined")
        switch = builder.switch(chosen, end)
        for index, weights in enumerate(rows):
            block = builder.append_basic_block(f"row_{index}")
            switch.add_case(chosen.type(index), block)
            builder.position_at_end(block)

            def body(place: Any, weights: Any = weights) -> None:
                x = advanced(builder, weights, h_lanes, start, first, stride, place)
                store(x, builder.add(result, place))

            over_states(builder, states, body)
            builder.branch(end)
        builder.position_at_end(end)
        return context.get_dummy_value()

    if not isinstance(method, types.StringLiteral):
        return None
    address = types.int64
    return types.void(method, types.int64, types.int64, *[address] * 4), emit


@intrinsic
def go_along(typing_context: Any, n: Any, h: Any, weight: Any, base: Any, slopes: Any, target: Any) -> Any:
    """Target = base + weight * h * slopes, for n states of all lanes; h and the last three are addresses of rows."""

    def emit(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        states, step, part, start, first, result = arguments
        lengths = splat(builder, part) * load(builder, step)

        def body(place: Any) -> None:
            old, slope = (load(builder, builder.add(rows, place)) for rows in (start, first))
            store(slope * lengths + old, builder.add(result, place))

        over_states(builder, states, body)
        return context.get_dummy_value()

    return types.void(types.int64, types.int64, types.float64, *[types.int64] * 3), emit


@intrinsic(prefer_literal=True)
def conclude(
    typing_context: Any, method: Any, counted: Any, n: Any, h: Any, base: Any, slopes: Any, target: Any, size: Any
) -> Any:
    """Target = base + h * (the first so many of the method's b times the slopes), for n states of all lanes.

    With none of them it stays. The row at `size` = their sum of squares, a quick look whether any is out of bounds.
    """

    def emit(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        *_, states, step, start, first, result, sizes = arguments
        h_lanes, stride = load(builder, step), builder.mul(states, states.type(ROW))
        total = cgutils.alloca_once_value(builder, zeros(builder).value)

        def body(place: Any) -> None:
            where = builder.add(result, place)
            if weights.size:
                store(advanced(builder, weights, h_lanes, start, first, stride, place), where)
            x = load(builder, where)
            builder.store((x * x + Value(builder, builder.load(total))).value, total)

        over_states(builder, states, body)
        store(Value(builder, builder.load(total)), sizes)
        return context.get_dummy_value()

    if not isinstance(method, types.StringLiteral):
        return None
    weights = tableau_of(method.literal_value).b[: counted.literal_value]
    return types.void(method, counted, *[types.int64] * 6), emit


@intrinsic(prefer_literal=True)
def estimate_errors(
    typing_context: Any, method: Any, n: Any, h: Any, now: Any, new: Any, slopes: Any, atol: Any, rtol: Any, limit: Any,
    sizes: Any,
) -> Any:  # fmt: skip
    """The rows at `sizes` = how large each error estimate of a step is, relative to the tolerance.

    The largest component under MATLAB's controller, otherwise the sum of squares; infinite where a ratio is not finite
    or a new state beyond the limit (see `frame.step_control`, whose text this cannot be).
    """

    def emit(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        _, states, step, old_rows, new_rows, first, tolerances, relative, bound, result = arguments
        h_lanes, stride = load(builder, step), builder.mul(states, states.type(ROW))
        bound_lanes = splat(builder, bound)
        zero = zeros(builder).value
        totals = [cgutils.alloca_once_value(builder, zero) for _ in pair.error_weights]

        def body(place: Any) -> None:
            old_size = abs(load(builder, builder.add(old_rows, place)))
            new_size = abs(load(builder, builder.add(new_rows, place)))
            item = builder.udiv(place, place.type(abi.LANES))
            rtol_lanes, atol_lanes = (
                splat(builder, builder.load(builder.inttoptr(builder.add(row, item), ir.DoubleType().as_pointer())))
                for row in (relative, tolerances)
            )
            part = rtol_lanes * old_size.larger(new_size)
            tolerance = atol_lanes.larger(part) if matlab else part + atol_lanes
            for weights, total in zip(pair.error_weights, totals, strict=True):
                ratio = abs(weighted(builder, weights, first, stride, place) * h_lanes) / tolerance
                ratio = ratio.where_ordered(new_size, bound_lanes)
                so_far = Value(builder, builder.load(total))
                builder.store((so_far.larger(ratio) if matlab else ratio * ratio + so_far).value, total)

        over_states(builder, states, body)
        for index, total in enumerate(totals):
            store(Value(builder, builder.load(total)), builder.add(result, result.type(ROW * index)))
        return context.get_dummy_value()

    if not isinstance(method, types.StringLiteral):
        return None
    pair: Any = find_method(method.literal_value).pair
    matlab, address = pair.controller == "matlab", types.int64
    return types.void(method, *[address] * 7, types.float64, address), emit


@intrinsic
def choose(typing_context: Any, n: Any, chosen: Any, old: Any, new: Any) -> Any:
    """Rows at `old` = those at `new` in the lanes whose number at `chosen` is not 0, for n states."""

    def emit(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        states, mask, old_rows, new_rows = arguments
        zero = zeros(builder).value
        taken = builder.fcmp_ordered("!=", load(builder, mask).value, zero)

        def body(place: Any) -> None:
            where = builder.add(old_rows, place)
            fresh = load(builder, builder.add(new_rows, place)).value
            store(Value(builder, builder.select(taken, fresh, load(builder, where).value)), where)

        over_states(builder, states, body)
        return context.get_dummy_value()

    return types.void(*[types.int64] * 4), emit
