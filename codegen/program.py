"""All kernels of a model, and where their symbols stand: what the templates write down."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

from qddot.codegen.constrained_drafts import COLUMNS, RESTING, SEEN, solution_slots
from qddot.codegen.folding import fold
from qddot.codegen.kernel import Assignment, Kernel, Slot
from qddot.codegen.lagrange import Equations
from qddot.codegen.ranges import kind, numbers
from qddot.codegen.rewrite import ZERO, Names
from qddot.codegen.rules import prune
from qddot.codegen.skeleton import HEADS, MATRICES, reserved


class UnevenError(Exception):
    """Cells that are alike, but do not stand equally far apart."""


@dataclass(frozen=True)
class Program:
    """All kernels of a model, and where their symbols stand.

    channels: inputs, sides of conditions in time, the rates in use, then the modes in use. A step looks up the first
    rhs_channels of them; modes are set, not looked up.
    constants: symbols of c in order, all parameters first. slots: symbol -> the argument entry it is read from.
    linear: affine in x and u. Kernels of matrices write the entries matrix[row, column] that are not zero, sorted: see
    `pattern`.
    """

    equations: Equations
    kernels: Mapping[str, Kernel]
    channels: tuple[Any, ...]
    rhs_channels: int
    constants: tuple[Any, ...]
    slots: Mapping[Any, Slot]
    linear: bool

    def pattern(self, name: str) -> tuple[tuple[int, ...], ...]:
        """Of each row of a kernel's matrix the columns of its entries."""
        kernel, held = self.kernels[name], self.equations_of(name).constraints
        name, n = name.removeprefix(RESTING), len(self.equations.coordinates)
        heights = {"mass": n, "constraints": n + len(held), "tangent": held.n_positions + len(held)}
        heights["approach"] = sum(mode in self.equations.modes.functions for mode in self.channels)
        rows: list[list[int]] = [[] for _ in range(heights.get(name, len(self.equations.state)))]
        for slot, _ in kernel.writes:
            for row, column in kernel.indices(slot) if slot.argument == "matrix" else ():
                rows[row].append(column)
        if any(slot.argument in COLUMNS for slot, _ in kernel.writes):
            rows[n : 2 * n] = [list(range(self.width(name)))] * n
        return tuple(map(tuple, rows))

    def slots_of(self, name: str) -> Mapping[Any, Slot]:
        """Where the symbols stand that a kernel reads."""
        if name in HEADS and "parameters" in HEADS[name][0]:
            return {symbol: Slot("parameters", (k,)) for k, symbol in enumerate(self.equations.parameters)}
        return self.slots

    def solved_in(self, name: str) -> Mapping[Any, Slot]:
        """Where the symbols stand that a kernel solves for."""
        equations = self.equations_of(name)
        return solution_slots(name, equations) if equations.solved_at_run_time else {}

    def equations_of(self, name: str) -> Equations:
        """What a kernel is made of: contacts that rest are among the constraints of some."""
        return self.equations.at_rest if name.startswith(RESTING) or name in SEEN else self.equations

    def width(self, name: str) -> int:
        """How many columns a Jacobian has."""
        return self.rhs_channels if name == "input_jacobian" else len(self.equations.state) + 2 * (name == "approach")


def laid_out(
    equations: Equations, kernels: dict[str, Kernel], assignments: tuple[Assignment, ...], linear: bool
) -> Program:
    """The kernels with `constants` before them, and the places of all they read."""
    used = frozenset().union(*(kernel.used for kernel in kernels.values()))
    computed = [symbol for symbol, _ in assignments if symbol in used]
    folds = any(kernel.loops for kernel in kernels.values())
    columns = [column for kernel in kernels.values() for loop in kernel.loops for column in loop.symbols.values()]
    constants = (*equations.parameters, *_by_kind(computed, columns, sort=folds))
    steps = ("rhs", "jacobian", "input_jacobian", "constraints", "tangent", "events")
    resting = [name for name in kernels if name.startswith(RESTING)]
    hot = frozenset().union(*(kernels[name].used for name in (*steps, *resting) if name in kernels))
    rates = [rate for rate in (*equations.rates, *equations.second_rates) if rate in used]
    sides = equations.switches.functions
    looked_up = (*equations.inputs, *sides, *equations.contacts, *sorted(rates, key=lambda rate: rate not in hot))
    channels = (*looked_up, *(mode for mode in equations.modes.functions if mode in used))
    slots = {equations.time: Slot("t", ())}
    for argument, symbols in (("state", equations.state), ("inputs", channels), ("constants", constants)):
        slots |= {symbol: Slot(argument, (index,)) for index, symbol in enumerate(symbols)}
    first = {"constants": _constants_kernel(equations, constants, assignments, folds=folds)}
    return Program(
        equations=equations,
        kernels=first | {name: _placed(name, kernel, equations, channels) for name, kernel in kernels.items()},
        channels=channels,
        rhs_channels=max((index + 1 for index, symbol in enumerate(looked_up) if symbol in hot), default=0),
        constants=constants,
        slots=slots,
        linear=linear,
    )


