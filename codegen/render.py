"""Programs as text: what the templates are given, all strings finished."""

from collections.abc import Iterable, Sequence
from functools import partial
from math import inf
from textwrap import fill
from typing import Any

import sympy

from qddot.codegen.constrained import in_order
from qddot.codegen.constrained_drafts import COLUMNS, RESTING, STAGES, calls, runtime_names
from qddot.codegen.convert import symbol as convert_symbol
from qddot.codegen.environment import environment
from qddot.codegen.kernel import Kernel, Slot
from qddot.codegen.kernel_text import ROOM, made_of, opening, paragraphs, temporaries, written
from qddot.codegen.lagrange import Equations
from qddot.codegen.lookup import lookups
from qddot.codegen.place_rows import place_rows
from qddot.codegen.printer import Printer
from qddot.codegen.program import Program
from qddot.codegen.ranges import compressed
from qddot.codegen.recurrences_motion import recurrences
from qddot.codegen.skeleton import HEADS, MATRICES, Function, copying, function
from qddot.model.constraints import Constraint
from qddot.model.contents import accelerations
from qddot.model.events import Event, Impact
from qddot.model.resting import resting
from qddot.model.scene import row

#: A text in lines as long as those of a function.
_fill = partial(fill, width=ROOM, break_long_words=False, break_on_hyphens=False)


def module(program: Program, source: str, origin: Sequence[str]) -> str:
    """The Python module of a model, before the formatter.

    source: names the model file in the header; origin: its lines with the digests of what was read.
    """
    equations = program.equations
    functions = [_function(program, name, program.kernels[name]) for name in HEADS if name in program.kernels]
    rows, missing = recurrences(equations, program.kernels, program.constants)
    body = "\n".join(line for function in functions for paragraph in function.paragraphs for line in paragraph)
    constraints = in_order(equations.system)
    return (
        environment("python")
        .get_template("kernels.py.jinja")
        .render(
            source=source,
            origin=origin,
            sympy=sympy.__version__,
            system=equations.system,
            state=compressed(_state_table(program), turns=True),
            inputs=compressed(_input_table(program), turns=True),
            rhs_inputs=program.rhs_channels,
            switched=bool(equations.switches.functions),
            held="modes" in program.kernels,
            positions=compressed(list(equations.positions)),
            outputs=compressed(
                [(str(o.symbol), o.unit, o.meaning) for o in equations.system.output_expressions], turns=True
            ),
            parameters=compressed(
                [(str(p.symbol), float(p.default), p.unit, p.meaning) for p in equations.system.parameters], turns=True
            ),
            parameter_sets={
                name: dict(compressed([(str(symbol), float(value)) for symbol, value in values.items()]))
                for name, values in equations.system.parameter_sets.items()
            },
            constants=compressed([str(symbol) for symbol in program.constants[len(equations.parameters) :]]),
            coordinates=len(equations.coordinates),
            patterns={name: _pattern(program, name) for name in MATRICES if name in program.kernels},
            linear=program.linear,
            recurrences=[_fill(each, subsequent_indent="    ") for each in rows],
            without_recurrence=missing,
            mass_matrix=equations.mass_matrix,
            uses_math="math." in body,
            constraints=[(str(c.symbol), isinstance(c, Constraint), c.unit, c.meaning) for c in constraints],
            projected=equations.system.baumgarte is None,
            events=[
                (e.name, int(e.direction), e.terminal, e.meaning, _set_by(e, equations), _kind(e, equations))
                for e in equations.system.events
            ],
            contacts=bool(equations.contacts),
            scene=[row(shape, [u.symbol for u in equations.system.inputs]) for shape in equations.system.scene],
            solving=runtime_names(body, equations),
            factors=_fill(" ".join(equations.elimination.texts if "FACTORS" in body else ())),
            functions=functions,
            lookups=lookups(program),
        )
    )


def _pattern(program: Program, name: str) -> tuple[Any, ...]:
    """The places of a kernel's matrix; those of many cells as texts."""
    rows = program.pattern(name)
    return place_rows(rows) if any(kernel.loops for kernel in program.kernels.values()) else rows


def _set_by(event: Event, equations: Equations) -> tuple[str, ...]:
    """The states that an event sets."""
    return tuple(map(str, equations.velocities if isinstance(event, Impact) else event.then))


def _kind(event: Event, equations: Equations) -> str:
    """What an event is: an impact, or one that can rest, a contact."""
    if not isinstance(event, Impact):
        return "event"
    return "contact" if convert_symbol(event.rests_symbol) in equations.contacts else "impact"


def _state_table(program: Program) -> list[tuple[str, str, str]]:
    system = program.equations.system
    coordinates = [(str(c.symbol), c.unit, c.meaning) for c in system.coordinates]
    velocities = [(str(c.rate), f"{c.unit}/s", f"rate of change of: {c.meaning}") for c in system.coordinates]
    return coordinates + velocities + [(str(state.symbol), state.unit, state.meaning) for state in system.states]


