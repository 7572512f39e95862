"""Machine code of what follows a series: the length of the step that it allows, and the states at a time within it."""

from typing import Any

from llvmlite import ir

from qddot.runner.machine.series_memory import Memory
from qddot.runner.machine.vector_code import INTEGER, SCALAR, VectorCode

#: Doubles of the vectors that a polynomial is summed in, those of a row: rows of states are padded to as many.
WIDE = 8
#: Vectors of states that a polynomial is summed for at once, two registers each with AVX2; up to so many of them wait
#: for each other less where even and odd orders are summed apart. Vectors of states that are sized without a loop.
_SUMS, _APART, _WRITTEN_OUT = 7, 3, 8
_POINTER = SCALAR.as_pointer()
#: Bits of a double: of infinity, of 1, of the root of 1/2, of a mantissa, of what makes a whole number a double.
_INFINITE, _ONE, _ROOT, _MANTISSA = 0x7FF << 52, 0x3FF << 52, 0x3FE6A09E667F3BCD, (1 << 52) - 1
_WHOLE, _FRACTION = 0x433 << 52, 1.5 * 2.0**52
#: log2(1 + f) between the roots of 1/2 and 2 to 7e-4, and 2^f up to 1/2 to 8e-5: three digits of a step.
_LOG2 = (0.000583, 1.445644, -0.760965, 0.447595)
_EXP2 = (0.999928073, 0.693261056, 0.24261117, 0.0551714178)


def kinds_of_step(row: int) -> tuple[Any, list[Any]]:
    """What `emit_step`'s function returns and takes, where a number is a row of so many doubles."""
    kinds = [_POINTER, INTEGER, INTEGER, INTEGER, SCALAR, SCALAR]
    return (SCALAR, kinds) if row == 1 else (ir.VoidType(), [*kinds, _POINTER])


def emit_step(function: ir.Function, memory: Memory, states: int, width: int, lanes: int) -> None:
    """step(memory, order, relative, absolute, rtol, decay): the step that the last two coefficients allow.

    Each is taken relative to its state, or to where the absolute tolerance takes over; relative, absolute: addresses of
    these (states,), in one run as long as its rows of states; rtol: the least of all. 0 where one is no number,
    infinite where all vanish. A row of steps is written to where one more argument says.
    """
    code = VectorCode(ir.IRBuilder(function.append_basic_block()), width, lanes)
    both = VectorCode(code.builder, 2, lanes)
    builder, (_, order, *_, decay) = code.builder, function.args[:6]
    before, last = _sizes(code, memory, states, function.args)
    sizes = _largest(code, before, last)
    high = _larger(builder, sizes, both.shuffle(sizes, sizes, [1, 0]))
    whole = builder.sitofp(order, SCALAR)
    parts = [builder.fdiv(SCALAR(1.0), each) for each in (builder.fsub(whole, SCALAR(1.0)), whole)]
    item = VectorCode(builder, 1, lanes)
    roots = both.multiply(_log2(both, sizes), both.beside([item.splat(part) for part in parts]))
    swapped = both.shuffle(roots, roots, [1, 0])
    larger = builder.select(builder.fcmp_ordered(">", roots, swapped), roots, swapped)
    step = _exp2(both, both.subtract(both.splat(decay), larger))
    step = builder.select(builder.icmp_signed("<", high, both.whole(_INFINITE)), step, both.zero)
    step = builder.select(builder.icmp_signed("==", high, both.whole(0)), both.splat(float("inf")), step)
    if lanes == 1:
        builder.ret(builder.extract_element(step, ir.IntType(32)(0)))
    else:
        item.store_to(function.args[6], both.part(step, 0, item))
        builder.ret_void()


