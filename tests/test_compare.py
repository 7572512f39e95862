"""Hand-written equations beside the derived ones: every misprint is found in its place, and none is invented."""

import json
import re
from contextlib import suppress
from fractions import Fraction
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import symengine as se
import sympy
from commands import command
from hypothesis import given, settings
from hypothesis import strategies as st
from models import shipped_once

from qddot.codegen.calculus import terms
from qddot.codegen.compare.command import run
from qddot.codegen.compare.difference import compare
from qddot.codegen.compare.sheet import read
from qddot.codegen.compare.tree import CompareError
from qddot.codegen.equations.typeset import TypesetError, pdf
from qddot.codegen.lagrange import derive

ROOT = Path(__file__).parent.parent
PAPER = ROOT / "studies" / "paper"
MODELS = ("m113", "half_car", "chain", "double_pendulum", "cart_pole")


@cache
def derived(model):
    return derive(shipped_once(model))


def compared(folder, text, model):
    path = folder / "equations.txt"
    path.write_text(text)
    return compare(read(path), derived(model))


def said(comparison):
    return [(change.kind, change.found, change.expected) for change in comparison.changes]


def test_the_papers_misprints_are_found_and_no_others():
    sheet = read(PAPER / "equations_5_to_11.txt")
    found = {each.written.label: each for each in compare(sheet, derived("m113"))}
    assert [label for label, each in found.items() if each.equal] == ["(6)", "(7)", "(8)", "(9)"]
    assert said(found["(5)"]) == [("dots", ("q_6", "q_7", "q_1"), ("qdot_6", "qdot_7", "qdot_1"))]
    assert sorted(said(found["(10)"])) == [("index", ("l_7",), ("l_5",)), ("index", ("qdot_7",), ("qdot_5",))]
    (missing,) = found["(11)"].changes
    assert (missing.kind, str(missing.expression)) == ("missing", "-I_6*qddot_7")
    lines = sheet.text.split("\n")
    for change in found["(10)"].changes:
        line, column = sheet.place(change.at)
        assert lines[line - 1][column - 1 :].startswith(change.found[0])


def test_the_damage_of_the_scan_is_told_from_what_it_kept():
    found = compare(read(PAPER / "equations_5_to_11_scanned.txt"), derived("m113"))
    assert [each.written.label for each in found if each.equal] == ["(8)", "(9)"]
    eleven = found[-1]
    assert ("index", ("k_0",), ("k_6",)) in said(eleven)
    assert len(eleven.changes) == 2


@pytest.mark.parametrize(
    "text",
    [
        "q_1: m_1*qddot_1 + k_1*(q_1 - z_1) - k_6*d_1 - c_6*ddot_1 = -m_1*g",
        "q_1: -m_1*g - m_1*qddot_1 = k_1*q_1 - k_1*z_1 - k_6*d_1 - c_6*ddot_1",  # turned round
        "q_1: 2*m_1*qddot_1 + 2*k_1*(q_1 - z_1) - 2*k_6*d_1 - 2*c_6*ddot_1 = -2*m_1*g",
        "q_1: qddot_1 + (k_1*(q_1 - z_1) - k_6*d_1 - c_6*ddot_1)/m_1 = -g",  # divided by a mass
        "q_2: m_2*qddot_2 + k_2*(q_2 - z_2) - k_7*(q_6 + (l_2 + l_3 - l_1)*q_7 - q_2) = -m_2*g",  # quantities opened
        "let w = q_6 + a_2*q_7 - q_2\nq_2: m_2*qddot_2 + k_2*(q_2 - z_2) - k_7*w + 0.5*m_2*g = -m_2*g/2",
    ],
)
def test_other_ways_to_write_an_equation_are_equal(tmp_path, text):
    (found,) = compared(tmp_path, text, "m113")
    assert found.equal, said(found)


