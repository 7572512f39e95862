"""Sums over lower orders, of A_j B_{k-j} for 0 <= j <= k: nearly all of the cost of a series.

The terms with 0 < j < k come from memory, where the coefficients of all orders stand as histories. Vectors of sums are
as wide there as a register, whatever is side by side elsewhere: a wide vector has the sums of several groups of nodes.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from qddot.runner.machine.packing import Group
from qddot.runner.machine.recurrences import FUNCTIONS
from qddot.runner.machine.series_histories import Emitter, Histories, History, Operand
from qddot.runner.machine.vector_code import INTEGER

#: For each rule its sums, as columns of its arguments: A, B, how A is taken (see `Operand`), and whether A_0 B_k
#: belongs to it; OWN: the node itself.
OWN = -1
SUMS = {
    **dict.fromkeys(("product", "square"), ((0, 1, "", True),)),
    "lagging": ((0, 1, "", False),),
    "rate": ((0, 1, "next", True),),
    "quotient": ((1, OWN, "", False),),
    "power": ((0, OWN, "counted", False), (0, OWN, "", False)),
    **dict.fromkeys(FUNCTIONS, ((0, 1, "counted", False),)),
    "atan2": ((0, 2, "counted", False), (1, 3, "counted", False)),
}


@dataclass(eq=False)
class _Sum:
    """Sum of A_j B_{k-j}, without A_0 B_k where not `whole`. between: its part 0 < j < k."""

    left: Operand
    right: Operand
    whole: bool
    between: Any = None

    def known_last(self) -> tuple[Operand, Operand]:
        """The operand whose last coefficients are known last, and the other one."""
        pair = self.left, self.right
        return pair if (self.left.late, self.left.depth) >= (self.right.late, self.right.depth) else pair[::-1]


@dataclass(eq=False)
class _Wide:
    """Sums side by side; of each the one operand's history is read from order 1 on, and the other's down to it."""

    sums: list[_Sum]
    rising: History
    falling: History


class Sums:
    """Those of a packing, in one order after the other: `begin`, `add_between`, `ends` of every group, `finish`.

    size: doubles of a vector of sums; at_once: vectors that a loop over lower orders holds in registers; few: doubles
    of all sums up to which what they take of the order before waits in registers, too.
    """

    def __init__(self, emitter: Emitter, size: int, at_once: int, few: int) -> None:
        self._code, self._at_once = emitter.code, at_once
        self._histories = Histories(emitter)
        self._sums = {group.index: self._of(group) for group in emitter.packing.groups if group.live}
        self._wide = self._side_by_side(size // self._code.size)
        self._histories.share()
        self._near = sum(each.rising.code.size for each in self._wide) <= few
        self._waiting = list(dict.fromkeys(each.rising for each in self._wide)) if self._near else []
        self._k: Any = None

    def _of(self, group: Group) -> list[_Sum]:
        found = []
        for left, right, how, whole in SUMS.get(group.kind, ()):
            names = [[node.name if i == OWN else node.arguments[i] for node in group.nodes] for i in (left, right)]
            found.append(_Sum(self._histories.operand(names[0], how), self._histories.operand(names[1], ""), whole))
        return found

    def _side_by_side(self, most: int) -> list[_Wide]:
        """Up to so many sums in a vector; those that wait for unknowns are on their own."""
        sums = [each for found in self._sums.values() for each in found]
        if self._code.width == 1:  # those with a factor in common in one loop, which reads it once
            places = {id(each.right): place for place, each in reversed(list(enumerate(sums)))}
            sums.sort(key=lambda each: places[id(each.right)])
        late = [each for each in sums if each.known_last()[0].late]
        others = [each for each in sums if not each.known_last()[0].late]
        parts = [[each] for each in late] + [others[start : start + most] for start in range(0, len(others), most)]
        found = []
        for part in parts:
            rising, falling = zip(*(each.known_last() for each in part), strict=True)
            found.append(_Wide(part, self._histories.of(rising), self._histories.of(falling)))
        return found

    @property
    def waiting(self) -> int:
        """How many values are `carried`."""
        return len(self._waiting)

    def carried(self) -> list[Any]:
        """What goes on to the next order in registers."""
        return [each.code.zero if self._k is None else each.current for each in self._waiting]

    def begin(self, k: Any, held: Sequence[Any] = ()) -> None:
        """Begin an order, the first where k is None; held: what was `carried` to it."""
        self._k = k
        for each, value in zip(self._waiting, held, strict=False):
            each.before = value
        self._histories.begin(k)

    def add_between(self) -> None:
        """The parts of all sums with 0 < j < k, several in a loop over j.

        Where few histories are read, their last coefficients wait in registers: from memory they come too late.
        """
        builder, one = self._code.builder, INTEGER(1)
        several = builder.icmp_signed(">", self._k, one)
        end = builder.select(several, builder.sub(self._k, one), one) if self._near else self._k
        for start in range(0, len(self._wide), self._at_once):
            these = self._wide[start : start + self._at_once]
            for each, products in zip(these, self._products(these, end), strict=True):
                code, total = each.rising.code, products
                if self._near:
                    lowest = code.load(each.falling.place, builder.zext(several, INTEGER))
                    total = code.multiply_add(each.rising.before, lowest, products)
                for place, single in enumerate(each.sums):
                    single.between = code.part(total, place, self._code)

    def _products(self, these: list[_Wide], end: Any) -> list[Any]:
        """The sums of products for 0 < j < end; of few, those for odd j apart, as each waits for the one before."""
        builder, code, one = self._code.builder, self._code, INTEGER(1)
        first, found, count = one, [each.rising.code.zero for each in these], len(these)
        if self._near:
            pairs = builder.ashr(builder.sub(end, one), one)
            with code.loop(INTEGER(0), pairs, 2 * found) as (i, totals, found):
                j = builder.add(builder.shl(i, one), one)
                found.extend(self._terms(these, j, totals[:count]))
                found.extend(self._terms(these, builder.add(j, one), totals[count:]))
            first = builder.add(builder.shl(pairs, one), one)
        with code.loop(first, end, found[:count]) as (j, totals, after):
            after.extend(self._terms(these, j, totals))
        return [code.add(a, b) for a, b in zip(after, found[count:], strict=True)] if self._near else after

    def _terms(self, these: list[_Wide], j: Any, totals: Sequence[Any]) -> Iterator[Any]:
        """The totals with the products of one j, each history being read once."""
        back = self._code.builder.sub(self._k, j)
        loaded: dict[tuple[int, int], Any] = {}
        for each, total in zip(these, totals, strict=True):
            code, pair = each.rising.code, ((each.rising.place, j), (each.falling.place, back))
            for place, index in pair:
                if (place, id(index)) not in loaded:
                    loaded[place, id(index)] = code.load(place, index)
            one, other = (loaded[place, id(index)] for place, index in pair)
            yield code.multiply_add(one, other, total)

    def ends(self, group: Group, first: bool) -> list[Any]:
        """The sums of a group with their terms of order 0 and k; None at first where they have none."""
        return [self._end(each, first) for each in self._sums.get(group.index, ())]

    def _end(self, each: _Sum, first: bool) -> Any:
        left, right, code = each.left, each.right, self._code
        last = self._histories.fetch(left)
        if first:
            return code.multiply(last, self._histories.fetch(right)) if each.whole else None
        if left is right:
            return code.multiply_add(code.add(left.first, left.first), last, each.between)
        terms = [(left.depth, last, right.first)]
        if each.whole:
            terms.append((right.depth, left.first, self._histories.fetch(right)))
        total = each.between
        for _, one, other in sorted(terms, key=lambda term: term[0]):  # what is known last is added last
            total = code.multiply_add(one, other, total)
        return total

    def finish(self) -> None:
        """Write what the histories of this order still lack, all unknowns being known."""
        self._histories.finish()
