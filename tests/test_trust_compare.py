"""`qddot compare` says "equal" of nothing that differs: not beyond a double's range, nor where a kink hides."""

from contextlib import nullcontext
from functools import cache

import mpmath
import pytest
import symengine as se
from hypothesis import given, settings
from hypothesis import strategies as st
from models import shipped_once
from promptness import within

from qddot.codegen.compare.command import run
from qddot.codegen.compare.difference import compare
from qddot.codegen.compare.sheet import read
from qddot.codegen.compare.tree import CompareError
from qddot.codegen.compare.zero import vanishes
from qddot.codegen.lagrange import derive

TRUE = (
    "q_1: m_1*qddot_1 + k_1*(q_1 - z_1) - k_6*(q_6 - q_7*(l_3 + l_4 + l_11) - q_1)"
    " - c_6*(qdot_6 - qdot_7*(l_3 + l_4 + l_11) - qdot_1) + m_1*g = "
)


@cache
def derived(model):
    return derive(shipped_once(model))


def verdict(folder, text):
    path = folder / "equations.txt"
    path.write_text(text)
    (found,) = compare(read(path), derived("m113"))
    return found


@pytest.mark.parametrize("left", ["1e60", "exp(300)", "cosh(1000)", "1e-320", "exp(10000*q_1)", "exp(exp(exp(1e6)))"])
def test_what_doubles_cannot_hold_differs_and_exits_with_1(tmp_path, capsys, left):
    (tmp_path / "equations.txt").write_text(f"model m113\nq_1: {left} = 0\n")
    assert run(tmp_path / "equations.txt", None, "text") == 1
    assert "differs" in capsys.readouterr().out


DIFFERENT = [
    "1e-60",
    "1e-200*1e-200",
    "1e300*1e300",
    "1e-300*1e-300*q_1",
    "exp(-1000*abs(q_1))",
    "exp(-exp(100*q_1))",
    "cos(exp(-100*q_1)) - 1",  # 1 in the first 40 digits
    "exp(1e-40*q_1) - 1",
    "sin(1e-100)",
    "0.1 - 0.10000000000000000000001",
    "abs(q_1) - q_1",
    "sqrt(q_1**2) - q_1",
    "sign(q_1 - 30) + 1",  # 0 for all but large q_1
    "sign(q_1 - 5e8) + 1",  # and at none of the points that are tried
    "log(abs(q_1)) - log(q_1)*1.0000001",
    "asin(q_1/3) - 1.00001*asin(q_1/3)",
    "1e60*m_1*qddot_1",
]
EQUAL = [
    "0",
    "cosh(q_1)**2 - sinh(q_1)**2 - 1",
    "cosh(1000*q_1)**2 - sinh(1000*q_1)**2 - 1",
    "exp(500*q_1)*exp(-500*q_1) - 1",
    "1e300*1e300*1e-300 - 1e300",
    "abs(q_1) - q_1*sign(q_1)",
    "sqrt(q_1**2) - abs(q_1)",
    "sign(q_1 - 50) - abs(q_1 - 50)/(q_1 - 50)",
    "acos(q_1/10) + asin(q_1/10) - pi/2",  # real only where |q_1| < 10
    "sqrt(l_3**2) - l_3",  # a length
    "exp(log(k_1)*2) - k_1**2",
]


@pytest.mark.parametrize("addend", DIFFERENT)
def test_a_difference_is_found_however_small_large_or_hidden(tmp_path, addend):
    assert not verdict(tmp_path, TRUE + addend).equal


@pytest.mark.parametrize("addend", EQUAL)
def test_an_identity_is_equal_at_any_magnitude(tmp_path, addend):
    found = verdict(tmp_path, TRUE + addend)
    assert found.equal
    assert found.factor == 1


@given(
    number=st.integers(-600, 600),
    name=st.sampled_from(["q_1", "qdot_7", "k_1", "F", "t"]),
    function=st.sampled_from(["{}", "exp({})", "sinh({})", "abs({})", "atan({})"]),
)
@settings(max_examples=40, deadline=None)
def test_an_addend_of_any_size_makes_a_difference(tmp_path_factory, number, name, function):
    size = f"10**{number}" if number >= 0 else f"10**({number})"
    addend = function.format(f"{size}*{name}")
    assert not verdict(tmp_path_factory.mktemp("size"), f"{TRUE}{size}*{addend}").equal


def test_a_multiple_by_a_huge_or_tiny_number_is_a_multiple(tmp_path):
    left, _, right = TRUE.removeprefix("q_1: ").rpartition("=")
    for size in ("10**200", "1e-200*1e-200"):
        found = verdict(tmp_path, f"q_1: {size}*({left}) = 0{right}")
        assert found.equal
        assert str(found.factor) in (str(10**200), f"1/{10**400}")


def test_an_abbreviation_that_is_worth_nothing_is_nothing(tmp_path):
    assert verdict(tmp_path, f"let a = 0\n{TRUE}a*q_2").equal


@pytest.mark.parametrize("number", ["1e999", "1e-400", "1e-999999999"])
def test_a_number_that_would_be_read_as_another_is_refused(tmp_path, number):
    with pytest.raises(CompareError, match=f"line 1, column .*{number}"):
        verdict(tmp_path, f"{TRUE}{number}*q_1")


def test_numbers_of_any_length_are_printed(tmp_path, capsys):
    (tmp_path / "long.txt").write_text("model m113\nq_1: 10**400/13*q_1 + 1e-300*1e-300*qdot_1 = 0e999999999\n")
    for form in ("text", "json", "latex"):
        assert run(tmp_path / "long.txt", None, form) == 1
        assert "13" in capsys.readouterr().out


def test_the_verdict_of_a_smooth_function_is_mpmaths():
    x, y = se.symbols("x y")
    cases = {
        se.sin(x + y) - se.sin(x) * se.cos(y) - se.cos(x) * se.sin(y): True,
        se.exp(x + y) - se.exp(x) * se.exp(y) * (1 + se.Integer(10) ** -300): False,
        se.atan(x) + se.atan(1 / x) - se.pi / 2: False,  # but for negative x
    }
    for expression, zero in cases.items():
        assert vanishes(expression, {}) is zero
    with mpmath.workdps(400):
        assert abs(mpmath.exp(1.5) - mpmath.exp(1) * mpmath.exp(0.5) * (1 + mpmath.mpf(10) ** -300)) > 0
    assert vanishes(se.atan(x) + se.atan(1 / x) - se.pi / 2, {x: 2.0})


def test_what_is_real_nowhere_is_not_taken_for_zero():
    x = se.Symbol("x")
    assert not vanishes(se.log(-1 - x**2) - se.log(-1 - x**2 + se.Integer(10) ** -20), {})


@within(20)
def test_a_verdict_comes_in_seconds(tmp_path):
    for addend in ("exp(exp(exp(1000*q_1)))", "sin(10**300*q_1)", "(1 + q_1)**3999", "cosh(1e300*q_1)"):
        with nullcontext() if addend[0] != "(" else pytest.raises(CompareError):
            assert not verdict(tmp_path, TRUE + addend).equal
