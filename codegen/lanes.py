"""The right-hand side in its second layout: LANES runs at once, in a loop that a compiler turns into vectors."""

from collections.abc import Mapping
from typing import Any

from codegen.elementary import definitions
from codegen.kernel import Slot
from codegen.lower import Program
from codegen.printer import Printer
from codegen.skeleton import LaneKernel


def lane_kernel(program: Program, rank: Mapping[Any, int]) -> LaneKernel | None:
    """The lane kernel of `rhs`; None where it calls a function that has no form for lanes, such as erf."""
    kernel = program.kernels["rhs"]
    printer = Printer(rank, functions="lane_")
    read = kernel.used & kernel.reads
    paragraphs = (
        tuple(f"{symbol} = {_place(slot)}" for symbol, slot in program.slots.items() if symbol in read),
        tuple(f"{symbol} = {printer(expression)}" for symbol, expression in kernel.temporaries),
        tuple(f"{_place(slot)} = {printer(expression)}" for slot, expression in kernel.writes),
    )
    found = tuple(paragraph for paragraph in paragraphs if paragraph)
    functions = definitions(tuple(line for paragraph in found for line in paragraph))
    return None if functions is None else LaneKernel(functions, found)


def _place(slot: Slot) -> str:
    """The entry of a lane: state[3 * LANES + lane]; of the times, times[lane]."""
    if not slot.index:
        return "times[lane]"
    row = slot.index[0]
    return f"{slot.argument}[{row} * LANES + lane]"