def test_trigonometric_identities_are_known(tmp_path):
    text = (
        "let M = m_1 + m_2\n"
        "theta_1: M*l_1**2*thetaddot_1"
        " + m_2*l_1*l_2*thetaddot_2*(cos(theta_1)*cos(theta_2) + sin(theta_1)*sin(theta_2))"
        " + m_2*l_1*l_2*thetadot_2**2*sin(theta_1 - theta_2)*(sin(theta_2)**2 + cos(theta_2)**2) + M*g*l_1*sin(theta_1)"
        " + c_1*thetadot_1 = c_2*(thetadot_2 - thetadot_1)\n"
        "theta_2: l_2*thetaddot_2 + l_1*thetaddot_1*cos(theta_1 - theta_2) - l_1*thetadot_1**2*sin(theta_1 - theta_2)"
        " + g*cos(theta_2) + c_2/(m_2*l_2)*(thetadot_2 - thetadot_1) = 0"
    )
    one, two = compared(tmp_path, text, "double_pendulum")
    assert one.equal
    assert sorted(change.kind for change in two.changes) == ["extra", "missing"]
    assert str(two.changes[0].expression) == "g*cos(theta_2)"


@pytest.mark.parametrize(
    ("change", "kind"),
    [
        (("+ k_1", "- k_1"), "sign"),
        (("q_1 - z_1", "q_1 + z_1"), "sign"),
        (("k_6*", "k_7*"), "index"),
        (("k_6*", "2*k_6*"), "factor"),
        (("k_6*", ""), "factor"),
        (("k_6*", "k_6*l_3*"), "factor"),
        ((" - c_6*ddot_1", ""), "missing"),
        ((" - c_6*ddot_1", " - c_6*ddot_1 + c_10*ddot_5"), "extra"),
        (("m_1*qddot_1", "m_1*qdot_1"), "dots"),
        (("k_1*(", "c_6*("), "symbol"),
        (("= -m_1*g", "= m_1*g"), "sign"),
    ],
)
def test_each_kind_of_misprint_is_called_by_its_name(tmp_path, change, kind):
    text = "q_1: m_1*qddot_1 + k_1*(q_1 - z_1) - k_6*(q_6 + a_1*q_7 - q_1) - c_6*ddot_1 = -m_1*g"
    assert change[0] in text
    (found,) = compared(tmp_path, text.replace(*change), "m113")
    assert [each.kind for each in found.changes] == [kind]


def sides(equations, k):
    """The terms of the derived equation, as text in the grammar."""
    inertia = [
        equations.mass[max(k, j), min(k, j)] * acceleration
        for j, acceleration in enumerate(equations.accelerations)
        if (max(k, j), min(k, j)) in equations.mass
    ]
    others = (equations.gyroscopic[k], equations.conservative[k], equations.dissipative[k], -equations.applied[k])
    return [str(term) for term in (*inertia, *(term for part in others for term in terms(part))) if term != 0]


NAME = re.compile(r"[A-Za-z]\w*")


@st.composite
def planted(draw):
    """A model, the correct terms of each equation, and those with one or two errors, by equation."""
    model = draw(st.sampled_from(MODELS))
    equations = derived(model)
    right = [sides(equations, k) for k in range(len(equations.coordinates))]
    wrong = [list(found) for found in right]
    for k in draw(st.sets(st.integers(0, len(right) - 1), min_size=1, max_size=2)):
        place = draw(st.integers(0, len(wrong[k]) - 1))
        wrong[k][place] = draw(misprint(wrong[k][place], equations))
    return model, right, wrong


@st.composite
def misprint(draw, term, equations):
    kind = draw(st.sampled_from(["sign", "factor", "index"]))
    if kind == "sign":
        return f"-({term})"
    if kind == "factor":
        return f"{draw(st.sampled_from(['2', '3', '0.5', '1/4']))}*({term})"
    groups = (equations.coordinates, equations.velocities, equations.parameters, equations.inputs)
    places = [
        (match.start(), match.end(), other)
        for match in NAME.finditer(term)
        for group in groups
        if match[0] in map(str, group)
        for other in map(str, group)
        if other != match[0] and other.partition("_")[0] == match[0].partition("_")[0]
    ]
    if not places:
        return f"-({term})"
    start, end, other = draw(st.sampled_from(places))
    return term[:start] + other + term[end:]


