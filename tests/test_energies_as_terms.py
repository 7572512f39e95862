"""T, Pi and Phi as sequences of terms: the model that their sums give."""

from dataclasses import fields, replace

import pytest
from models import shipped_once
from sympy import Add, symbols

from qddot.model import ModelError, Part

SUMS = ("kinetic_energy", "potential_energy", "dissipation")


@pytest.mark.parametrize("kind", [list, tuple, iter])
@pytest.mark.parametrize("name", ["m113", "pendulum", "chain"])
def test_a_model_given_by_terms_is_the_one_given_by_sums(name, kind):
    whole = shipped_once(name)
    in_terms = {each: kind(Add.make_args(getattr(whole, each))) for each in SUMS}
    assert replace(whole, **in_terms) == whole


def test_a_part_takes_terms_and_joins_them():
    k, x, y = symbols("k x y")
    both = Part("a", potential_energy=[k * x**2, k * y**2]) + Part("b", potential_energy=(k * x * y,))
    assert both.potential_energy == k * x**2 + k * y**2 + k * x * y
    assert {each.name for each in fields(Part)} >= set(SUMS)


@pytest.mark.parametrize("sum_", SUMS)
def test_no_terms_are_nothing(sum_):
    assert getattr(Part("a", **{sum_: []}), sum_) == 0


@pytest.mark.parametrize(("wrong", "found"), [("k*x", "str"), (None, "NoneType")])
def test_a_term_that_is_no_expression_is_refused(wrong, found):
    k, x = symbols("k x")
    with pytest.raises(ModelError, match=f"potential energy is a {found}, expected a SymPy expression"):
        replace(shipped_once("m113"), potential_energy=[k * x, wrong])
    with pytest.raises(ModelError, match=f"part a: potential energy is a {found}, expected a SymPy expression"):
        Part("a", potential_energy=[k * x, wrong])
