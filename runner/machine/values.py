"""LLVM's instructions of what is done with values of compiled code, each of which has its numba type.

What numba has for an operation or a function, it gives; what is done most, sums and products of floats and integers,
comparisons, items of arrays, is emitted here: numba takes longer to find its own than to emit it.
"""

import ast
import operator
from collections.abc import Sequence
from functools import cache, reduce
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils

from qddot.runner.machine.text import StrayError

#: The numba type of a value, and the value.
Typed = tuple[Any, Any]

DOUBLE, WORD, BIT = ir.DoubleType(), ir.IntType(64), ir.IntType(1)
FLOAT_ARITHMETIC: dict[type, str] = {ast.Add: "fadd", ast.Sub: "fsub", ast.Mult: "fmul", ast.Div: "fdiv"}
WHOLE_ARITHMETIC: dict[type, str] = {ast.Add: "add", ast.Sub: "sub", ast.Mult: "mul"}
#: As numba has it: an index beside one that is not negative is none from the end then, and LLVM sees rows of vectors.
_NO_OVERFLOW = ("nsw",)
_OPERATORS: dict[type, Any] = {
    **{ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv},
    **{ast.FloorDiv: operator.floordiv, ast.Mod: operator.mod, ast.Pow: operator.pow},
    **{ast.BitAnd: operator.and_, ast.BitOr: operator.or_, ast.LShift: operator.lshift, ast.RShift: operator.rshift},
}
RELATIONS: dict[type, str] = {
    **{ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">="},
    **{ast.Eq: "==", ast.NotEq: "!="},
}

#: Where numba keeps of what is compiled whether it may raise something.
RAISES = "qddot_raises"


@cache
def _resolved(typing_context: Any, kind: Any, kinds: tuple[Any, ...]) -> Any:
    """The types that numba finds for a call, which takes it a millisecond."""
    return typing_context.resolve_function_type(kind, kinds, {})


def _overload(typing_context: Any, function: Any, kinds: tuple[Any, ...]) -> Any:
    """What a jitted function is for arguments of these types, compiled now where it is not yet.

    An inner function is compiled past numba's clocks, which make a note of each call of LLVM for each of its callers.
    """
    made = function.overloads.get(kinds)
    if made is not None:
        return made
    if function.targetoptions.get("no_cpython_wrapper") and function._can_compile:
        made = function._compiler.compile(kinds, None)
        function.add_overload(made)
        return made
    found = types.Dispatcher(function).get_call_type(typing_context, kinds, {})
    if found is None:
        raise StrayError(f"{function.__name__} of {kinds}")
    return function.overloads[tuple(found.args)]


def is_whole(kind: Any) -> bool:
    """Whether it is the type of an integer of 64 bits, or of one that is known."""
    return kind == types.int64 or isinstance(kind, types.IntegerLiteral)


