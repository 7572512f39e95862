"""A kernel as lines of Python: what it reads, its temporaries and writes, and its loops."""

from collections.abc import Iterable, Iterator, Mapping, Sequence, Set
from itertools import groupby
from typing import Any

from qddot.codegen.kernel import Kernel, Slot
from qddot.codegen.nodes import symbols_of
from qddot.codegen.printer import Printer
from qddot.codegen.ranges import kind

#: Characters of a line within a function.
ROOM = 116


def paragraphs(
    kernel: Kernel, slots: Mapping[Any, Slot], printer: Printer, target: str, copied: int = 0
) -> Iterator[tuple[str, ...]]:
    """The lines of a kernel, in paragraphs. target: the array that it writes to, but for the first `copied` items."""
    yield from opening(kernel.replace(kernel.temporaries, kernel.writes[copied:]), slots, printer)
    left = [write for write in kernel.writes if write[0].argument not in kernel.arrays]
    yield from written(kernel, left[copied:], {**slots, **kernel.kept}, printer, target)


def opening(
    kernel: Kernel, slots: Mapping[Any, Slot], printer: Printer, later: Set[Any] = frozenset()
) -> Iterator[tuple[str, ...]]:
    """What a kernel reads, the arrays of its own, and its temporaries that stand in no loop, but for some."""
    yield tuple(f"{array} = [0.0] * {length}" for array, length in kernel.arrays.items())
    yield unpacked(kernel, slots)
    late = made_of(kernel.kept, kernel)
    yield temporaries(kernel, printer, None, late | later)
    kept = [write for write in kernel.writes if write[0].argument in kernel.arrays]
    yield from written(kernel, kept, slots, printer)
    yield unpacked(kernel, kernel.kept)
    yield temporaries(kernel, printer, None, {symbol for symbol, _ in kernel.temporaries} - late | later)


def made_of(symbols: Iterable[Any], kernel: Kernel) -> set[Any]:
    """The temporaries of no loop that are made of these symbols."""
    found = set(symbols)
    for symbol, expression in kernel.temporaries if found else ():
        if symbol not in kernel.homes and symbols_of(expression) & found:
            found.add(symbol)
    return found


def written(
    kernel: Kernel, writes: Sequence[Any], slots: Mapping[Any, Slot], printer: Printer, target: str = "", start: int = 0
) -> Iterator[tuple[str, ...]]:
    """What is written to an array, the entries of a matrix from a place in it on; or to those that the slots name."""
    places = _places(kernel, writes, target, start)
    for loop, alike in groupby(places, key=lambda place: place[1].loop):
        items = list(alike)
        if loop is None:
            yield tuple(f"{item} = {printer(value)}{note}" for item, _, value, note in items)
            continue
        counter = kernel.loops[loop].counter
        lines = [*_unpacked_in(kernel, loop, slots), *temporaries(kernel, printer, loop)]
        for item, slot, value, note in items:
            added = f"{item} + " if slot.adds else ""
            lines.append(f"{item} = {added}{printer(value)}{note}")
        yield (f"for {counter} in range({kernel.loops[loop].count}):", *(f"    {line}" for line in lines))


def temporaries(kernel: Kernel, printer: Printer, loop: int | None, but: Set[Any] = frozenset()) -> tuple[str, ...]:
    """The temporaries of a loop, or those of none, but for some."""
    found = (item for item in kernel.temporaries if kernel.homes.get(item[0]) == loop and item[0] not in but)
    return tuple(f"{symbol} = {printer(expression)}" for symbol, expression in found)


def _places(kernel: Kernel, writes: Sequence[Any], target: str, start: int) -> Iterator[tuple[str, Slot, Any, str]]:
    """Of each write the text of its item, the value, and what says where that stands.

    The items of vectors are where their slots say, entries of matrices that have a target one behind the other.
    """
    behind = start
    for loop, alike in groupby(writes, key=lambda write: write[0].loop):
        together = list(alike)
        counter = kernel.loops[loop].counter if loop is not None else ""
        for k, (slot, value) in enumerate(together):
            if target and len(slot.index) > 1:
                place = _affine(behind + k, len(together) if counter else 0, counter)
                yield f"{target}[{place}]", slot, value, entry(slot, counter)
            else:
                yield f"{target or slot.argument}[{', '.join(affine(slot, counter))}]", slot, value, ""
        behind += len(together) * (kernel.loops[loop].count if loop is not None else 1)


def affine(slot: Slot, counter: str = "") -> list[str]:
    """The indices of a slot as text, those of a loop by what counts its turns."""
    steps = slot.steps or (0,) * len(slot.index)
    return [_affine(first, step, counter) for first, step in zip(slot.index, steps, strict=True)]


def _affine(first: int, step: int, counter: str) -> str:
    """The text of first + step * counter."""
    if not step:
        return str(first)
    times = counter if abs(step) == 1 else f"{abs(step)} * {counter}"
    if step < 0:
        return f"{first} - {times}"
    return f"{times} + {first}" if first else times


def entry(slot: Slot, counter: str = "") -> str:
    """What says of an entry of a matrix where it stands."""
    return f"  # [{', '.join(affine(slot, counter))}]" if len(slot.index) > 1 else ""


def unpacked(kernel: Kernel, slots: Mapping[Any, Slot]) -> tuple[str, ...]:
    """Lines that read what a kernel uses, in the order of the arguments' entries; names alike stand together."""
    read = kernel.held & (kernel.reads | kernel.kept.keys())
    return _assigned((str(each), str(slot), str(each)) for each, slot in slots.items() if each in read and slot.index)


def _unpacked_in(kernel: Kernel, loop: int, slots: Mapping[Any, Slot]) -> tuple[str, ...]:
    """The same of what stands for symbols of cells."""
    found, counter = kernel.loops[loop].symbols, kernel.loops[loop].counter
    order = {symbol: k for k, symbol in enumerate(slots)}
    pairs = []
    for symbol in sorted(kernel.held & found.keys(), key=lambda each: (order[found[each][0]], str(each))):
        first, second = (slots[each] for each in found[symbol][:2])
        place = _affine(first.index[0], second.index[0] - first.index[0], counter)
        pairs.append((str(symbol), f"{first.argument}[{place}]", str(found[symbol][0])))
    return _assigned(pairs)


def _assigned(rows: Iterable[tuple[str, str, str]]) -> tuple[str, ...]:
    """Assignments of left to right; those whose third names are alike stand together."""
    return tuple(
        line for _, alike in groupby(rows, key=lambda row: kind(row[2])) for line in _together(row[:2] for row in alike)
    )


def _together(pairs: Iterable[tuple[str, str]]) -> Iterable[str]:
    """Assignments as lines, as many on a line as it holds."""
    lefts: list[str] = []
    rights: list[str] = []
    for left, right in pairs:
        if len(", ".join([*lefts, left])) + len(", ".join([*rights, right])) + len(" = ") > ROOM:
            yield f"{', '.join(lefts)} = {', '.join(rights)}"
            lefts, rights = [], []
        lefts.append(left)
        rights.append(right)
    yield f"{', '.join(lefts)} = {', '.join(rights)}"