def _input_table(program: Program) -> list[tuple[str, str, int, str, str]]:
    """Name, the input that it is or is a derivative of, of which order, unit, meaning; in the order of the channels."""
    inputs = program.equations.system.inputs
    rows = {str(u.symbol): (str(u.symbol), str(u.symbol), 0, u.unit, u.meaning) for u in inputs}
    for u in inputs:
        rows[str(u.rate)] = (str(u.rate), str(u.symbol), 1, f"{u.unit}/s", f"rate of change of: {u.meaning}")
        for each in map(str, accelerations(u)):
            rows[each] = (each, str(u.symbol), 2, f"{u.unit}/s^2", f"acceleration of: {u.meaning}")
    printer = Printer(rank(program, program.kernels["rhs"]))
    for impact in resting(program.equations.system):
        name = str(impact.rests_symbol)
        rows[name] = (name, "0", 0, "1", f"1 while contact {impact.name} rests, else 0")
    for side, changing in program.equations.switches.functions.items():
        rows[str(side)] = (str(side), "t", 0, "1", f"1 where {printer(changing)} > 0, else 0")
    for mode, changing in program.equations.modes.functions.items():
        rows[str(mode)] = (str(mode), "x", 0, "1", f"0, or where {printer(changing)} > 0 is held: inf, or -inf: not")
    return [rows[str(channel)] for channel in program.channels]


def _function(program: Program, name: str, kernel: Kernel) -> Function:
    printer = Printer(rank(program, kernel, name))
    if any(slot.argument == "mass_matrix" for slot, _ in kernel.writes):
        return function(name, _solving(program, name, kernel, printer))
    copied = len(program.equations.parameters) if name == "constants" else 0
    lines = paragraphs(kernel, program.slots_of(name), printer, HEADS[name][0][-1], copied)
    return function(name, (copying(copied), *lines), states=bool(program.equations.states))


def _solving(program: Program, name: str, kernel: Kernel, printer: Printer) -> Iterable[tuple[str, ...]]:
    """The paragraphs of a kernel that solves for accelerations: what it needs for that, the call, and what follows."""
    equations, base = program.equations_of(name), name.removeprefix(RESTING)
    solved, slots = program.solved_in(name), program.slots_of(name)
    known = {symbol for symbol, _ in kernel.temporaries}
    after = made_of(solved, kernel) & known
    reports = bool(kernel.used & solved.keys() - set(equations.accelerations))
    width = program.width(base) if base in ("jacobian", "input_jacobian") else 0
    n, columns = len(equations.coordinates), any(slot.argument in COLUMNS for slot, _ in kernel.writes)
    called = calls(base, n, len(equations.constraints), width, reports=reports)
    others = [write for write in kernel.writes if write[0].argument not in (*STAGES, *kernel.arrays)]
    behind = 2 * n if columns else inf  # rows of matrices behind those that are solved for
    first, rows = ([each for each in others if (each[0].index[0] >= behind) is late] for late in (False, True))
    write = partial(written, kernel, slots={**slots, **kernel.kept, **solved}, printer=printer)
    yield from opening(kernel, slots, printer, after)
    yield called.made
    yield from write(_of_stage(kernel, 0))
    yield called.solved
    yield tuple(f"{symbol} = {slot}" for symbol, slot in solved.items() if symbol in kernel.held)
    yield temporaries(kernel, printer, None, known - after)
    yield from write(_of_stage(kernel, 1))
    yield from write(first, target=HEADS[name][0][-1])
    yield from write(rows, target=HEADS[name][0][-1], start=kernel.entries(first) + n * width)
    yield called.last


def _of_stage(kernel: Kernel, stage: int) -> list[tuple[Slot, Any]]:
    """What is written in a stage, loops last, each as a whole."""
    found = [(slot, e) for slot, e in kernel.writes if STAGES.get(slot.argument) == stage and e != 0]
    return sorted(found, key=lambda write: -1 if write[0].loop is None else write[0].loop)


def rank(program: Program, kernel: Kernel, name: str = "rhs") -> dict[Any, int]:
    """Order of symbols within sums of a kernel: state, quantities and temporaries, inputs, and constants last."""
    equations = program.equations_of(name)
    moving = (*equations.state, equations.time)
    assigned = tuple(symbol for symbol, _ in kernel.temporaries)
    solution = (*equations.accelerations, *equations.constraints.multipliers) if equations.solved_at_run_time else ()
    order = (*moving, *solution, *assigned, *program.channels, *equations.parameters, *program.constants)
    rank: dict[Any, int] = {}
    for symbol in order:
        rank.setdefault(symbol, len(rank))
    for symbol in kernel.kept:
        rank[symbol] = len(rank)
    first = {each: column[0] for loop in kernel.loops for each, column in loop.symbols.items()}
    return rank | {each: rank[symbol] for each, symbol in first.items() if symbol in rank}
