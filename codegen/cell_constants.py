"""Constants of the cells of loops: one for each cell, and what stands for them in the loop."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import replace
from itertools import product
from typing import Any

from qddot.codegen.cells import Place, Signatures
from qddot.codegen.constants import telling
from qddot.codegen.kernel import Assignment, Kernel, Loop
from qddot.codegen.nodes import symbols_of
from qddot.codegen.rewrite import Names


def of_cell(expression: Any, loop: Loop, cell: int) -> Any:
    """An expression of a loop in the symbols of one of its cells."""
    held = symbols_of(expression) & loop.symbols.keys()
    return expression.subs({each: loop.symbols[each][cell] for each in held})


def known_in(
    loop: Loop, assignments: Iterable[Assignment], places: Mapping[Any, Place], names: Names
) -> dict[Any, tuple[Any, tuple[Any, ...]]]:
    """Expressions of a loop that are a known constant in each cell -> what stands for these, and they themselves."""
    known = {expression: symbol for symbol, expression in assignments}
    signatures = Signatures(places, {})
    alike: dict[int, list[Any]] = {}
    for expression in known:
        alike.setdefault(signatures(expression).skeleton, []).append(expression)
    found: dict[Any, tuple[Any, tuple[Any, ...]]] = {}
    for first, *others in alike.values():
        for expression in _candidates(first, loop, places) if len(others) + 1 >= loop.count else ():
            column = tuple(_all_known(known, expression, loop))
            if len(column) == loop.count:
                found[expression] = names.fresh(telling(expression) or f"constant_{loop.counter}"), column
    return found


def _candidates(expression: Any, loop: Loop, places: Mapping[Any, Place]) -> Iterator[Any]:
    """The same of symbols that stand for those of the same lists in a loop, one of them at least."""
    held = sorted(symbols_of(expression), key=str)
    choices = []
    for symbol in held:
        name = places[symbol][0] if symbol in places else ""
        moving = [each for each, column in loop.symbols.items() if places.get(column[0], ("",))[0] == name]
        choices.append([symbol, *moving])
    for chosen in product(*choices):
        if chosen != tuple(held):
            yield expression.subs(dict(zip(held, chosen, strict=True)))


def _all_known(known: Mapping[Any, Any], expression: Any, loop: Loop) -> Iterator[Any]:
    for cell in range(loop.count):
        value = known.get(of_cell(expression, loop, cell))
        if value is None:
            return
        yield value


def spread(
    hoisted: Iterable[Assignment], kernel: Kernel, known: Iterable[Assignment], fresh: Callable[[str], Any]
) -> tuple[tuple[Assignment, ...], Kernel]:
    """Constants that were found in a kernel, those of a loop one for each cell; and the kernel that reads these.

    known: constants that there are. fresh: gives names.
    """
    symbols = {expression: symbol for symbol, expression in known}
    added: list[Assignment] = []

    def assigned(expression: Any, wish: str) -> Any:
        if expression not in symbols:
            symbols[expression] = fresh(wish)
            added.append((symbols[expression], expression))
        return symbols[expression]

    loops = [Loop(loop.counter, loop.count, dict(loop.symbols)) for loop in kernel.loops]
    for symbol, expression in hoisted:
        homes = [loop for loop in loops if symbols_of(expression) & loop.symbols.keys()]
        for loop in homes:
            values = (of_cell(expression, loop, cell) for cell in range(loop.count))
            loop.symbols[symbol] = tuple(assigned(value, telling(value) or "constant_") for value in values)  # type: ignore[index]
        if not homes:
            added.append((fresh(str(symbol)), expression))
    return tuple(added), replace(kernel, loops=tuple(loops))
