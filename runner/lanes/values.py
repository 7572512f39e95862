"""Rows of lanes under construction: what the emitted sums of a step and readings of tables are written with."""

from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba.core import cgutils

from qddot.runner import abi

#: Bytes of a row of lanes.
ROW = 8 * abi.LANES
VECTOR = ir.VectorType(ir.DoubleType(), abi.LANES)


class Value:
    """A vector of lanes under construction, so that emitted sums read as formulas; a*b + c becomes one instruction."""

    def __init__(self, builder: Any, value: Any) -> None:
        self.builder, self.value = builder, value

    def _with(self, other: "Value | float") -> Any:
        return other.value if isinstance(other, Value) else ir.Constant(VECTOR, [float(other)] * abi.LANES)

    def __add__(self, other: "Value | float") -> "Value":
        return Value(self.builder, self.builder.fadd(self.value, self._with(other), flags=("contract",)))

    def __mul__(self, other: "Value | float") -> "Value":
        return Value(self.builder, self.builder.fmul(self.value, self._with(other), flags=("contract",)))

    def __truediv__(self, other: "Value") -> "Value":
        return Value(self.builder, self.builder.fdiv(self.value, other.value))

    def __abs__(self) -> "Value":
        fabs = cgutils.get_or_insert_function(
            self.builder.module, ir.FunctionType(VECTOR, [VECTOR]), f"llvm.fabs.v{abi.LANES}f64"
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
        infinite = ir.Constant(VECTOR, [float("inf")] * abi.LANES)
        return Value(builder, builder.select(fine, self.value, infinite))


def splat(builder: Any, number: Any) -> Value:
    """The same number in every lane."""
    undefined = ir.Constant(VECTOR, ir.Undefined)
    one = builder.insert_element(undefined, number, ir.Constant(ir.IntType(32), 0))
    mask = ir.Constant(ir.VectorType(ir.IntType(32), abi.LANES), [0] * abi.LANES)
    return Value(builder, builder.shuffle_vector(one, undefined, mask))


def load(builder: Any, address: Any) -> Value:
    """The row of lanes at an address."""
    return Value(builder, builder.load(builder.inttoptr(address, VECTOR.as_pointer()), align=ROW))


def store(value: Value, address: Any) -> None:
    """Write a row of lanes."""
    builder = value.builder
    builder.store(value.value, builder.inttoptr(address, VECTOR.as_pointer()), align=ROW)


def zeros(builder: Any) -> Value:
    """Zero in every lane."""
    return Value(builder, ir.Constant(VECTOR, [0.0] * abi.LANES))


def over_states(builder: Any, n: Any, emit: Callable[[Any], None]) -> None:
    """A loop over n states; emit(place) writes its body, place: the state's bytes into a row of states."""
    with cgutils.for_range(builder, n) as loop:
        emit(builder.mul(loop.index, loop.index.type(ROW)))
