"""The passes over states and lanes in which an explicit Runge-Kutta method does its sums, unrolled from its tableau.

`combine(method, row, ...)` is one loop over the states for each row of the tableau: the row's coefficients stand in it
as numbers, those that vanish are left out, sums stay in registers. Looping over the tableau in memory instead costs
twice the whole step.
"""

from collections.abc import Callable, Sequence
from functools import cache
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numpy.typing import NDArray

from runner import abi
from runner.memory import intrinsic
from runner.methods import find_method
from runner.pointers import caller

#: Bytes of a row of lanes.
ROW = 8 * abi.LANES
_VECTOR = ir.VectorType(ir.DoubleType(), abi.LANES)


class Value:
    """A vector of lanes under construction, so that emitted sums read as formulas; a*b + c becomes one instruction."""

    def __init__(self, builder: Any, value: Any) -> None:
        self.builder, self.value = builder, value

    def _with(self, other: "Value | float") -> Any:
        return other.value if isinstance(other, Value) else ir.Constant(_VECTOR, [float(other)] * abi.LANES)

    def __add__(self, other: "Value | float") -> "Value":
        return Value(self.builder, self.builder.fadd(self.value, self._with(other), flags=("contract",)))

    def __mul__(self, other: "Value | float") -> "Value":
        return Value(self.builder, self.builder.fmul(self.value, self._with(other), flags=("contract",)))

    def __truediv__(self, other: "Value") -> "Value":
        return Value(self.builder, self.builder.fdiv(self.value, other.value))

    def __abs__(self) -> "Value":
        fabs = cgutils.get_or_insert_function(
            self.builder.module, ir.FunctionType(_VECTOR, [_VECTOR]), f"llvm.fabs.v{abi.LANES}f64"
        )
        return Value(self.builder, self.builder.call(fabs, [self.value]))

    def larger(self, other: "Value") -> "Value":
        """The larger of two, `self` where they do not compare."""
        less = self.builder.fcmp_ordered("<", self.value, other.value)
        return Value(self.builder, self.builder.select(less, other.value, self.value))

    def where_ordered(self, size: "Value", bound: "Value") -> "Value":
        """The value where it is finite or infinite but no NaN and size <= bound, elsewhere infinity."""
        builder = self.builder
        fine = builder.and_(
            builder.fcmp_ordered("ord", self.value, self.value), builder.fcmp_ordered("<=", size.value, bound.value)
        )
        infinite = ir.Constant(_VECTOR, [float("inf")] * abi.LANES)
        return Value(builder, builder.select(fine, self.value, infinite))


def splat(builder: Any, number: Any) -> Value:
    """The same number in every lane."""
    undefined = ir.Constant(_VECTOR, ir.Undefined)
    one = builder.insert_element(undefined, number, ir.Constant(ir.IntType(32), 0))
    mask = ir.Constant(ir.VectorType(ir.IntType(32), abi.LANES), [0] * abi.LANES)
    return Value(builder, builder.shuffle_vector(one, undefined, mask))


def load(builder: Any, address: Any) -> Value:
    """The row of lanes at an address."""
    return Value(builder, builder.load(builder.inttoptr(address, _VECTOR.as_pointer()), align=ROW))


def store(value: Value, address: Any) -> None:
    """Write a row of lanes."""
    builder = value.builder
    builder.store(value.value, builder.inttoptr(address, _VECTOR.as_pointer()), align=ROW)


@cache
def rows_of(method: str) -> tuple[NDArray[np.float64], ...]:
    """Weights of the slopes, row after row: each stage's, those of dense output included, then b."""
    found = find_method(method)
    tableau = found.tableau if found.pair is None else found.pair.dense
    if tableau is None or found.tableau is None:
        raise ValueError(f"method {method!r} has no tableau")
    return (*tableau.A, found.tableau.b)


def weighted(builder: Any, weights: Sequence[float], slopes: Any, stride: Any, place: Any) -> Value:
    """Sum of weights[j] * slope j at `place` bytes into each; vanishing weights are left out."""
    total = Value(builder, ir.Constant(_VECTOR, [0.0] * abi.LANES))
    first = True
    for j, weight in enumerate(weights):
        if weight != 0.0:
            where = builder.add(builder.add(slopes, builder.mul(stride, stride.type(j))), place)
            term = load(builder, where) * float(weight)
            total, first = (term if first else load(builder, where) * float(weight) + total), False
    return total


def over_states(builder: Any, n: Any, emit: Callable[[Any], None]) -> None:
    """A loop over n states; emit(place) writes its body, place: the state's bytes into a row of states."""
    with cgutils.for_range(builder, n) as loop:
        emit(builder.mul(loop.index, loop.index.type(ROW)))


