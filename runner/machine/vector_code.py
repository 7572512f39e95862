"""LLVM's instructions for vectors of doubles of one width, as the emitter of series writes them.

A vector holds `width` items side by side. In lanes it holds one, of as many runs as there are lanes.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from llvmlite import ir

SCALAR, INTEGER = ir.DoubleType(), ir.IntType(64)
#: Contraction to fused multiply-add, zeros without a sign: the arithmetic of everything compiled.
_FLAGS = ("contract", "nsz")
#: Beyond, sines and cosines are those of the C library.
_FAR = 1e6


class VectorCode:
    """Instructions at the end of a block of one function, whose first argument is where its memory begins.

    width: items of a vector; lanes: doubles of an item, one a run. size: doubles of a vector.
    """

    def __init__(self, builder: ir.IRBuilder, width: int, lanes: int = 1) -> None:
        self.builder = builder
        self.width, self.lanes, self.size = width, lanes, width * lanes
        self.vector = ir.VectorType(SCALAR, self.size)
        self.memory = builder.function.args[0]
        self.zero = self.constant([0.0] * width)

    def constant(self, values: Sequence[float]) -> Any:
        """A vector of numbers, the same in all lanes; what is missing is 0."""
        numbers = [float(value) for value in values for _ in range(self.lanes)]
        return ir.Constant(self.vector, numbers + [0.0] * (self.size - len(numbers)))

    def splat(self, value: Any) -> Any:
        """A vector of one value."""
        if isinstance(value, float):
            return self.constant([value] * self.width)
        first = self.builder.insert_element(ir.Constant(self.vector, ir.Undefined), value, ir.IntType(32)(0))
        return self.doubles(first, first, [0] * self.size)

    def whole(self, number: int) -> Any:
        """A vector of one whole number, as long as one of doubles."""
        return ir.Constant(ir.VectorType(INTEGER, self.size), [number] * self.size)

    def shuffle(self, a: Any, b: Any, places: Sequence[int]) -> Any:
        """Items of a, and from `width` on of b."""
        return self.doubles(a, b, [place * self.lanes + lane for place in places for lane in range(self.lanes)])

    def doubles(self, a: Any, b: Any, places: Sequence[int]) -> Any:
        """These doubles of two vectors, one behind the other."""
        return self.builder.shuffle_vector(a, b, ir.Constant(ir.VectorType(ir.IntType(32), len(places)), list(places)))

    def beside(self, parts: Sequence[Any]) -> Any:
        """Shorter vectors side by side in one of this width, zeros behind them."""
        found = list(parts)
        while found[0].type != self.vector:
            size = found[0].type.count
            found += [ir.Constant(found[0].type, [0.0] * size)] * (len(found) % 2)
            found = [self.doubles(a, b, range(2 * size)) for a, b in zip(found[::2], found[1::2], strict=True)]
        return found[0]

    def part(self, value: Any, place: int, shorter: "VectorCode") -> Any:
        """The vector at a place among shorter ones side by side."""
        if shorter.size == self.size:
            return value
        return self.doubles(value, value, range(place * shorter.size, (place + 1) * shorter.size))

    def add(self, a: Any, b: Any) -> Any:
        """Give a + b."""
        return self.builder.fadd(a, b, flags=_FLAGS)

    def subtract(self, a: Any, b: Any) -> Any:
        """Give a - b."""
        return self.builder.fsub(a, b, flags=_FLAGS)

    def multiply(self, a: Any, b: Any) -> Any:
        """Give a * b."""
        return self.builder.fmul(a, b, flags=_FLAGS)

    def divide(self, a: Any, b: Any) -> Any:
        """Give a / b."""
        return self.builder.fdiv(a, b, flags=_FLAGS)

    def multiply_add(self, a: Any, b: Any, c: Any) -> Any:
        """Give a * b + c; c may be None."""
        product = self.multiply(a, b)
        return product if c is None else self.add(product, c)

    def sum(self, values: Sequence[Any]) -> Any:
        """The sum of vectors, in pairs."""
        found = list(values)
        while len(found) > 1:
            pairs = [self.add(a, b) for a, b in zip(found[::2], found[1::2], strict=False)]
            found = pairs + found[2 * len(pairs) :]
        return found[0] if found else self.zero

    def address(self, offset: int) -> Any:
        """The pointer to an offset in doubles."""
        return self._place(offset, None, 1)

    def _place(self, offset: int, index: Any, stride: int) -> Any:
        where = INTEGER(offset)
        if index is not None:
            where = self.builder.add(self.builder.mul(index, INTEGER(stride)), where)
        return self.builder.gep(self.memory, [where])

    def load(self, offset: int, index: Any = None, stride: int | None = None) -> Any:
        """The vector at an offset in doubles, and `index` strides further."""
        return self.load_from(self._place(offset, index, self.size if stride is None else stride))

    def store(self, value: Any, offset: int, index: Any = None, stride: int | None = None) -> None:
        """Write a vector there."""
        self.store_to(self._place(offset, index, self.size if stride is None else stride), value)

    def store_to(self, where: Any, value: Any) -> None:
        """Write a vector to a pointer."""
        self.builder.store(value, self.builder.bitcast(where, self.vector.as_pointer()), align=8)

    def load_from(self, where: Any) -> Any:
        """The vector at a pointer."""
        return self.builder.load(self.builder.bitcast(where, self.vector.as_pointer()), align=8)

    def load_scalar(self, offset: int) -> Any:
        """The double at an offset."""
        return self.builder.load(self._place(offset, None, 1))

    def load_number(self, offset: int) -> Any:
        """The number at an offset beside itself; in lanes that of each run."""
        return self.splat(self.load_scalar(offset)) if self.lanes == 1 else self.load(offset)

    @contextmanager
    def loop(self, start: Any, end: Any, carried: Sequence[Any]) -> Iterator[tuple[Any, list[Any], list[Any]]]:
        """A loop from start to end - 1: its index, the values carried so far, and a list for those carried on.

        The list holds what was carried when the loop has ended; nothing happens where end <= start.
        """
        before, body, behind = (self.builder.block, *(self.builder.append_basic_block() for _ in range(2)))
        self.builder.cbranch(self.builder.icmp_signed("<", start, end), body, behind)
        self.builder.position_at_end(body)
        index = self.builder.phi(INTEGER)
        held = [self.builder.phi(value.type) for value in carried]
        after: list[Any] = []
        yield index, held, after
        following = self.builder.add(index, INTEGER(1))
        last = self.builder.block
        self.builder.cbranch(self.builder.icmp_signed("<", following, end), body, behind)
        for phi, first, other in zip([index, *held], [start, *carried], [following, *after], strict=True):
            phi.add_incoming(first, before)
            phi.add_incoming(other, last)
        self.builder.position_at_end(behind)
        ended = []
        for first, other in zip(carried, after, strict=True):
            phi = self.builder.phi(first.type)
            phi.add_incoming(first, before)
            phi.add_incoming(other, last)
            ended.append(phi)
        after[:] = ended

    def either(self, sound: Any, rows: list[list[Any]], otherwise: Callable[[], list[list[Any]]]) -> list[list[Any]]:
        """Rows of vectors where something holds, and others, written where it does not."""
        before, apart, behind = (self.builder.block, *(self.builder.append_basic_block() for _ in range(2)))
        self.builder.cbranch(sound, behind, apart)
        self.builder.position_at_end(apart)
        others = otherwise()
        last = self.builder.block
        self.builder.branch(behind)
        self.builder.position_at_end(behind)
        found = []
        for row, other in zip(rows, others, strict=True):
            found.append([self.builder.phi(self.vector) for _ in row])
            for phi, one, another in zip(found[-1], row, other, strict=True):
                phi.add_incoming(one, before)
                phi.add_incoming(another, last)
        return found

    def intrinsic(self, name: str, *values: Any) -> Any:
        """LLVM's function of this name for vectors."""
        whole = f"llvm.{name}.v{self.size}f64"
        return self.builder.call(self._function(whole, self.vector, len(values)), values)

    def _function(self, name: str, kind: Any, count: int) -> Any:
        module = self.builder.module
        return module.globals.get(name) or ir.Function(module, ir.FunctionType(kind, [kind] * count), name)

    def each(self, name: str, *values: Any) -> Any:
        """The C library's function of each item."""
        function, result = self._function(name, SCALAR, len(values)), ir.Constant(self.vector, ir.Undefined)
        for place in map(ir.IntType(32), range(self.size)):
            items = [self.builder.extract_element(value, place) for value in values]
            result = self.builder.insert_element(result, self.builder.call(function, items), place)
        return result

    def sine_and_cosine(self, x: Any) -> tuple[Any, Any]:
        """Both of each item; far from zero those of the C library."""
        near, far, behind = (self.builder.append_basic_block() for _ in range(3))
        integers = ir.VectorType(ir.IntType(1), self.size)
        beyond = self.builder.fcmp_unordered(">", self.intrinsic("fabs", x), self.splat(_FAR))
        bits = ir.IntType(self.size)
        any_far = self.builder.icmp_unsigned("!=", self.builder.bitcast(beyond, bits), bits(0))
        assert beyond.type == integers
        self.builder.cbranch(any_far, far, near)
        self.builder.position_at_end(far)
        distant = self.each("sin", x), self.each("cos", x)
        self.builder.branch(behind)
        self.builder.position_at_end(near)
        close = self._near_sine_and_cosine(x)
        self.builder.branch(behind)
        self.builder.position_at_end(behind)
        found = []
        for one, other in zip(distant, close, strict=True):
            phi = self.builder.phi(self.vector)
            phi.add_incoming(one, far)
            phi.add_incoming(other, near)
            found.append(phi)
        return found[0], found[1]

    def _near_sine_and_cosine(self, x: Any) -> tuple[Any, Any]:
        """By polynomials in what is left beside quarter turns (fdlibm, as `elementary` has it)."""
        turns = self.intrinsic("rint", self.multiply(x, self.splat(2 / math.pi)))
        back = self.builder.fneg(turns)
        rest = x
        for part in (1.5707963267341256, 6.077100506303966e-11, 2.0222662487959506e-21):
            rest = self.multiply_add(back, self.splat(part), rest)
        z = self.multiply(rest, rest)
        sine = self.multiply_add(self.multiply(z, rest), self.polynomial(z, _SINE), rest)
        half = self.multiply_add(z, self.splat(-0.5), self.splat(1.0))
        cosine = self.multiply_add(self.multiply(z, z), self.polynomial(z, _COSINE), half)
        integers, whole = ir.VectorType(INTEGER, self.size), self.whole
        quarter = self.builder.fptosi(turns, integers)
        even = self.builder.icmp_signed("==", self.builder.and_(quarter, whole(1)), whole(0))
        found = []
        for straight, turned, shift in ((sine, cosine, 0), (cosine, sine, 1)):
            value = self.builder.select(even, straight, turned)
            sign = self.builder.shl(self.builder.and_(self.builder.add(quarter, whole(shift)), whole(2)), whole(62))
            signed = self.builder.xor(self.builder.bitcast(value, integers), sign)
            found.append(self.builder.bitcast(signed, self.vector))
        return found[0], found[1]

    def polynomial(self, x: Any, coefficients: Sequence[float]) -> Any:
        """Sum of coefficients[i] x^i by Estrin's rule: pairs beside each other, so that few wait for others."""
        found, power = [self.splat(each) for each in coefficients], x
        while len(found) > 1:
            pairs = [found[i : i + 2] for i in range(0, len(found), 2)]
            found = [self.multiply_add(power, pair[1], pair[0]) if len(pair) == 2 else pair[0] for pair in pairs]
            power = self.multiply(power, power)
        return found[0]


_SINE = (
    *(-1.66666666666666324348e-01, 8.33333333332248946124e-03, -1.98412698298579493134e-04),
    *(2.75573137070700676789e-06, -2.50507602534068634195e-08, 1.58969099521155010221e-10),
)
_COSINE = (
    *(4.16666666666666019037e-02, -1.38888888888741095749e-03, 2.48015872894767294178e-05),
    *(-2.75573143513906633035e-07, 2.08757232129817482790e-09, -1.13596475577881948265e-11),
)