def _by_kind(symbols: Sequence[Any], columns: Iterable[Sequence[Any]], *, sort: bool) -> list[Any]:
    """The symbols, those together whose names differ only by numbers, so that a table can say them in one row.

    sort: in the order of these numbers. columns: symbols of the cells of loops, which stand one behind the other.
    """
    kinds: dict[str, list[Any]] = {}
    for symbol in symbols:
        kinds.setdefault(kind(str(symbol)), []).append(symbol)
    found = {name: sorted(alike, key=numbers) if sort else alike for name, alike in kinds.items()}
    for column in columns:
        first, *others = dict.fromkeys(kind(str(symbol)) for symbol in column)
        for name in others:
            if first in found and name in found:
                found[first] = found[first] + found.pop(name)
    return [symbol for alike in found.values() for symbol in alike]


def _constants_kernel(
    equations: Equations, constants: tuple[Any, ...], assignments: tuple[Assignment, ...], *, folds: bool
) -> Kernel:
    writes = tuple((Slot("constants", (index,)), symbol) for index, symbol in enumerate(constants))
    reads = frozenset(equations.parameters)
    if not folds:
        return prune(Kernel(reads, assignments, writes))
    copied, places = len(equations.parameters), {each: ("parameters", k) for k, each in enumerate(equations.parameters)}
    names = Names([*reserved(), *constants, *(symbol for symbol, _ in assignments)])
    draft = fold(assignments, writes[copied:], places, names)
    return prune(Kernel(reads, draft.temporaries, (*writes[:copied], *draft.writes), draft.loops))


def _placed(name: str, kernel: Kernel, equations: Equations, channels: tuple[Any, ...]) -> Kernel:
    """A matrix without the entries that turned out to be zero; its columns, where these are inputs, the channels."""
    before = equations.channels
    columns = {before.index(symbol): column for column, symbol in enumerate(channels)}
    if name not in MATRICES:
        return kernel
    placed = [(slot, value) for slot, value in kernel.writes if slot.argument in ("matrix", *COLUMNS) and value != ZERO]
    if name == "input_jacobian":
        placed = [(_with_column(slot, kernel, columns), value) for slot, value in placed]
    others = [(slot, value) for slot, value in kernel.writes if slot.argument not in ("matrix", *COLUMNS)]
    return kernel.replace(kernel.temporaries, [*others, *sorted(placed, key=lambda write: write[0].index)])


def _with_column(slot: Slot, kernel: Kernel, columns: Mapping[int, int]) -> Slot:
    """A slot with another column."""
    found = [columns[column] for _, column in kernel.indices(slot)]
    steps = (slot.steps[0], _even(found)) if slot.steps else ()
    return replace(slot, index=(slot.index[0], found[0]), steps=steps)


def check_even(program: Program) -> None:
    """UnevenError where what stands for symbols in a loop does not stand equally far apart."""
    for name, kernel in program.kernels.items():
        slots = {**program.slots_of(name), **program.solved_in(name), **kernel.kept}
        for loop in kernel.loops:
            for each in kernel.held & loop.symbols.keys():
                _even([slots[symbol].index[0] for symbol in loop.symbols[each]])


def _even(places: Sequence[int]) -> int:
    """How far each of these places is from the one before."""
    steps = {later - earlier for earlier, later in pairwise(places)}
    if len(steps) > 1:
        raise UnevenError
    return steps.pop()
