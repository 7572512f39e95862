"""What `generate` writes compiles, and no expression keeps it for ever."""

import errno
import io
import os
import re
from pathlib import Path

import mpmath
import pytest
import symengine as se
from hypothesis import given, settings
from hypothesis import strategies as st
from promptness import within
from sympy import Float, Integer, Rational, exp, lambdify, log, symbols

from qddot.codegen.generate import artefacts, generate
from qddot.codegen.lagrange import derive
from qddot.codegen.lower import lower
from qddot.codegen.rules import collect
from qddot.codegen.wall import check_module
from qddot.model.system import Coordinate, ModelError, Parameter, System

ROOT = Path(__file__).parent.parent

x, xdot, y, ydot, k, m = symbols("x xdot y ydot k m")


def model(potential, kinetic=m * (xdot**2 + ydot**2) / 2, **more):
    coordinates = (Coordinate(x, "m", "x"), Coordinate(y, "m", "y"))
    parameters = (Parameter(k, 1.0, "N", "k"), Parameter(m, 1.0, "kg", "mass"))
    return System("own", "Own", coordinates, parameters, kinetic, potential, **more)


SYMBOLIC_POWERS = [
    k * (x + 2) ** y,
    k * (x + 2) ** (x + y + 1),
    k * (x + 2) ** y * (y + 3) ** x,
    k * (x + k) ** (y + k) * log(x + k),
    k * (x + 2) ** (y * x),
    k * (1 + x) ** exp(y),
    k * x ** (x**y),
]


@pytest.mark.parametrize("potential", SYMBOLIC_POWERS, ids=str)
def test_powers_of_symbols_are_generated_in_a_second_and_right(potential):
    with within(5):
        program = lower(derive(model(potential)))
    point = {"x": 0.7, "y": 0.4, "xdot": 0.3, "ydot": -0.2, "k": 1.3, "m": 2.5, "t": 0.0}
    constants = program.kernels["constants"].evaluate(point)
    named = {str(symbol): constants[f"constants[{i}]"] for i, symbol in enumerate(program.constants)}
    slopes = program.kernels["jacobian"].evaluate(point | named)

    energy = lambdify((x, y), potential.subs(k, Rational(13, 10)), "mpmath")
    with mpmath.workdps(40):
        for orders, place in (((2, 0), "matrix[2, 0]"), ((1, 1), "matrix[3, 0]"), ((0, 2), "matrix[3, 1]")):
            expected = -mpmath.diff(energy, (0.7, 0.4), orders) / point["m"]
            assert slopes[place] == pytest.approx(float(expected), rel=1e-8)


SE = se.symbols("a b c")


@given(
    st.lists(
        st.tuples(st.integers(-3, 3), st.sampled_from(SE), st.integers(-2, 2), st.sampled_from(SE)),
        min_size=2,
        max_size=6,
    )
)
@settings(max_examples=100, deadline=None)
def test_collecting_factors_keeps_the_value_where_exponents_are_sums(terms):
    base = SE[0] + 2
    total = se.Add(*(number * first * base ** (SE[1] + power) * second for number, first, power, second in terms))
    point = dict(zip(SE, (0.7, 1.1, 1.9), strict=True))
    assert float(collect(total).subs(point)) == pytest.approx(float(total.subs(point)), rel=1e-9, abs=1e-9)


TOO_LARGE = {
    Integer(10) ** 400 * k * x: "it is too large for a floating-point number",
    Integer(10) ** -400 * k * x: "it is too small for a floating-point number",
    k * x ** (10**20): "the exponent is beyond 2147483647",
    k * x ** Float("1e30") + y * Float("1e400"): "it is too large for a floating-point number",
}


@pytest.mark.parametrize("potential", TOO_LARGE, ids=lambda e: str(e)[:20])
def test_a_number_that_no_double_holds_is_refused_before_anything_is_written(tmp_path, potential):
    into = tmp_path / "kernels"
    generate(model(k * x**2), into)
    before = {path: path.read_bytes() for path in into.iterdir()}
    with pytest.raises(ModelError, match="model own: ") as refused:
        generate(model(potential), into)
    assert TOO_LARGE[potential] in str(refused.value)
    assert {path: path.read_bytes() for path in into.iterdir()} == before


def test_a_large_power_that_compiles_is_generated(tmp_path):
    assert "x**99999999" in generate(model(k * x ** (10**8)), tmp_path).read_text()


GOOD = artefacts(model(k * (x**2 + y**2) / 2), "test.py")["own.py"]


def test_the_wall_lets_every_generated_module_pass():
    for path in (ROOT / "generated").glob("[a-z]*.py"):
        check_module(path.read_text())
    check_module(GOOD)


@pytest.mark.parametrize(
    ("good", "bad", "said"),
    [
        ("x = state[0]", "x = inf", "inf is no number"),
        ("x = state[0]", "x = 1e999", "a number that no double"),
        ("x = state[0]", "x = 2j", "a number that no double"),
        ("x = state[0]", f"x = {10**30}", "a number that no double"),
        ("x = state[0]", "x = = 3", "no Python: `x = = 3`: invalid syntax"),
        ("x = state[0]", "x = state[0]\n    state = x", "state is a name that the generated function"),
        ("x = state[0]", "x = state[0]\n    x = 2 * x", "x is a name"),
        ("x = state[0]", "math = state[0]\n    x = math.sin(math)", "math is a name"),
    ],
)
def test_the_wall_stops_what_would_not_compile_or_mean_something_else(good, bad, said):
    assert good in GOOD
    with pytest.raises(ModelError, match=re.escape(said)):
        check_module(GOOD.replace(good, bad))


def test_generate_given_a_function_says_to_call_it(tmp_path):
    def system():
        return model(k * x**2)

    with pytest.raises(ModelError, match=r"expected a qddot.model.System: call it, system\(\)"):
        generate(system, tmp_path)
    with pytest.raises(ModelError, match="found 'm113', expected"):
        generate("m113", tmp_path)
    assert not list(tmp_path.iterdir())


def test_a_full_disk_leaves_what_was_there(tmp_path, monkeypatch):
    generate(model(k * x**2), tmp_path)
    before = {path: path.read_bytes() for path in tmp_path.iterdir()}
    opened, calls = os.fdopen, []

    class Full(io.TextIOWrapper):
        def write(self, text):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    def full_second(handle, mode, encoding):
        calls.append(handle)
        return opened(handle, mode, encoding=encoding) if len(calls) == 1 else Full(opened(handle, "wb"), encoding)

    monkeypatch.setattr(os, "fdopen", full_second)
    with pytest.raises(OSError, match=r"own.tex cannot be written: No space left on device; nothing was changed"):
        generate(model(k * x**4), tmp_path)
    assert len(calls) == 2
    assert {path: path.read_bytes() for path in tmp_path.iterdir()} == before


def test_a_place_that_cannot_be_written_is_named(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(OSError, match=r"own.py cannot be written: .*; nothing was changed"):
        generate(model(k * x**2), tmp_path / "file")
    assert (tmp_path / "file").read_text() == ""