class Point(dict):
    """Values of names at five random points; of what a model defines, of what that stands for, by SymPy and numpy."""

    def __init__(self, definitions):
        super().__init__(sin=np.sin, cos=np.cos)
        self.definitions = {str(symbol): definition for symbol, definition in definitions.items()}
        self.chance = np.random.default_rng(3)

    def __missing__(self, name):
        definition = self.definitions.get(name)
        if definition is None:
            value = self.chance.uniform(0.3, 1.7, 5)
        else:
            inside = sorted(definition.free_symbols, key=str)
            value = np.broadcast_to(sympy.lambdify(inside, definition)(*(self[str(each)] for each in inside)), 5)
        return self.setdefault(name, value)


@cache
def point(model):
    return Point(derived(model).system.definitions)


def values(model, terms):
    """A sum of terms at random points: shares nothing with the comparison."""
    return np.broadcast_to(sum(eval(term, {}, point(model)) for term in terms), 5)


@given(planted())
@settings(max_examples=60, deadline=None)
def test_planted_errors_are_found_each_and_only_those(tmp_path_factory, case):
    model, right, wrong = case
    equations = derived(model)
    heads = [str(q) for q in equations.coordinates]
    text = "\n".join(f"{q}: {' + '.join(f'({t})' for t in found)} = 0" for q, found in zip(heads, wrong, strict=True))
    comparisons = compared(tmp_path_factory.mktemp("planted"), text, model)
    for comparison, true, printed in zip(comparisons, right, wrong, strict=True):
        if printed == true:
            assert comparison.equal
            continue
        one, other = values(model, true), values(model, printed)
        really = not np.allclose(one, other, rtol=1e-9, atol=1e-12)
        if comparison.factor == 1:
            assert comparison.equal == (not really), (true, printed, said(comparison))
        else:  # a one-term equation, or one multiplied as a whole, is a multiple of the derived one
            assert np.ptp(other / one) < 1e-9 or not comparison.equal
        explained = se.Add(*(change.expression for change in comparison.changes))
        rest = comparison.printed - comparison.factor * comparison.derived - explained
        assert size_at_a_point(rest) < 1e-25 * (1 + size_at_a_point(comparison.printed))
        if really and comparison.factor == 1:
            assert len(comparison.changes) <= 3
            assert any(change.at is not None for change in comparison.changes)


def size_at_a_point(expression):
    point = {s: se.Rational(100 + 7 * k, 211) for k, s in enumerate(sorted(expression.free_symbols, key=str))}
    return abs(float(expression.subs(point).n(150, real=True)))


