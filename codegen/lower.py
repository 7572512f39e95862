"""From derived equations to kernels: `lower` gives the `Program` that the templates write down."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from qddot.codegen.cell_constants import known_in, spread
from qddot.codegen.cells import Place
from qddot.codegen.constants import hoist
from qddot.codegen.constrained_drafts import STAGES, ConstrainedDrafts, refuse_size, solution_slots, solving_names
from qddot.codegen.convert import symbol as convert_symbol
from qddot.codegen.drafts import Draft, Drafts, approach, switching, switching_functions, vector_writes
from qddot.codegen.folding import Folded, fold
from qddot.codegen.kernel import Assignment, Kernel
from qddot.codegen.lagrange import Equations
from qddot.codegen.nodes import forget
from qddot.codegen.program import Program, UnevenError, check_even, laid_out
from qddot.codegen.ranges import kind, numbers
from qddot.codegen.rewrite import Names
from qddot.codegen.rules import inline, prune, shorter, simplify, with_constants
from qddot.codegen.sharing import share
from qddot.codegen.skeleton import reserved, taken
from qddot.codegen.zeros import Point, without_zeros
from qddot.model.contents import declared
from qddot.model.system import ModelError


def lower(equations: Equations, *, folds: bool = True) -> Program:
    """All kernels of a model, optimized, and the layout they share.

    folds: cells that are alike become loops. Raises ModelError where a symbol has a name that the generated functions
    use themselves.
    """
    _refuse_names(equations)
    refuse_size(equations)
    try:
        program = _lowered(equations, folds=folds)
        check_even(program)
        return program
    except UnevenError:
        return _lowered(equations, folds=False)


def _lowered(equations: Equations, *, folds: bool) -> Program:
    lowering = _Lowering(equations, folds=folds)
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
    program = laid_out(equations, {"rhs": rhs, **balance, **others}, lowering.assignments, lowering.drafts.linear)
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

    def __init__(self, equations: Equations, *, folds: bool = False) -> None:
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
        self._folds = folds and not equations.contacts
        self._places: dict[Any, Place] = {}
        for name, symbols in (
            ("parameters", equations.parameters),
            ("state", equations.state),
            ("inputs", equations.channels),
            ("time", (equations.time,)),
        ):
            self._places |= {symbol: (name, k) for k, symbol in enumerate(symbols)}
        self._stages: Mapping[str, int] = STAGES if solves else {}
        if solves:
            solved = solution_slots("rhs", equations)
            self._places |= {symbol: (slot.argument, slot.index[0]) for symbol, slot in solved.items()}
        self._simplified: dict[Any, Any] = {}
        self._point = Point()
        self._assign(self.drafts.parameter_assignments)

    def rhs(self) -> Kernel:
        """The right-hand side; what is constant in it joins the assignments."""
        kernel = self.finish(self.drafts.rhs(), copies=False)
        self._folds = bool(kernel.loops)
        parameters = self.parameters | {symbol for symbol, _ in self.assignments}
        columns = {each: column for loop in kernel.loops for each, column in loop.symbols.items()}
        standing = {each for each, column in columns.items() if parameters.issuperset(column)}
        names = self.names.copy(columns) if columns else self.names
        hoisted, rhs = hoist(kernel, parameters | standing, names)
        if kernel.loops:
            hoisted, rhs = spread(hoisted, rhs, self.assignments, self.names.fresh)
        self._assign(hoisted)
        return prune(rhs)

    def balance(self) -> dict[str, Kernel]:
        """What the recurrences are made of where the right-hand side will not do; what is constant in it joins, too."""
        draft = self.drafts.balance()
        if draft is None:
            return {}
        parameters = self.parameters | {symbol for symbol, _ in self.assignments}
        hoisted, kernel = hoist(self.finish(draft, folds=False), parameters, self.names, self.assignments)
        self._assign(hoisted)
        return {"balance": prune(kernel)}

    @property
    def derivatives(self) -> frozenset[Any]:
        """Derivatives of quantities that have got names."""
        return frozenset(self._definitions.expressions) - self.author

    def finish(self, draft: Draft, *, held: bool = False, folds: bool = True, copies: bool = True) -> Kernel:
        """A draft optimized, with the constants known so far; held: it solves for contacts, too.

        folds: what repeats in it becomes loops, where the equations of motion repeat. copies: see `fold`.
        """
        reads = self.reads | self.equations.at_rest.solution if held else self.reads
        temporaries = tuple(item for item in draft.temporaries if item[0] not in reads)
        known = {expression: symbol for symbol, expression in self.assignments}
        names = self.names.copy()
        found = Folded(temporaries, draft.writes)
        if self._folds and folds:
            found = fold(
                temporaries, draft.writes, self._places, names, self.author, copies=copies, stages=self._stages
            )
        loops = []
        for loop in found.loops:
            constants = known_in(loop, self.assignments, self._places, names)
            known |= {expression: symbol for expression, (symbol, _) in constants.items()}
            loops.append(replace(loop, symbols={**loop.symbols, **dict(constants.values())}))
        author = self.author | found.named
        kernel = Kernel(reads, found.temporaries, found.writes, tuple(loops), found.kept)
        kernel = inline(prune(kernel), author, self.derivatives, found.apart)
        if loops:  # what stands for symbols in them means something else in every kernel
            return optimize(kernel, author, known, names, apart=found.apart)
        return optimize(kernel, author, known, names, self._simplified, self._point)

    def positions(self) -> Kernel:
        """Where inputs act: read from the parameters alone, before there are constants."""
        kernel = Kernel(self.parameters, self.drafts.parameter_assignments, self._positions)
        return optimize(kernel, self.author, {}, self.names.copy())

    def _assign(self, constants: tuple[Assignment, ...]) -> None:
        self.assignments += constants
        self._simplified = {}
        self.reads |= {symbol for symbol, _ in constants}
        kinds: dict[str, int] = {}
        for symbol in sorted((symbol for symbol, _ in self.assignments), key=numbers):
            of_kind = kind(str(symbol))
            kinds[of_kind] = place = kinds.get(of_kind, -1) + 1
            self._places[symbol] = f"constants {of_kind}", place


def optimize(
    kernel: Kernel,
    author: frozenset[Any],
    known: Mapping[Any, Any],
    names: Names,
    memo: dict[Any, Any] | None = None,
    point: Point | None = None,
    apart: frozenset[Any] = frozenset(),
) -> Kernel:
    """All rules in their order.

    author: quantities that keep their names and places. apart: temporaries that are computed before loops.
    known: expression -> the constant that has its value. memo: see `simplify`, of kernels with the same constants.
    point: see `without_zeros`.
    """
    kernel = inline(prune(kernel), author, apart=apart)
    if (fewer := without_zeros(kernel, point)) is not kernel:
        kernel = inline(prune(fewer), author, apart=apart)
    kernel = simplify(kernel, (lambda node: known.get(node, node), shorter), memo)
    kernel = inline(share(kernel, names, known), author, apart=apart)
    return prune(with_constants(kernel, known)).checked()
