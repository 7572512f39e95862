"""The functions of a generated module without a model's lines: what they take, and the names they use themselves."""

import ast
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cache

import symengine as se

from qddot.codegen.convert import MATH_NAMES
from qddot.codegen.environment import environment
from qddot.codegen.printer import Printer

#: Arguments and meaning of every kernel, in the order of the file.
HEADS = {
    "constants": (("parameters", "constants"), "Constants of a run from its parameters."),
    "rhs": (("t", "state", "inputs", "constants", "derivative"), "State derivative [qdot, qddot]."),
    "jacobian": (
        ("t", "state", "inputs", "constants", "values"),
        "Derivative of rhs by the state, at the places in JACOBIAN.",
    ),
    "input_jacobian": (
        ("t", "state", "inputs", "constants", "values"),
        "Derivative of rhs by the inputs, at the places in INPUT_JACOBIAN.",
    ),
    "mass": (
        ("t", "state", "inputs", "constants", "values"),
        "Lower triangle of the mass matrix, at the places in MASS.",
    ),
    "energy": (
        ("t", "state", "inputs", "constants", "values"),
        "Kinetic and potential energy, dissipated power, power put in by forces and inputs.",
    ),
    "outputs": (("t", "state", "inputs", "constants", "values"), "Outputs, in the order of OUTPUT."),
    "scene": (("t", "state", "inputs", "constants", "values"), "Numbers of the shapes in SCENE, one behind the other."),
    "events": (
        ("t", "state", "inputs", "constants", "values"),
        "Functions of the events, in the order of EVENT, then the values that these give to states.",
    ),
    "modes": (
        ("t", "state", "inputs", "constants", "values"),
        "What changes sign at each condition in the state that has a mode, in the order of the modes in INPUT.",
    ),
    "approach": (
        ("t", "state", "inputs", "constants", "values"),
        "How fast that moves: derivatives by the state, the rest, how far it is held, at the places in APPROACH.",
    ),
    "constraints": (
        ("t", "state", "inputs", "constants", "values"),
        "M and below it G, beside that residuals of positions and velocities, at the places in CONSTRAINTS.",
    ),
    "tangent": (
        ("t", "state", "inputs", "constants", "values"),
        "Derivative by the state of the residuals of positions, then of velocities, at the places in TANGENT.",
    ),
    "resting_rhs": (
        ("t", "state", "inputs", "constants", "derivative"),
        "State derivative where contacts rest, of which INPUT says 1.",
    ),
    "resting_jacobian": (
        ("t", "state", "inputs", "constants", "values"),
        "Derivative of that by the state, at the places in RESTING_JACOBIAN.",
    ),
    "resting_constraints": (
        ("t", "state", "inputs", "constants", "values"),
        "As constraints, gaps that are held among them, at the places in RESTING_CONSTRAINTS.",
    ),
    "resting_events": (
        ("t", "state", "inputs", "constants", "values"),
        "As events, of contacts that rest their forces.",
    ),
    "switching": (
        ("t", "constants", "values"),
        "What changes sign at each condition in t, its slope, how it bends: 0 not, -1 or the squares of frequencies.",
    ),
    "positions": (("parameters", "values"), "Positions of the inputs in POSITION, m ahead of the model's origin."),
}

#: Those that write the entries of a matrix, at places that the module declares.
MATRICES = (
    "jacobian",
    "input_jacobian",
    "mass",
    "constraints",
    "tangent",
    "approach",
    "resting_jacobian",
    "resting_constraints",
)

#: What the functions of a model with internal states say of themselves.
WITH_STATES = {
    "rhs": "State derivative [qdot, qddot, zdot].",
    "energy": "Kinetic and potential energy, dissipated power, power put in by forces, inputs and internal states.",
}

Paragraphs = tuple[tuple[str, ...], ...]


@dataclass(frozen=True)
class Function:
    """A generated function; paragraphs are lists of finished lines."""

    name: str
    arguments: str
    docstring: str
    paragraphs: Paragraphs


def function(name: str, paragraphs: Iterable[tuple[str, ...]], *, states: bool = False) -> Function:
    """The generated function of this name with these lines; empty paragraphs are left out.

    states: whether the model has internal states.
    """
    arguments, docstring = HEADS[name]
    return Function(
        name=name,
        arguments=", ".join(arguments),
        docstring=WITH_STATES.get(name, docstring) if states else docstring,
        paragraphs=tuple(paragraph for paragraph in paragraphs if paragraph) or (("pass",),),
    )


def copying(count: int) -> tuple[str, ...]:
    """What copies the parameters: a loop, since numba takes seconds to compile what a slice checks of their shapes."""
    return (f"for place in range({count}):", "    constants[place] = parameters[place]") if count else ()


@cache
def reserved() -> frozenset[str]:
    """Names that a model's symbols must not have: those the functions of a generated module use beside its symbols.

    They are read off the template, rendered without a model's lines, and off what the printer writes.
    """
    functions = (node for node in ast.parse(_bare_module()).body if isinstance(node, ast.FunctionDef))
    found = {name for node in functions for name in _names(node)}
    copied = ast.walk(ast.parse("\n".join(copying(1))))
    found |= {node.id for node in copied if isinstance(node, ast.Name)}
    return frozenset(found | set(_printed()))


@cache
def taken() -> frozenset[str]:
    """Names that a module has for itself: of its functions, its tables and what it imports."""
    body = ast.parse(_bare_module()).body
    functions = (node.name for node in body if isinstance(node, ast.FunctionDef))
    names = (node for statement in body for node in ast.walk(statement) if isinstance(node, ast.Name))
    tables = (name.id for name in names if isinstance(name.ctx, ast.Store))
    return frozenset((*functions, *tables, "math", "njit", "np"))


@cache
def _bare_module() -> str:
    """The template without a model's lines."""
    single: dict[str, str | int] = dict.fromkeys(("source", "sympy", "mass_matrix", "without_recurrence"), "")
    single |= {"factors": "0:", "coordinates": 0, "rhs_inputs": 0}
    single |= dict.fromkeys(("linear", "switched", "held", "contacts"), False)
    rows = ("origin", "state", "inputs", "positions", "outputs", "parameters", "constants", "recurrences", "lookups")
    tables = dict.fromkeys((*rows, "constraints", "events", "scene"), ())
    dicts: dict[str, dict[str, tuple[()]]] = {
        "parameter_sets": {},
        "solving": {},
        "patterns": dict.fromkeys(MATRICES, ()),
    }
    return (
        environment("python")
        .get_template("kernels.py.jinja")
        .render(
            **single,
            **tables,
            **dicts,
            system={"title": "", "name": ""},
            uses_math=False,
            functions=[function(name, ()) for name in HEADS],
        )
    )


def _names(function: ast.FunctionDef) -> Iterator[str]:
    """Arguments, and what is read or set in the body."""
    yield from (argument.arg for argument in function.args.args)
    for line in function.body:
        yield from (node.id for node in ast.walk(line) if isinstance(node, ast.Name))


def _printed() -> Iterator[str]:
    """Names beside symbols in what the printer writes: one expression of each kind."""
    x = se.Symbol("x")
    calls = [getattr(se, name)(*([x, x + 1] if name == "atan2" else [x])) for name in MATH_NAMES]
    others = [se.pi, se.E, se.sqrt(x), x**x, x**-2, se.Piecewise((x, se.And(x > 0, x < 1)))]
    printer = Printer({})
    for expression in (*calls, *others):
        nodes = ast.walk(ast.parse(printer(expression)))
        yield from (node.id for node in nodes if isinstance(node, ast.Name) and node.id != "x")