@intrinsic(prefer_literal=True)
def combine(typing_context: Any, method: Any, row: Any, n: Any, h: Any, base: Any, slopes: Any, target: Any) -> Any:
    """Target = base + h * (row `row` of the method's tableau times the slopes), for n states of all lanes.

    Arguments after the row are addresses of rows; the slopes follow each other.
    """

    def emit(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        _, chosen, states, step, start, first, result = arguments
        h_lanes, stride = load(builder, step), builder.mul(states, states.type(ROW))
        rows = rows_of(method.literal_value)
        end = builder.append_basic_block("combined")
        switch = builder.switch(chosen, end)
        for index, weights in enumerate(rows):
            block = builder.append_basic_block(f"row_{index}")
            switch.add_case(chosen.type(index), block)
            builder.position_at_end(block)

            def body(place: Any, weights: Any = weights) -> None:
                total = weighted(builder, weights, first, stride, place)
                store(total * h_lanes + load(builder, builder.add(start, place)), builder.add(result, place))

            over_states(builder, states, body)
            builder.branch(end)
        builder.position_at_end(end)
        return context.get_dummy_value()

    if not isinstance(method, types.StringLiteral):
        return None
    address = types.int64
    return types.void(method, types.int64, types.int64, *[address] * 4), emit


@intrinsic
def sum_of_squares(typing_context: Any, n: Any, base: Any, target: Any) -> Any:
    """The row at `target` = the sum of squares of n states, a quick look whether any of them is out of bounds."""

    def emit(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        states, start, result = arguments
        total = cgutils.alloca_once_value(builder, ir.Constant(_VECTOR, [0.0] * abi.LANES))

        def body(place: Any) -> None:
            x = load(builder, builder.add(start, place))
            builder.store((x * x + Value(builder, builder.load(total))).value, total)

        over_states(builder, states, body)
        store(Value(builder, builder.load(total)), result)
        return context.get_dummy_value()

    return types.void(types.int64, types.int64, types.int64), emit


@intrinsic
def doubles(typing_context: Any, where: Any) -> Any:
    """The pointer to float64 at an address."""

    def emit(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.inttoptr(arguments[0], ir.DoubleType().as_pointer())

    return abi.POINTER(types.int64), emit


@intrinsic
def call_lanes(typing_context: Any, where: Any, t: Any, x: Any, u: Any, c: Any, result: Any) -> Any:
    """Call a lane kernel of the calling convention at an address; the others are addresses, too."""
    _, call = caller(abi.LANE_KERNEL)

    def emit(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        pointers = [builder.inttoptr(each, ir.DoubleType().as_pointer()) for each in arguments[1:]]
        return call(context, builder, signature, [arguments[0], *pointers])

    return types.void(*[types.int64] * 6), emit


@intrinsic
def take_next(typing_context: Any, where: Any) -> Any:
    """Add one to the int64 at an address and give what it was; threads may do so at the same time."""

    def emit(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        place = builder.inttoptr(arguments[0], ir.IntType(64).as_pointer())
        return builder.atomic_rmw("add", place, ir.IntType(64)(1), "monotonic")

    return types.int64(types.int64), emit


@intrinsic(prefer_literal=True)
def estimate_errors(
    typing_context: Any, method: Any, n: Any, h: Any, now: Any, new: Any, slopes: Any, atol: Any, rtol: Any, limit: Any,
    sizes: Any,
) -> Any:  # fmt: skip
    """The rows at `sizes` = how large each error estimate of a step is, relative to the tolerance.

    The largest component under MATLAB's controller, otherwise the sum of squares; infinite where a ratio is not finite
    or a new state beyond the limit (see `explicit.controller.scale`).
    """

    def emit(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        _, states, step, old_rows, new_rows, first, tolerances, relative, bound, result = arguments
        h_lanes, stride = load(builder, step), builder.mul(states, states.type(ROW))
        rtol_lanes, bound_lanes = splat(builder, relative), splat(builder, bound)
        zero = ir.Constant(_VECTOR, [0.0] * abi.LANES)
        totals = [cgutils.alloca_once_value(builder, zero) for _ in pair.error_weights]

        def body(place: Any) -> None:
            old_size = abs(load(builder, builder.add(old_rows, place)))
            new_size = abs(load(builder, builder.add(new_rows, place)))
            part = rtol_lanes * old_size.larger(new_size)
            where = builder.add(tolerances, builder.udiv(place, place.type(abi.LANES)))
            atol_lanes = splat(builder, builder.load(builder.inttoptr(where, ir.DoubleType().as_pointer())))
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
    return types.void(method, *[address] * 6, types.float64, types.float64, address), emit


@intrinsic
def choose(typing_context: Any, n: Any, chosen: Any, old: Any, new: Any) -> Any:
    """Rows at `old` = those at `new` in the lanes whose number at `chosen` is not 0, for n states."""

    def emit(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        states, mask, old_rows, new_rows = arguments
        zero = ir.Constant(_VECTOR, [0.0] * abi.LANES)
        taken = builder.fcmp_ordered("!=", load(builder, mask).value, zero)

        def body(place: Any) -> None:
            where = builder.add(old_rows, place)
            fresh = load(builder, builder.add(new_rows, place)).value
            store(Value(builder, builder.select(taken, fresh, load(builder, where).value)), where)

        over_states(builder, states, body)
        return context.get_dummy_value()

    return types.void(*[types.int64] * 4), emit