class Values:
    """Instructions at the end of a block; StrayError where there are none for values of a type."""

    def __init__(self, context: Any, builder: Any) -> None:
        self._context = context
        self._builder = builder

    def cast(self, value: Typed, kind: Any = types.float64) -> Any:
        """A value as one of another type."""
        if value[0] == kind:
            return value[1]
        if kind == types.float64 and isinstance(value[0], types.IntegerLiteral):
            return DOUBLE(float(value[0].literal_value))
        if kind == types.float64 and is_whole(value[0]):
            return self._builder.sitofp(value[1], DOUBLE)
        try:
            return self._context.cast(self._builder, value[1], value[0], kind)
        except NotImplementedError as error:
            raise StrayError(error) from None

    def unified(self, first: Any, second: Any) -> Any:
        """The type for values of either type; StrayError where there is none."""
        if first == second:
            return types.unliteral(first)
        kind = self._context.typing_context.unify_types(types.unliteral(first), types.unliteral(second))
        if kind is None or not kind.is_precise():
            raise StrayError(f"{first} and {second}")
        return kind

    def constant(self, value: Any) -> Typed:
        """A constant of the text, or what a global name means."""
        if isinstance(value, bool):
            return types.boolean, BIT(value)
        if type(value) is int and abs(value) < 1 << 63:
            return types.literal(value), self._context.get_constant(types.intp, value)
        if isinstance(value, float):
            return types.float64, DOUBLE(value)
        if isinstance(value, str):  # for what reads it when it is compiled
            return types.literal(value), self._context.get_dummy_value()
        kind = self._context.typing_context.resolve_value_type(value)
        if kind is None:
            raise StrayError(f"a constant {type(value).__name__}")
        return kind, self._context.get_constant_generic(self._builder, kind, value)

    def field(self, value: Typed, name: str) -> Typed:
        """A field of a record, or what numba knows of another value."""
        kind = self._context.typing_context.resolve_getattr(value[0], name)
        if kind is None or isinstance(kind, types.Callable):
            raise StrayError(f"{name} of {value[0]}")
        code = self._context.get_getattr(value[0], name)
        return kind, code(self._context, self._builder, value[0], value[1], name)

    def combined(self, operation: type, left: Typed, right: Typed) -> Typed:
        """The result of an operator of Python's."""
        whole = is_whole(left[0]), is_whole(right[0])
        if all(whole) and operation in WHOLE_ARITHMETIC:
            emit = getattr(self._builder, WHOLE_ARITHMETIC[operation])
            return types.int64, emit(left[1], right[1], flags=_NO_OVERFLOW)
        floats = left[0] == types.float64 or whole[0], right[0] == types.float64 or whole[1]
        if all(floats) and operation in FLOAT_ARITHMETIC:
            return types.float64, getattr(self._builder, FLOAT_ARITHMETIC[operation])(self.cast(left), self.cast(right))
        if operation is ast.Pow and left[0] == types.float64 and isinstance(right[0], types.IntegerLiteral):
            return types.float64, self._power(left[1], right[0].literal_value)
        if operation not in _OPERATORS:
            raise StrayError(operation.__name__)
        return self.result(_OPERATORS[operation], [left, right])

    def _power(self, value: Any, exponent: int) -> Any:
        """A float to a whole power, by squares of squares, as numba takes it."""
        found, left = DOUBLE(1.0), abs(exponent)
        while left:
            if left % 2:
                found = self._builder.fmul(found, value)
            value, left = self._builder.fmul(value, value), left // 2
        return self._builder.fdiv(DOUBLE(1.0), found) if exponent < 0 else found

    def related(self, relation: type, left: Typed, right: Typed) -> Any:
        """Whether two numbers are so related, one bit."""
        if relation not in RELATIONS:
            raise StrayError(relation.__name__)
        if is_whole(left[0]) and is_whole(right[0]):
            return self._builder.icmp_signed(RELATIONS[relation], left[1], right[1])
        if not all(kind in (types.float64, types.boolean) or is_whole(kind) for kind, _ in (left, right)):
            raise StrayError(f"{left[0]} and {right[0]}")
        if left[0] == right[0] == types.boolean:
            return self._builder.icmp_unsigned(RELATIONS[relation], left[1], right[1])
        compare = self._builder.fcmp_unordered if relation is ast.NotEq else self._builder.fcmp_ordered
        return compare(RELATIONS[relation], self.cast(left), self.cast(right))

    def joined(self, kind: Any, values: Sequence[tuple[Any, Any]]) -> Any:
        """The value of the block that came before."""
        value = self._builder.phi(kind)
        for each, block in values:
            value.add_incoming(each, block)
        return value

    def together(self, values: Sequence[Typed]) -> Typed:
        """A tuple of values."""
        kind = types.BaseTuple.from_types(tuple(types.unliteral(each) for each, _ in values))
        return kind, self._context.make_tuple(self._builder, kind, [value for _, value in values])

    def part(self, value: Typed, k: int) -> Typed:
        """An item of a tuple."""
        kinds = list(value[0])
        return kinds[k], self._builder.extract_value(value[1], k % len(kinds))

    def place(self, base: Typed, where: Sequence[Typed]) -> Any:
        """Where an item stands, None where numba is to say: at a pointer, or in a C-contiguous array."""
        kind, value = base
        if isinstance(kind, types.CPointer) and len(where) == 1:
            return self._builder.gep(value, [where[0][1]])
        if not isinstance(kind, types.Array) or kind.ndim != len(where) or kind.layout != "C":
            return None
        array = self._context.data_model_manager[kind]  # numba's own struct would stand in memory, and take a look-up
        lengths = cgutils.unpack_tuple(self._builder, array.get(self._builder, value, "shape"), kind.ndim)
        place = WORD(0)
        for k, (index, length) in enumerate(zip(where, lengths, strict=True)):
            turn = self._counted(index, length)
            place = self._builder.add(self._builder.mul(place, length), turn) if k else turn
        return self._builder.gep(array.get(self._builder, value, "data"), [place])

    def _counted(self, index: Typed, length: Any) -> Any:
        """An index from the beginning, where it may be one from the end."""
        kind, value = index
        if isinstance(kind, types.IntegerLiteral):
            return value if kind.literal_value >= 0 else self._builder.add(length, value)
        behind = self._builder.icmp_signed("<", value, WORD(0))
        return self._builder.select(behind, self._builder.add(value, length), value)

    def loaded(self, kind: Any, place: Any) -> Typed:
        """The value of this type at a place."""
        if kind in (types.float64, types.int64):
            return kind, self._builder.load(place)
        return kind, self._context.unpack_value(self._builder, kind, place)

    def stored(self, kind: Any, value: Typed, place: Any) -> None:
        """A value goes to a place, as this type."""
        if kind in (types.float64, types.int64):
            self._builder.store(self.cast(value, kind), place)
        else:
            self._context.pack_value(self._builder, kind, self.cast(value, kind), place)

    def extreme(self, relation: type, values: Sequence[Typed]) -> Typed:
        """The least or the greatest of numbers, the first of those that are no less or no greater."""
        kind = reduce(self.unified, (each for each, _ in values))
        found = self.cast(values[0], kind)
        for each in values[1:]:
            value = self.cast(each, kind)
            found = self._builder.select(self.related(relation, (kind, value), (kind, found)), value, found)
        return kind, found

    def result(self, function: Any, arguments: Sequence[Typed]) -> Typed:
        """What a function of Python's gives, as numba has it."""
        return self.result_of(self._context.typing_context.resolve_value_type(function), arguments)

    def result_of(self, kind: Any, arguments: Sequence[Typed]) -> Typed:
        """What a function of this type gives."""
        if isinstance(kind, types.Dispatcher):
            return self._jitted(kind.dispatcher, arguments)
        if not isinstance(kind, types.Callable):
            raise StrayError(f"a call of {kind}")
        found = _resolved(self._context.typing_context, kind, tuple(each for each, _ in arguments))
        if found is None or not all(isinstance(each, types.Omitted) for each in found.args[len(arguments) :]):
            raise StrayError(f"{kind} of {[each for each, _ in arguments]}")
        code = self._context.get_function(kind, found)
        self._context.add_linking_libs(getattr(code, "libs", ()))
        values = [self.cast(each, wanted) for each, wanted in zip(arguments, found.args, strict=False)]
        left_out = [self._context.get_dummy_value() for _ in found.args[len(arguments) :]]
        return found.return_type, code(self._builder, [*values, *left_out])

    def _jitted(self, function: Any, arguments: Sequence[Typed]) -> Typed:
        """A call of a jitted function; whether it raised something is asked only where it may have."""
        made = _overload(self._context.typing_context, function, tuple(types.unliteral(kind) for kind, _ in arguments))
        found = made.signature
        if len(found.args) != len(arguments):
            raise StrayError(f"{function.__name__} of {len(arguments)} arguments")
        self._context.add_linking_libs((made.library,))
        values = [self.cast(each, wanted) for each, wanted in zip(arguments, found.args, strict=True)]
        if (made.metadata or {}).get(RAISES, True):
            return found.return_type, self._context.call_internal(self._builder, made.fndesc, found, values)
        _, result = self._context.call_internal_no_propagate(self._builder, made.fndesc, found, values)
        return found.return_type, result
