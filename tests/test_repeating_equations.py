"""What repeats is written once, with an index: put back number by number it is what was derived."""

import math
import re
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
import symengine as se
from chains import Kind, kinds, system
from hypothesis import example, given, settings
from sympy import Add, symbols

from qddot.codegen.calculus import terms
from qddot.codegen.equations.entries import Entry, ranged
from qddot.codegen.equations.notation import describe
from qddot.codegen.equations.order import Order
from qddot.codegen.equations.page import html
from qddot.codegen.equations.phrases import Call, Constant, Formula, Name, Number, Power, Sum, Summation, Term
from qddot.codegen.equations.repeating import Repeating
from qddot.codegen.equations.terminal import text
from qddot.codegen.equations.tex import tex
from qddot.codegen.lagrange import derive
from qddot.model import chain
from qddot.model.system import Coordinate, Parameter, System

MOST = 10_000


def with_number(expression, index, number):
    """An expression in which the index of all symbols is this number."""
    found = {}
    for symbol in expression.free_symbols:
        if one := re.fullmatch(rf"(.+_){index}([+-]\d+)?", str(symbol)):
            found[symbol] = se.Symbol(f"{one[1]}{number + int(one[2] or 0)}")
    return expression.subs(found)


@settings(max_examples=10, deadline=None)
@given(kind=kinds)
@example(kind=Kind(20, coupling="exp", odd=frozenset((9,)), named=True))
@example(kind=Kind(20, own=True, odd=frozenset((7,)), second=True, hub=True, named=True, states=True))
@example(kind=Kind(20, two=True, interleaved=True, own=True, ground="cos", cubic=True, inputs=True))
def test_sums_put_back_are_those_of_the_model(kind):
    equations = derive(system(kind))
    repeating = Repeating(Order(equations))
    for energy in (equations.kinetic, equations.potential, equations.dissipation):
        alone, series = repeating.terms(terms(energy))
        assert len(alone) + sum(each.range.last - each.range.first + 1 for each in series) == len(terms(energy))
        again = [
            with_number(each.term, each.range.index, number)
            for each in series
            for number in range(each.range.first, each.range.last + 1)
        ]
        assert se.expand(se.Add(*alone, *again) - energy) == 0
    assert series


FUNCTIONS = {"exp": math.exp, "sin": math.sin, "cos": math.cos, "tanh": math.tanh}


def value(phrase, values, numbers):  # noqa: PLR0911 - a case for each kind of phrase
    """What a sum, term or factor is worth. numbers: of the indices."""
    match phrase:
        case Formula(left, right):
            return value(left, values, numbers) - value(right, values, numbers)
        case Sum(parts):
            return math.fsum(value(part, values, numbers) for part in parts)
        case Term(negative, coefficient, above, below):
            found = float(coefficient) * math.prod(value(each, values, numbers) for each in above)
            return (-found if negative else found) / math.prod(value(each, values, numbers) for each in below)
        case Summation(index, first, last, inside):
            return math.fsum(value(inside, values, {**numbers, index: k}) for k in range(first, last + 1))
        case Name(name):
            stem, _, end = name.rpartition("_")
            index, offset = end[:1], end[1:]
            return values[f"{stem}_{numbers[index] + int(offset or 0)}" if index in numbers else name]
        case Constant(name):
            return {"e": math.e, "pi": math.pi}[name]
        case Number(number):
            return float(number)
        case Power(base, exponent):
            raised = exponent if isinstance(exponent, Fraction) else value(exponent, values, numbers)
            return value(base, values, numbers) ** float(raised)
        case Call(function, (argument,)):
            return FUNCTIONS[function](value(argument, values, numbers))
    raise NotImplementedError(phrase)


@settings(max_examples=6, deadline=None)
@given(kind=kinds)
@example(kind=Kind(20))
@example(kind=Kind(20, two=True, interleaved=True))
@example(kind=Kind(12, hub=True, coupling="exp", ground="quotient"))
def test_equations_put_back_are_those_of_the_model(kind):
    """The equation with an index is, for each number, worth what that equation is by itself."""
    equations = derive(system(kind))
    short, whole = (describe(equations, "row.py", most) for most in (MOST, None))
    assert short.left_out == 0
    rng = np.random.default_rng(4)
    values = {str(symbol): rng.uniform(0.5, 1.5) for symbol in Order(equations).symbols}
    found = {}
    for entry, formula in zip(short.subjects, short.motion, strict=True):
        if span := re.search(r", (\w) = (\d+) to (\d+)$", entry.meaning):
            index, numbers = span[1], range(int(span[2]), int(span[3]) + 1)
            stem, _, end = entry.symbol.rpartition("_")
            found |= {f"{stem}_{k + int(end[1:] or 0)}": value(formula, values, {index: k}) for k in numbers}
        else:
            found[entry.symbol] = value(formula, values, {})
    expected = {
        entry.symbol: value(formula, values, {}) for entry, formula in zip(whole.subjects, whole.motion, strict=True)
    }
    assert found == pytest.approx(expected, rel=1e-12, abs=1e-12)


