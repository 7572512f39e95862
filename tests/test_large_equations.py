"""LaTeX of large models: the first equations, and a word on the others."""

import re

import symengine as se
from sympy import Add, Rational, symbols

from benchmarks.cases import carrier
from qddot.codegen.calculus import terms
from qddot.codegen.equations.notation import describe
from qddot.codegen.equations.tex import tex
from qddot.codegen.generate import _MOST_TERMS
from qddot.codegen.lagrange import derive
from qddot.codegen.printer import Printer
from qddot.model import m113
from qddot.model.inertia import Inertia, inertia
from qddot.model.system import Coordinate, Parameter, System


def row(n):
    """A chain whose names have numbers that nothing tells from letters: it is written out."""
    q, m, k = symbols(f"q1:{n + 1}"), symbols(f"m1:{n + 1}"), symbols("k")
    made = tuple(Coordinate(each, "m", f"displacement of mass {i}") for i, each in enumerate(q, 1))
    return System(
        name="row",
        title="A row",
        coordinates=made,
        parameters=(*(Parameter(each, 1.0, "kg", "mass") for each in m), Parameter(k, 1.0, "N/m", "stiffness")),
        kinetic_energy=[one * each.rate**2 / 2 for one, each in zip(m, made, strict=True)],
        potential_energy=[Rational(1, 2) * k * (b - a) ** 2 for a, b in zip((0, *q[:-1]), q, strict=True)],
    )


def test_a_large_model_has_its_first_equations_and_says_how_many_are_left_out():
    equations = derive(row(30))
    text = tex(describe(equations, "row.py", most=60))
    numbers = re.search(r"the first (\d+) of 30 equations; the others are left out", text)
    assert numbers
    written = int(numbers[1])
    assert 5 <= written <= 20
    assert text.count(r"\equationof{") == written
    assert rf"Displacement of mass {written}, $" in text
    assert rf"Displacement of mass {written + 1}, $" not in text
    assert r"\operatorname{diag}(" in text
    assert re.search(r"These are its first \d+ of 30 rows\.", text)
    whole = tex(describe(equations, "row.py"))
    assert whole.count(r"\equationof{") == 30
    assert "left out" not in whole


def test_the_first_equation_is_there_however_long_it_is():
    document = describe(derive(m113.system()), "m113.py", most=1)
    assert len(document.motion) == 1
    assert document.mass.size == 1


def test_the_file_of_a_chain_of_hundreds_is_small():
    text = tex(describe(derive(row(400)), "row.py", _MOST_TERMS))
    assert len(text) < 300e3
    assert "equations; the others are left out" in text


def test_what_is_long_in_any_section_is_cut_and_says_so(monkeypatch):
    """A chain's energies and tables grow with it, whatever its equations of motion do."""
    document = describe(derive(row(300)), "row.py", _MOST_TERMS)
    assert len(tex(document)) > 60_000
    monkeypatch.setattr("qddot.codegen.equations.tex.LARGEST", 60_000)
    monkeypatch.setattr("qddot.codegen.equations.abridged._ROOM", 2_000)
    text = tex(document)
    assert len(text) <= 60_000
    assert "of each section the first formulas are here" in text
    written = text.split(r"\section*{Coordinates")[1].split(r"\section*")[0]
    rows, left_out = written.count("isplacement of mass"), re.search(r"(\d+) more are left out\.", written)
    assert rows + int(left_out[1]) == 300
    assert re.search(r"\\cdots \\text\{\((\d+) more lines\)\}", text)


def test_a_document_that_is_not_too_long_is_whole():
    text = tex(describe(derive(row(60)), "row.py", _MOST_TERMS))
    assert "left out." not in text
    assert "more lines" not in text


def test_a_sum_of_thousands_of_terms_is_python():
    symbols = [se.Symbol(f"x_{k}") for k in range(5000)]
    terms = [-x if k % 3 else x for k, x in enumerate(symbols)]
    text = Printer({symbol: k for k, symbol in enumerate(symbols)})(se.Add(*terms))
    found = eval(text, {f"x_{k}": float(k) for k in range(5000)})
    assert found == sum(-k if k % 3 else k for k in range(5000))


def test_a_kinetic_energy_of_thousands_of_terms_is_judged():
    """Python reads no sum of more than some 3000 terms in one piece."""
    v, masses = symbols("v_1 v_2"), symbols("m_1:3501")
    defaults = dict.fromkeys(masses, 1.0)
    energy = Add(*(m * v[k % 2] ** 2 / 2 for k, m in enumerate(masses)))
    assert inertia(energy, v, {}, defaults) == Inertia()


def test_equations_that_are_long_as_they_are_written_are_left_out_too():
    """Terms that are opened to be read may be many times those that were derived."""
    equations = derive(carrier.system(2))
    document = describe(equations, "carrier.py", most=130)
    lengths = [len(formula.left.terms) + len(formula.right.terms) for formula in document.motion]
    derived = [len(terms(part[0])) for part in (equations.gyroscopic, equations.conservative, equations.dissipative)]
    assert sum(derived) < 20 < lengths[0]
    assert 1 <= len(lengths) < len(equations.coordinates)
    assert sum(lengths) <= 130
    assert set(document.mass.entries) == {at for at in equations.mass if at[0] < len(lengths)}
    assert describe(equations, "carrier.py").motion[: len(lengths)] == document.motion
