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
    yield tuple(f"{array} = [0.0] * {length}" for array, length in kernel.arrays.items())
    yield unpacked(kernel.replace(kernel.temporaries, kernel.writes[copied:]), slots)
    late = _made_of(kernel.kept, kernel)
    yield _temporaries(kernel, printer, None, late)
    written = [write for write in kernel.writes if write[0].argument in kernel.arrays]
    yield from _written(kernel, written, slots, printer, "")
    yield unpacked(kernel, kernel.kept)
    yield _temporaries(kernel, printer, None, {symbol for symbol, _ in kernel.temporaries} - late)
    yield from _written(kernel, kernel.writes[len(written) :], {**slots, **kernel.kept}, printer, target, copied)


def _made_of(symbols: Iterable[Any], kernel: Kernel) -> set[Any]:
    """The temporaries of no loop that are made of these symbols."""
    found = set(symbols)
    for symbol, expression in kernel.temporaries if found else ():
        if symbol not in kernel.homes and symbols_of(expression) & found:
            found.add(symbol)
    return found


def _written(
    kernel: Kernel, writes: Sequence[Any], slots: Mapping[Any, Slot], printer: Printer, target: str, copied: int = 0
) -> Iterator[tuple[str, ...]]:
    """What is written to an array, or to those that the slots name, but for the first items."""
    places = _places(kernel, writes)[copied:]
    for loop, alike in groupby(places, key=lambda place: place[1].loop):
        items = list(alike)
        if loop is None:
            yield tuple(
                f"{target or slot.argument}[{first}] = {printer(value)}{entry(slot)}" for first, slot, _, value in items
            )
            continue
        counter = kernel.loops[loop].counter
        lines = [*_unpacked_in(kernel, loop, slots), *_temporaries(kernel, printer, loop)]
        for first, slot, step, value in items:
            item = f"{target or slot.argument}[{_affine(first, step, counter)}]"
            added = f"{item} + " if slot.adds else ""
            lines.append(f"{item} = {added}{printer(value)}{entry(slot, counter)}")
        yield (f"for {counter} in range({kernel.loops[loop].count}):", *(f"    {line}" for line in lines))


def _temporaries(kernel: Kernel, printer: Printer, loop: int | None, but: Set[Any] = frozenset()) -> tuple[str, ...]:
    """The temporaries of a loop, or those of none, but for some."""
    found = (item for item in kernel.temporaries if kernel.homes.get(item[0]) == loop and item[0] not in but)
    return tuple(f"{symbol} = {printer(expression)}" for symbol, expression in found)


def _places(kernel: Kernel, written: Sequence[Any]) -> list[tuple[int, Slot, int, Any]]:
    """Of each write the place of its item, how far that goes in a loop, and the value.

    The items of vectors are where their slots say, entries of matrices one behind the other, row by row.
    """
    found: list[tuple[int, Slot, int, Any]] = []
    behind = 0
    for loop, alike in groupby(written, key=lambda write: write[0].loop):
        writes = list(alike)
        for k, (slot, value) in enumerate(writes):
            step = slot.steps[0] if loop is not None else 0
            found.append(
                (behind + k, slot, len(writes), value) if len(slot.index) > 1 else (*slot.index, slot, step, value)
            )
        behind += len(writes) * (kernel.loops[loop].count if loop is not None else 1)
    return found


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
    if len(slot.index) < 2:
        return ""
    steps = slot.steps or (0,) * len(slot.index)
    return f"  # [{', '.join(_affine(*each, counter) for each in zip(slot.index, steps, strict=True))}]"


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
