"""Programs as text: what the templates are given, all strings finished."""

from collections.abc import Iterable, Sequence
from typing import Any

import sympy

from qddot.codegen.environment import environment
from qddot.codegen.kernel import Kernel, Slot
from qddot.codegen.lower import Program
from qddot.codegen.printer import Printer
from qddot.codegen.skeleton import HEADS, MATRICES, Function, function


def module(program: Program, source: str, origin: Sequence[str]) -> str:
    """The Python module of a model, before the formatter.

    source: names the model file in the header; origin: its lines with the digests of what was read.
    """
    equations = program.equations
    functions = [_function(program, name, program.kernels[name]) for name in HEADS if name in program.kernels]
    body = "\n".join(line for function in functions for paragraph in function.paragraphs for line in paragraph)
    return (
        environment("python")
        .get_template("kernels.py.jinja")
        .render(
            source=source,
            origin=origin,
            sympy=sympy.__version__,
            system=equations.system,
            state=_state_table(program),
            inputs=_input_table(program),
            rhs_inputs=program.rhs_channels,
            positions=list(equations.positions),
            outputs=[(str(o.symbol), o.unit, o.meaning) for o in equations.system.output_expressions],
            parameters=[(str(p.symbol), float(p.default), p.unit, p.meaning) for p in equations.system.parameters],
            parameter_sets={
                name: {str(symbol): float(value) for symbol, value in values.items()}
                for name, values in equations.system.parameter_sets.items()
            },
            constants=[str(symbol) for symbol in program.constants],
            coordinates=len(equations.coordinates),
            patterns={name: program.pattern(name) for name in MATRICES},
            linear=program.linear,
            mass_matrix=equations.mass_matrix,
            uses_math="math." in body,
            functions=functions,
        )
    )


def _state_table(program: Program) -> list[tuple[str, str, str]]:
    coordinates = program.equations.system.coordinates
    return [(str(c.symbol), c.unit, c.meaning) for c in coordinates] + [
        (str(c.rate), f"{c.unit}/s", f"rate of change of: {c.meaning}") for c in coordinates
    ]


def _input_table(program: Program) -> list[tuple[str, str, str, str]]:
    """Name, the input that it is the rate of or nothing, unit, meaning; in the order of the channels."""
    inputs = program.equations.system.inputs
    rows = {str(u.symbol): (str(u.symbol), "", u.unit, u.meaning) for u in inputs}
    rows |= {
        str(u.rate): (str(u.rate), str(u.symbol), f"{u.unit}/s", f"rate of change of: {u.meaning}") for u in inputs
    }
    return [rows[str(channel)] for channel in program.channels]


def _function(program: Program, name: str, kernel: Kernel) -> Function:
    printer = Printer(rank(program, kernel))
    paragraphs = (
        tuple(_unpacked(program, name, kernel)),
        tuple(f"{symbol} = {printer(expression)}" for symbol, expression in kernel.temporaries),
        tuple(f"{HEADS[name][0][-1]}[{k}] = {printer(value)}" for k, (_, value) in enumerate(kernel.writes)),
    )
    return function(name, paragraphs)


def _unpacked(program: Program, name: str, kernel: Kernel) -> Iterable[str]:
    """Lines that read what the kernel uses, in the order of the arguments' entries."""
    slots = dict(program.slots)
    if "parameters" in HEADS[name][0]:
        slots = {symbol: Slot("parameters", (k,)) for k, symbol in enumerate(program.equations.parameters)}
    read = kernel.used & kernel.reads
    return [f"{symbol} = {slot}" for symbol, slot in slots.items() if symbol in read and slot.index]


def rank(program: Program, kernel: Kernel) -> dict[Any, int]:
    """Order of symbols within sums: state, quantities and temporaries, inputs, and constants last."""
    equations = program.equations
    moving = (*equations.coordinates, *equations.velocities, equations.time)
    assigned = tuple(symbol for symbol, _ in kernel.temporaries)
    order = (*moving, *assigned, *program.channels, *equations.parameters, *program.constants)
    rank: dict[Any, int] = {}
    for symbol in order:
        rank.setdefault(symbol, len(rank))
    return rank