def _sizes(code: VectorCode, memory: Memory, states: int, arguments: Any) -> tuple[Any, Any]:
    """Bits of the largest coefficients of the last two orders in vectors; they rise with them, and to no number."""
    builder, row, stride = code.builder, memory.row, memory.state_stride
    _, order, *addresses, rtol, _ = arguments[:6]
    rows = [builder.inttoptr(address, _POINTER) for address in addresses]
    orders = builder.sub(order, INTEGER(1)), order
    count = -(-states // code.width)

    def larger(index: Any, found: Any) -> list[Any]:
        first = builder.mul(index, INTEGER(code.width))
        tolerances = []
        for where in rows:
            place = builder.gep(where, [first])
            tolerances.append(code.load_from(place) if row == 1 else code.splat(builder.load(place)))
        now = code.intrinsic("fabs", code.load(memory.states, first, row))
        least = code.multiply(tolerances[0], now)
        least = builder.select(builder.fcmp_ordered(">", least, tolerances[1]), least, tolerances[1])
        scale = code.divide(code.splat(rtol), least)
        taken = []
        for k, total in zip(orders, found, strict=True):
            place = builder.add(builder.mul(k, INTEGER(stride)), builder.mul(first, INTEGER(row)))
            size = code.intrinsic("fabs", code.multiply(code.load(memory.states, place, 1), scale))
            taken.append(_larger(builder, builder.bitcast(size, total.type), total))
        return taken

    found = [code.whole(0), code.whole(0)]
    if count <= _WRITTEN_OUT:
        for index in range(count):
            found = larger(INTEGER(index), found)
        return found[0], found[1]
    with code.loop(INTEGER(0), INTEGER(count), found) as (index, totals, after):
        after.extend(larger(index, totals))
    return after[0], after[1]


def _largest(code: VectorCode, before: Any, last: Any) -> Any:
    """Of each of two vectors the largest item, side by side."""
    half = code.size
    found = code.doubles(before, last, range(2 * half))
    while half > code.lanes:
        half //= 2
        lower, upper = (
            code.doubles(found, found, [*range(far, far + half), *range(2 * half + far, 3 * half + far)])
            for far in (0, half)
        )
        found = _larger(code.builder, lower, upper)
    return found


def _larger(builder: Any, a: Any, b: Any) -> Any:
    return builder.select(builder.icmp_signed(">", a, b), a, b)


def _log2(code: VectorCode, bits: Any) -> Any:
    """The logarithms of doubles with these bits, positive ones; of 0 and of subnormal ones some -1023."""
    builder = code.builder
    moved = builder.add(bits, code.whole(_ONE - _ROOT))
    exponent = builder.or_(builder.lshr(moved, code.whole(52)), code.whole(_WHOLE))
    mantissa = builder.add(builder.and_(moved, code.whole(_MANTISSA)), code.whole(_ROOT))
    f = code.subtract(builder.bitcast(mantissa, code.vector), code.splat(1.0))
    e = code.subtract(builder.bitcast(exponent, code.vector), code.splat(2.0**52 + 1023.0))
    return code.add(e, code.polynomial(f, _LOG2))


def _exp2(code: VectorCode, y: Any) -> Any:
    """Powers of 2, |y| < 1000."""
    builder = code.builder
    shifted = code.add(y, code.splat(_FRACTION))
    f = code.subtract(y, code.subtract(shifted, code.splat(_FRACTION)))
    bits = builder.bitcast(shifted, ir.VectorType(INTEGER, code.size))
    raised = builder.add(builder.bitcast(code.polynomial(f, _EXP2), bits.type), builder.shl(bits, code.whole(52)))
    return builder.bitcast(raised, code.vector)


def emit_polynomial(function: ir.Function, memory: Memory, states: int, width: int, lanes: int) -> None:
    """polynomial(memory, order, time, target): the states at a time from where the series stands, all padding too.

    By Horner's rule from the highest order down; of few states even and odd orders apart, with the time squared, and in
    vectors as they were written: wider ones would have to wait until these are in the cache.
    """
    alone = memory.row == 1
    wide = VectorCode(ir.IRBuilder(function.append_basic_block()), *((WIDE, 1) if alone else (1, lanes)))
    builder, (_, order, time, target) = wide.builder, function.args
    if alone and states <= min(WIDE, _APART * width):
        code = VectorCode(builder, width)
        places = [memory.states + i for i in range(0, states, width)]
        wide.store_to(target, wide.beside(_sums_apart(code, memory, places, order, code.splat(time))))
    else:
        factor = wide.splat(time) if alone else wide.load_from(time)
        count = memory.state_stride // WIDE
        for start in range(0, count, _SUMS):
            places = [memory.states + i * WIDE for i in range(start, min(start + _SUMS, count))]
            for i, value in enumerate(_sums(wide, memory, places, order, factor), start):
                wide.store_to(builder.gep(target, [INTEGER(i * WIDE)]), value)
    builder.ret_void()


def _sums(code: VectorCode, memory: Memory, places: list[int], order: Any, factor: Any) -> list[Any]:
    builder, stride = code.builder, memory.state_stride
    tops = [code.load(place, order, stride) for place in places]
    with code.loop(INTEGER(0), order, tops) as (index, totals, after):
        k = builder.sub(builder.sub(order, INTEGER(1)), index)
        for place, total in zip(places, totals, strict=True):
            after.append(code.multiply_add(total, factor, code.load(place, k, stride)))
    return after


def _sums_apart(code: VectorCode, memory: Memory, places: list[int], order: Any, factor: Any) -> list[Any]:
    """The same, the highest order and each second one below it apart from the others; of an even one x_0 is last."""
    builder, stride = code.builder, memory.state_stride
    one, two = INTEGER(1), INTEGER(2)
    squared = code.multiply(factor, factor)
    tops = [code.load(place, builder.sub(order, back), stride) for back in (INTEGER(0), one) for place in places]
    with code.loop(one, builder.sdiv(builder.add(order, one), two), tops) as (index, totals, after):
        k = builder.sub(order, builder.mul(index, two))
        terms = [code.load(place, builder.sub(k, back), stride) for back in (INTEGER(0), one) for place in places]
        after.extend(code.multiply_add(total, squared, term) for total, term in zip(totals, terms, strict=True))
    upper, lower = after[: len(places)], after[len(places) :]
    found = [code.multiply_add(a, factor, b) for a, b in zip(upper, lower, strict=True)]
    even = builder.icmp_signed("==", builder.and_(order, one), INTEGER(0))
    first = [code.multiply_add(value, factor, code.load(place)) for value, place in zip(found, places, strict=True)]
    return [builder.select(even, a, b) for a, b in zip(first, found, strict=True)]