REFUSED = {
    "q_1: m_1*qddot_1 + k_11*q_1 = 0": "line 1, column 20: unknown symbol k_11; did you mean k_1?",
    "q_1: m_1*qddot_1\n  + k_1*(q_1 - zz) = 0": "line 2, column 16: unknown symbol zz",
    "q_9: m_1 = 0": "line 1, column 1: q_9 has no equation; did you mean q_",
    "q_1: m_1*qddot_1": "line 1, column 4: an equation has one =, found 0",
    "q_1: m_1 == g": "an equation has one =, found 2",
    "q_1: q_7(l_3 + l_4) = 0": "line 1, column 6: q_7 is no function",
    "q_1: q_7^2 = 0": "write powers with **",
    "q_1: (q_1)(q_2) = 0": "between factors write *",
    "q_1: q_1 + = 0": "this is no expression",
    "q_1: (q_1 = 0": "this is no expression",
    "q_1: q_1) + (q_2 = 0": "this is no expression",
    "q_1: = 0": "expected an expression, found nothing",
    "q_1: __import__('os').getcwd() = 0": "only numbers, names",
    "q_1: [q for q in (1, 2)] = 0": "only numbers, names",
    "q_1: q_1 if g else 0 = 0": "only numbers, names",
    "q_1: 9**9**9**9*q_1 = 0": "too large",
    "q_1: ((2**4000)**4000)*q_1 = 0": "too large",
    "q_1: sin(q_1, q_2) = 0": "sin takes 1 argument",
    "q_1: " + "(" * 300 + "q_1" + ")" * 300 + " = 0": "no expression",
    "q_1: " + "-" * 20000 + "q_1 = 0": "",
    "q_1: (q_1 + q_2 + q_3 + q_4 + q_5 + q_6 + q_7 + g + m_1 + m_2)**9 = 0": "too many to compare",
    "q_1: (q_1*9**999)**999 = 0": "too large",
    "q_1: q_1**(9**9) = 0": "too large",
    "q_1: q_1/(1 - 1) = 0": "divides by zero",
    "q_1: sqrt(-2)*q_1 = 0": "root of a negative number",
    "q_1: 1e999*q_1 = 0": "no finite number",
    "let a = b\nlet b = q_1\nq_1: a = 0": "unknown symbol b",
    "let a = a\nq_1: a = 0": "explained by itself",
    "symbols q-1\nq_1: g = 0": "cannot be a name",
    "m_1*qddot_1 = 0": "expected model, symbols, let, or an equation",
    "# nothing": "there is no equation",
    "model m113\nmodel chain\nq_1: g = 0": "once in a file",
}


@pytest.mark.parametrize("text", REFUSED)
def test_what_follows_no_grammar_is_refused_with_its_place(tmp_path, text):
    with pytest.raises(CompareError) as refused:
        compared(tmp_path, text, "m113")
    assert str(tmp_path / "equations.txt") in str(refused.value)
    assert REFUSED[text] in str(refused.value)


@given(st.text(alphabet="q_1m2k6()+-*/=., \n#:^[]{}'\"lambdαé0e", max_size=60))
@settings(max_examples=300, deadline=None)
def test_any_text_is_read_or_refused(tmp_path_factory, text):
    with suppress(CompareError):
        compared(tmp_path_factory.mktemp("any"), f"q_1: {text} = 0", "m113")


def test_exact_decimals(tmp_path):
    (found,) = compared(tmp_path, "q_2: 0.1*qddot_2*m_2 + (k_2 + k_7)*q_2*0.1 = -0.1*m_2*g", "one_axle")
    assert found.equal
    assert found.factor == se.Rational(*Fraction("0.1").as_integer_ratio())


def test_the_command_tells_in_text_json_and_latex(tmp_path, capsys):
    path = PAPER / "equations_5_to_11.txt"
    assert run(path, None, "text") == 1
    plain = capsys.readouterr().out
    assert "4 of 7 equations are equal" in plain
    assert "l₇ should be l₅" in plain
    assert run(path, None, "json") == 1
    data = json.loads(capsys.readouterr().out)
    assert [each["equal"] for each in data["equations"]] == [False, True, True, True, True, False, False]
    assert data["equations"][5]["differences"][0]["line"] == 26
    assert run(path, None, "latex") == 1
    tex = capsys.readouterr().out
    assert r"\dot{q}_{7}" in tex
    (tmp_path / "compare.tex").write_text(tex)
    try:
        assert pdf(tmp_path / "compare.tex", tmp_path).read_bytes().startswith(b"%PDF")
    except TypesetError as error:
        if "not installed" not in str(error):
            raise


def test_equal_equations_exit_with_0_and_slips_with_2(tmp_path, capsys):
    path = tmp_path / "own.txt"
    path.write_text("q_2: m_2*qddot_2 + (k_2 + k_7)*q_2 = -m_2*g")
    assert run(path, "one_axle", "text") == 0
    assert "1 of 1 equation is equal to the one derived" in capsys.readouterr().out
    done = command("compare", path)
    assert done.returncode == 2
    assert done.stderr.startswith("error: ")
    assert "says no model" in done.stderr
