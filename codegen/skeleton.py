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
    "positions": (("parameters", "values"), "Positions of the inputs in POSITION, m ahead of the model's origin."),
}

#: Those that write the entries of a matrix, at places that the module declares.
MATRICES = ("jacobian", "input_jacobian", "mass")

Paragraphs = tuple[tuple[str, ...], ...]


@dataclass(frozen=True)
class Function:
    """A generated function; paragraphs are lists of finished lines."""

    name: str
    arguments: str
    docstring: str
    paragraphs: Paragraphs


def function(name: str, paragraphs: Iterable[tuple[str, ...]]) -> Function:
    """The generated function of this name with these lines; empty paragraphs are left out."""
    arguments, docstring = HEADS[name]
    return Function(
        name=name,
        arguments=", ".join(arguments),
        docstring=docstring,
        paragraphs=tuple(paragraph for paragraph in paragraphs if paragraph) or (("pass",),),
    )


@cache
def reserved() -> frozenset[str]:
    """Names that a model's symbols must not have: those the functions of a generated module use beside its symbols.

    They are read off the template, rendered without a model's lines, and off what the printer writes.
    """
    single: dict[str, str | int] = {"source": "", "sympy": "", "mass_matrix": "", "without_recurrence": ""}
    single |= {"coordinates": 0, "rhs_inputs": 0, "linear": False}
    rows = ("origin", "state", "inputs", "positions", "outputs", "parameters", "constants", "recurrences")
    tables = dict.fromkeys(rows, ())
    dicts: dict[str, dict[str, tuple[()]]] = {"parameter_sets": {}, "patterns": {}}
    text = (
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
    found = {name for node in ast.parse(text).body if isinstance(node, ast.FunctionDef) for name in _names(node)}
    return frozenset(found | set(_printed()))


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