def test_a_file_of_a_chain_does_not_grow_with_it():
    short, long = (tex(describe(derive(chain.system(n)), "chain.py", 750)) for n in (20, 400))
    assert len(long) < len(short) + 100
    assert r"T & = \sum_{j=1}^{400} \frac{1}{2} m \dot{q}_{j}^{2}" in long
    assert r"\frac{1}{2} k (q_{1} - w)^{2} + \sum_{j=2}^{400} \frac{1}{2} k (q_{j} - q_{j-1})^{2}" in long
    assert "Displacement of mass i, i = 2 to 399, $q_{i}$" in long
    assert r"\mathbf{M} & = m \, \mathbf{I}" in long
    assert "left out" not in long


def test_states_that_are_one_line_in_the_table_have_an_equation_each():
    document = describe(derive(system(Kind(20, states=True))), "row.py", MOST)
    assert len(document.states) < len(document.state_motion) == 20
    assert [str(entry.symbol) for entry in document.state_subjects] == [f"z_{k}" for k in range(1, 21)]
    for page in (text, tex, html):
        assert page(document)
    assert len(document.equations) == len(document.motion) + 20


def test_a_sum_in_an_equation_with_an_index_has_another_index():
    """All masses drag what they hang on together; each equation holds the sum over all."""
    q, (m, k, c) = symbols("q_1:13"), symbols("m k c")
    made = tuple(Coordinate(each, "m", f"displacement of mass {i}") for i, each in enumerate(q, 1))
    parameters = tuple(Parameter(each, 1.0, "1", str(each)) for each in (m, k, c))
    dragged = System(
        name="dragged",
        title="Masses that drag together",
        coordinates=made,
        parameters=parameters,
        kinetic_energy=[m * each.rate**2 / 2 for each in made],
        potential_energy=[k * each**2 / 2 for each in q],
        dissipation=c * Add(*(each.rate for each in made)) ** 2 / 2,
    )
    found = tex(describe(derive(dragged), "dragged.py", 750))
    assert r"& m \ddot{q}_{i} + k q_{i} + c \biggl(\sum_{j=1}^{12} \dot{q}_{j}\biggr) = 0" in found


def test_an_equation_for_all_is_of_no_one_of_them_where_their_meanings_differ():
    made = chain.system(12)
    told = tuple(
        replace(each, meaning=f"link {letter}") for each, letter in zip(made.coordinates, "abcdefghijkl", strict=True)
    )
    found = describe(derive(replace(made, coordinates=told)), "chain.py", 750)
    assert [entry.meaning for entry in found.subjects] == ["link a", "link b to link k, i = 2 to 11", "link l"]
    assert len(found.coordinates) == 12


def test_in_the_terminal_too():
    page = text(describe(derive(chain.system(12)), "chain.py", 750))
    assert "T = Σ[j=1…12] ½·m·q̇_j²" in page
    assert "qᵢ₋₁" in page


def test_all_is_written_out_where_nothing_is_left_out():
    page = text(describe(derive(chain.system(12)), "chain.py"))
    assert "Σ" not in page
    assert page.count("displacement of mass") == 24


def test_lines_of_tables_that_differ_by_a_number_alone_are_one():
    many = [Entry(f"q_{k}", "m", f"displacement of mass {k}", f"qdot_{k}") for k in range(3, 13)]
    other = Entry("q_13", "m", "displacement of the last mass", "qdot_13")
    assert ranged([*many, other], "i") == (
        Entry("q_i", "m", "displacement of mass i, i = 3 to 12", "qdot_i"),
        other,
    )
    assert ranged(many[:7], "i") == tuple(many[:7])
    assert ranged([*many[:4], *many[5:]], "i") == (*many[:4], *many[5:])
    assert ranged(many, None) == tuple(many)
