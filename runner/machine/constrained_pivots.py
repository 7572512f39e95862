"""M a + G' l = f, G a = gamma of few coordinates: elimination written out for their number, where its pivots are sound.

Rows of [M G'; G 0] are eliminated in their order: pivots of M are positive, and those of constraints, of -G M^-1 G',
negative (Golub & Van Loan, Matrix Computations, section 4.1; such a matrix has LDL' in this order whenever M is
positive definite and constraints are independent). How much of what stood on the diagonal a pivot keeps tells how far
that is from failing.
"""

from collections.abc import Sequence
from functools import cache
from importlib import import_module
from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from qddot.runner.abi import MATRIX, VECTOR
from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.memory import BY_ADDRESS
from qddot.runner.machine.pointers import call_named, calling, pointer
from qddot.runner.machine.sums import multiply_add, splat

#: The part of what stood on the diagonal that a pivot must keep to count as sound: constraints are some thousandths of
#: a right angle apart then, and accelerations lose five digits at most.
SOUND = 1e-5
#: Accelerations and multipliers up to which elimination is written out.
MOST_WRITTEN_OUT = 20
#: What solves with care, by its name, and its signature.
CAREFUL = "qddot.runner.machine.constrained.accelerations"
SIGNATURE = types.void(MATRIX, MATRIX, VECTOR, VECTOR, VECTOR, VECTOR)
_SCALAR, _PLACE = ir.DoubleType(), ir.IntType(32)
#: Numbers side by side.
_WIDTH = 4
_VECTOR = ir.VectorType(_SCALAR, _WIDTH)
Row = list[Any]


@intrinsic(prefer_literal=True)
def solved(typing_context: Any, n: Any, m: Any, M: Any, G: Any, right: Any, residuals: Any, q: Any, work: Any) -> Any:
    """As `accelerations(M, G, right, residuals, q, work)` where nothing asks for factors; n, m: written numbers."""
    sizes = n.literal_value, m.literal_value

    def emit(context: Any, builder: Any, own: Any, given: Any) -> Any:
        def take_care() -> None:
            call_named(builder, CAREFUL, SIGNATURE, given[2:])

        if sum(sizes) > MOST_WRITTEN_OUT:
            take_care()
            return context.get_dummy_value()
        pairs = list(zip(own.args[2:5], given[2:5], strict=True))
        places = [context.make_array(kind)(context, builder, array).data for kind, array in pairs]
        sound, found = _Elimination(builder, *sizes, *places).solve()
        with builder.if_else(sound) as (then, careful):
            with then:
                for i, value in enumerate(found):
                    builder.store(value, builder.gep(places[-1], [_PLACE(i)]))
            with careful:
                take_care()
        return context.get_dummy_value()

    return types.void(n, m, M, G, right, residuals, q, work), emit


@cache
def solver(n: int, m: int) -> int:
    """The address of `solved` for so many, as compiled code calls it: (M, G, right, residuals, q, work)."""
    import_module("qddot.runner.machine.constrained")  # which makes CAREFUL known

    def solve(M, G, right, residuals, q, work):  # type: ignore[no-untyped-def]
        solved(n, m, M, G, right, residuals, q, work)

    return pointer(compiled(SIGNATURE, **BY_ADDRESS)(solve), SIGNATURE, "solve")


call_solver = calling(SIGNATURE)


class _Elimination:
    """Instructions that solve for n accelerations and m multipliers, at the end of a block.

    masses: pointer to M (n, n), its lower half; gradients: to G (m, n); right: to [f, gamma] (n + m,).
    """

    def __init__(self, builder: ir.IRBuilder, n: int, m: int, masses: Any, gradients: Any, right: Any) -> None:
        self._builder, self._n, self._size = builder, n, n + m
        self._masses, self._gradients, self._right = masses, gradients, right

    def solve(self) -> tuple[Any, Sequence[Any]]:
        """Whether all pivots are sound, and the solution."""
        builder, n = self._builder, self._n
        rows = [self._row(i) for i in range(self._size)]
        sound: Any = ir.Constant(ir.IntType(1), 1)
        scaled: list[Row] = []
        absent: list[Any] = []
        for first, last, order in ((0, n, ">"), (n, self._size, "<")):
            whole = [self._item(row, i) for i, row in enumerate(rows)]
            for k in range(first, last):
                pivot = self._item(rows[k], k)
                if k >= n:  # a contact that does not rest says nothing: its gradient is zero
                    absent.append(builder.fcmp_ordered("==", whole[k], _SCALAR(0.0)))
                    pivot = builder.select(absent[-1], _SCALAR(-1.0), pivot)
                least = builder.fmul(_SCALAR(SOUND), whole[k])
                sound = builder.and_(sound, builder.fcmp_ordered(order, pivot, least))
                scaled.append(self._eliminated(rows, k, pivot))
        found = self._substituted(scaled)
        multipliers = [builder.select(each, _SCALAR(0.0), x) for each, x in zip(absent, found[n:], strict=True)]
        return sound, [*found[:n], *multipliers]

    def _row(self, i: int) -> Row:
        """Row i of the upper half, with its right side, in vectors; zeros before the diagonal."""
        items = [self._entry(i, j) if j >= i else None for j in range(self._size)]
        items.append(self._load(self._right, i))
        items += [None] * (-len(items) % _WIDTH)
        return [self._vector(items[k : k + _WIDTH]) for k in range(0, len(items), _WIDTH)]

    def _entry(self, i: int, j: int) -> Any:
        """What stands in row i, column j >= i; None for what is zero by its place."""
        if j < self._n:
            return self._load(self._masses, j * self._n + i)
        return self._load(self._gradients, (j - self._n) * self._n + i) if i < self._n else None

    def _load(self, where: Any, place: int) -> Any:
        return self._builder.load(self._builder.gep(where, [_PLACE(place)]))

    def _vector(self, items: Sequence[Any]) -> Any:
        vector: Any = ir.Constant(_VECTOR, [0.0] * _WIDTH)
        for k, item in enumerate(items):
            vector = vector if item is None else self._builder.insert_element(vector, item, _PLACE(k))
        return vector

    def _item(self, row: Row, k: int) -> Any:
        return self._builder.extract_element(row[k // _WIDTH], _PLACE(k % _WIDTH))

    def _eliminated(self, rows: list[Row], k: int, pivot: Any) -> Row:
        """Take column k out of the rows below; returns row k over its pivot."""
        builder = self._builder
        inverse = splat(builder, builder.fdiv(_SCALAR(1.0), pivot), _WIDTH)
        scaled = [builder.fmul(part, inverse) for part in rows[k]]
        for i in range(k + 1, self._size):
            factor = splat(builder, builder.fneg(self._item(scaled, i)), _WIDTH)
            for b in range(i // _WIDTH, len(scaled)):
                rows[i][b] = multiply_add(builder, factor, rows[k][b], rows[i][b])
        return scaled

    def _substituted(self, scaled: list[Row]) -> Sequence[Any]:
        """The solution, from the last row upward."""
        found = [self._item(row, self._size) for row in scaled]
        for i in range(self._size - 1, 0, -1):
            back = self._builder.fneg(found[i])
            for k in range(i):
                found[k] = multiply_add(self._builder, self._item(scaled[k], i), back, found[k])
        return found
