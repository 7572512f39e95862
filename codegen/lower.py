"""From derived equations to kernels: `lower` gives the `Program` that the templates write down."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from qddot.codegen.constants import hoist
from qddot.codegen.constrained_drafts import (
    COLUMNS,
    RESTING,
    SEEN,
    ConstrainedDrafts,
    refuse_size,
    solving_names,
)
from qddot.codegen.convert import symbol as convert_symbol
from qddot.codegen.drafts import Draft, Drafts, approach, switching, switching_functions, vector_writes
from qddot.codegen.kernel import Assignment, Kernel, Slot
from qddot.codegen.lagrange import Equations
from qddot.codegen.nodes import forget
from qddot.codegen.ranges import kind
from qddot.codegen.rewrite import ZERO, Names
from qddot.codegen.rules import collect, flatten, folded, front, inline, prune, pythagoras, simplify
from qddot.codegen.sharing import share
from qddot.codegen.skeleton import MATRICES, reserved, taken
from qddot.codegen.zeros import Point, without_zeros
from qddot.model.contents import declared
from qddot.model.system import ModelError


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
        writes, held = self.kernels[name].writes, self.equations_of(name).constraints
        name, n = name.removeprefix(RESTING), len(self.equations.coordinates)
        heights = {"mass": n, "constraints": n + len(held), "tangent": held.n_positions + len(held)}
        heights["approach"] = sum(mode in self.equations.modes.functions for mode in self.channels)
        rows: list[list[int]] = [[] for _ in range(heights.get(name, len(self.equations.state)))]
        for slot, _ in writes:
            if slot.argument == "matrix":
                rows[slot.index[0]].append(slot.index[1])
        if any(slot.argument in COLUMNS for slot, _ in writes):
            rows[n : 2 * n] = [list(range(self.width(name)))] * n
        return tuple(map(tuple, rows))

    def equations_of(self, name: str) -> Equations:
        """What a kernel is made of: contacts that rest are among the constraints of some."""
        return self.equations.at_rest if name.startswith(RESTING) or name in SEEN else self.equations

    def width(self, name: str) -> int:
        """How many columns a Jacobian has."""
        return self.rhs_channels if name == "input_jacobian" else len(self.equations.state) + 2 * (name == "approach")


def lower(equations: Equations) -> Program:
    """All kernels of a model, optimized, and the layout they share.

    Raises ModelError where a symbol has a name that the generated functions use themselves.
    """
    _refuse_names(equations)
    refuse_size(equations)
    lowering = _Lowering(equations)
    rhs = lowering.rhs()
    balance = lowering.balance()
    seen = lowering.at_rest.seen() if equations.contacts else {}
    others = {name: lowering.finish(draft) for name, draft in lowering.drafts.others().items() if name not in seen}
    if equations.contacts:
        drafts = {**seen, **lowering.at_rest.at_rest()}
        others |= {name: lowering.finish(draft, held=True) for name, draft in drafts.items()}
    if equations.switches.functions:
        others["switching"] = lowering.finish(switching(equations))
    if modes := [mode for mode in equations.modes.functions if mode in rhs.used]:
        others["modes"] = lowering.finish(switching_functions(lowering.equations, modes))
        others["approach"] = lowering.finish(approach(lowering.equations, modes))
    program = _laid_out(equations, {"rhs": rhs, **balance, **others}, lowering.assignments, lowering.drafts.linear)
    if not equations.positions:
        return program
    return replace(program, kernels={**program.kernels, "positions": lowering.positions()})


def lower_rhs(equations: Equations) -> Kernel:
    """The right-hand side alone, as `lower` gives it."""
    return _Lowering(equations).rhs()


def _refuse_names(equations: Equations) -> None:
    for role, symbol in declared(equations.system):
        solving = solving_names() if equations.solved_at_run_time or equations.contacts else frozenset()
        if str(symbol) in reserved() | solving | (taken() if role == "table" else frozenset()):
            raise ModelError(
                f"model {equations.system.name}: {role} {str(symbol)!r} would shadow a name that the generated kernels "
                "use themselves; choose another name"
            )


class _Lowering:
    """What all kernels of a model share: names given, symbols they may read, and constants computed once a run.

    The right-hand side comes first: the constants are its parameter-only parts, and the other kernels use them.
    """

    def __init__(self, equations: Equations) -> None:
        forget()
        base = (*equations.parameters, *equations.state, *equations.channels, equations.time)
        self.author = frozenset(map(convert_symbol, equations.system.definitions))
        tables = (name for table in equations.system.tables for name in table.names)
        solves = equations.solved_at_run_time
        solution: tuple[Any, ...] = (*equations.solution, *solving_names()) if solves else ()
        if equations.contacts:
            held = equations.at_rest
            solution = (*solution, *(held.solution - set(held.accelerations)), *solving_names())
        defined = equations.definitions.expressions
        self.names = Names([*reserved(), *base, *defined, *tables, *solution])
        equations = replace(equations, definitions=equations.definitions.copy(self.names))
        self._definitions, self.equations = equations.definitions, equations
        self.drafts = ConstrainedDrafts(equations) if solves else Drafts(equations, self.names)
        self.at_rest = ConstrainedDrafts(equations.at_rest)
        self.parameters = frozenset(equations.parameters)
        self._positions = vector_writes("values", equations.positions.values())
        self.reads: frozenset[Any] = frozenset(base) | (equations.solution if solves else frozenset())
        self.assignments: tuple[Assignment, ...] = ()
        self._simplified: dict[Any, Any] = {}
        self._point = Point()
        self._assign(self.drafts.parameter_assignments)

    def rhs(self) -> Kernel:
        """The right-hand side; what is constant in it joins the assignments."""
        parameters = self.parameters | {symbol for symbol, _ in self.assignments}
        hoisted, rhs = hoist(self.finish(self.drafts.rhs()), parameters, self.names)
        self._assign(hoisted)
        return prune(rhs)

    def balance(self) -> dict[str, Kernel]:
        """What the recurrences are made of where the right-hand side will not do; what is constant in it joins, too."""
        draft = self.drafts.balance()
        if draft is None:
            return {}
        parameters = self.parameters | {symbol for symbol, _ in self.assignments}
        hoisted, kernel = hoist(self.finish(draft), parameters, self.names, self.assignments)
        self._assign(hoisted)
        return {"balance": prune(kernel)}

    @property
    def derivatives(self) -> frozenset[Any]:
        """Derivatives of quantities that have got names."""
        return frozenset(self._definitions.expressions) - self.author

    def finish(self, draft: Draft, *, held: bool = False) -> Kernel:
        """A draft optimized, with the constants known so far; held: it solves for contacts, too."""
        reads = self.reads | self.equations.at_rest.solution if held else self.reads
        temporaries = tuple(item for item in draft.temporaries if item[0] not in reads)
        known = {expression: symbol for symbol, expression in self.assignments}
        kernel = inline(prune(Kernel(reads, temporaries, draft.writes)), self.author, self.derivatives)
        return optimize(kernel, self.author, known, self.names.copy(), self._simplified, self._point)

    def positions(self) -> Kernel:
        """Where inputs act: read from the parameters alone, before there are constants."""
        kernel = Kernel(self.parameters, self.drafts.parameter_assignments, self._positions)
        return optimize(kernel, self.author, {}, self.names.copy())

    def _assign(self, constants: tuple[Assignment, ...]) -> None:
        self.assignments += constants
        self._simplified = {}
        self.reads |= {symbol for symbol, _ in constants}


def optimize(
    kernel: Kernel,
    author: frozenset[Any],
    known: Mapping[Any, Any],
    names: Names,
    memo: dict[Any, Any] | None = None,
    point: Point | None = None,
) -> Kernel:
    """All rules in their order.

    author: quantities that keep their names and places. known: expression -> the constant that has its value. memo: see
    `simplify`, of kernels with the same constants. point: see `without_zeros`.
    """
    kernel = inline(prune(kernel), author)
    if (fewer := without_zeros(kernel, point)) is not kernel:
        kernel = inline(prune(fewer), author)
    kernel = simplify(kernel, (lambda node: known.get(node, node), flatten, pythagoras, collect, front), memo)
    kernel = inline(share(kernel, names, known), author)
    return prune(simplify(kernel, (folded(known),))).checked()


def _laid_out(
    equations: Equations, kernels: dict[str, Kernel], assignments: tuple[Assignment, ...], linear: bool
) -> Program:
    """The kernels with `constants` before them, and the places of all they read."""
    used = frozenset().union(*(kernel.used for kernel in kernels.values()))
    computed = [symbol for symbol, _ in assignments if symbol in used]
    constants = (*equations.parameters, *_by_kind(computed))
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
    first = {"constants": _constants_kernel(equations, constants, assignments)}
    return Program(
        equations=equations,
        kernels=first | {name: _placed(name, kernel, equations, channels) for name, kernel in kernels.items()},
        channels=channels,
        rhs_channels=max((index + 1 for index, symbol in enumerate(looked_up) if symbol in hot), default=0),
        constants=constants,
        slots=slots,
        linear=linear,
    )


def _by_kind(symbols: Sequence[Any]) -> list[Any]:
    """The symbols, those together whose names differ only by numbers, so that a table can say them in one row."""
    kinds: dict[str, list[Any]] = {}
    for symbol in symbols:
        kinds.setdefault(kind(str(symbol)), []).append(symbol)
    return [symbol for alike in kinds.values() for symbol in alike]


def _constants_kernel(equations: Equations, constants: tuple[Any, ...], assignments: tuple[Assignment, ...]) -> Kernel:
    writes = tuple((Slot("constants", (index,)), symbol) for index, symbol in enumerate(constants))
    return prune(Kernel(frozenset(equations.parameters), assignments, writes))


def _placed(name: str, kernel: Kernel, equations: Equations, channels: tuple[Any, ...]) -> Kernel:
    """A matrix without the entries that turned out to be zero; its columns, where these are inputs, the channels."""
    before = equations.channels
    columns = {before.index(symbol): column for column, symbol in enumerate(channels)}
    if name not in MATRICES:
        return kernel
    placed = [(slot, value) for slot, value in kernel.writes if slot.argument in ("matrix", *COLUMNS) and value != ZERO]
    if name == "input_jacobian":
        placed = [(Slot(slot.argument, (slot.index[0], columns[slot.index[1]])), value) for slot, value in placed]
    others = [(slot, value) for slot, value in kernel.writes if slot.argument not in ("matrix", *COLUMNS)]
    return kernel.replace(kernel.temporaries, [*others, *sorted(placed, key=lambda write: write[0].index)])
