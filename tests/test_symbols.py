"""Names that count to hundreds are told apart as quickly as others, and are seen nowhere but as they are."""

import pytest
import symengine as se
import sympy

from qddot.codegen.convert import convert, symbol
from qddot.codegen.generate import artefacts
from qddot.codegen.lagrange import derive
from qddot.codegen.lower import lower
from qddot.codegen.program import Program
from qddot.codegen.symbols import named
from qddot.model.system import Coordinate, Input, Output, Parameter, System


def _two_masses(first: str, second: str, stiffness: str) -> System:
    """Two masses, a spring that pushes only one way between them, and a base that shakes."""
    x, y, k, m, w = sympy.symbols(f"{first} {second} {stiffness} m w")
    xdot, ydot = (Coordinate(each, "m", "place").rate for each in (x, y))
    stretch = y - x
    return System(
        name="masses",
        title="Two masses",
        coordinates=(Coordinate(x, "m", "place"), Coordinate(y, "m", "place")),
        parameters=(Parameter(m, 2.0, "kg", "mass"), Parameter(k, 3.0, "N/m", "stiffness")),
        inputs=(Input(w, "m", "place of the base"),),
        kinetic_energy=m * (xdot**2 + ydot**2) / 2,
        potential_energy=k * (x - w) ** 2 / 2 + k * stretch**4 / 4,
        generalized_forces={y: sympy.Piecewise((-k * stretch, stretch > 0), (0, True))},
        outputs=(Output(sympy.Symbol("force"), k * sympy.Abs(stretch), "N", "force"),),
    )


@pytest.mark.parametrize("name", ["q", "q_{}dot", "tmp"])
@pytest.mark.parametrize("step", [1, 2, 10])
def test_differences_and_products_of_neighbours_have_hashes_of_their_own(name: str, step: int) -> None:
    row = [named(f"{name}_{k}") for k in range(100, 2100)]
    pairs = list(zip(row, row[step:], strict=False))
    for made in (row, [a - b for a, b in pairs], [a * b for a, b in pairs], [2 * a + 3 * b for a, b in pairs]):
        assert len(set(map(hash, made))) >= len(made) - 5


def test_a_symbol_is_one_object_whose_text_is_its_name() -> None:
    a = named("tmp_123")
    assert a is named("tmp_123")
    assert str(a) == repr(a) == a.name == "tmp_123"
    assert (a * se.Symbol("b")).free_symbols == {a, se.Symbol("b")}
    assert (a**2).diff(a) == 2 * a
    assert (3 * a).subs({a: 2}) == 6
    assert a._sympy_() == sympy.Symbol("tmp_123")


def test_what_is_converted_holds_the_same_symbols_in_conditions_and_functions_too() -> None:
    x, y = sympy.symbols("x_100 y")
    found = convert(sympy.Piecewise((sympy.sin(x) * y, sympy.And(x > 0, y < x)), (x**2, True)))
    assert found.free_symbols == {symbol(x), symbol(y)}
    assert found.diff(symbol(x)).free_symbols == {symbol(x), symbol(y)}
    assert convert(x + y) == symbol(x) + symbol(y)


def test_a_model_computes_the_same_whatever_its_names_count_to() -> None:
    names = ("x", "y", "xdot", "ydot", "k", "m", "w", "wdot", "mode_1")
    values = dict(zip(names, (0.3, 0.9, -0.2, 0.7, 3.1, 2.3, 0.1, 0.4, 0.0), strict=True))
    counted = {"x": "q_100", "y": "q_101", "xdot": "qdot_100", "ydot": "qdot_101", "k": "k_1234"}
    plain = lower(derive(_two_masses("x", "y", "k")))
    found = lower(derive(_two_masses("q_100", "q_101", "k_1234")))
    inputs = values | _constants(plain, values)
    others = {counted.get(name, name): value for name, value in values.items()}
    others |= _constants(found, others)
    for name in ("rhs", "energy", "jacobian", "outputs"):
        expected = plain.kernels[name].evaluate(inputs)
        assert found.kernels[name].evaluate(others) == pytest.approx(expected, rel=1e-13), name
    written = artefacts(found.equations.system, "model")
    assert all("____" not in text for text in written.values())
    assert "q_100" in written["masses.py"]
    assert "{100}" in written["masses.tex"]


def _constants(program: Program, values: dict[str, float]) -> dict[str, float]:
    """The values of a program's constants by name."""
    written = program.kernels["constants"].evaluate(values)
    return dict(zip(map(str, program.constants), written.values(), strict=True))
