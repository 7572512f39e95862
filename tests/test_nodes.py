"""What is remembered of nodes is what SymEngine says of them, and what was generated before has no say in a text."""

import gc

import pytest
import symengine as se

from qddot.codegen import nodes
from qddot.codegen.generate import artefacts
from qddot.codegen.lagrange import derive
from qddot.codegen.lower import lower
from qddot.codegen.nodes import holding, one, operands, symbols_of
from qddot.codegen.render import module
from qddot.model import double_pendulum, half_car, pendulum

x, y, z = se.symbols("x y z")
EXPRESSIONS = [
    x,
    se.Integer(3),
    se.pi,
    2 * x * y - z,
    se.sin(x - y) ** 2 + x / y,
    se.Piecewise((x, se.Lt(y, 1)), (z**2, True)),
    se.Function("f")(x, 2 * y),
]


@pytest.mark.parametrize("expression", EXPRESSIONS, ids=str)
def test_of_a_node_is_told_what_symengine_tells(expression):
    assert operands(expression) == tuple(expression.args)
    assert symbols_of(expression) == frozenset(expression.free_symbols)
    for kind in (se.Piecewise, se.FunctionSymbol, se.sin):
        assert holding(kind)(expression) == bool(expression.atoms(kind))


def test_an_infinity_is_a_number_and_is_made_of_nothing():
    assert operands(se.zoo) == ()
    assert symbols_of(se.zoo) == frozenset()


def test_equal_nodes_are_one():
    first, second = x * y + z, z + y * x
    assert first == second
    assert first is not second
    assert one(first) is one(second)


@pytest.mark.parametrize("home", [half_car, double_pendulum])
def test_what_was_generated_before_has_no_say(home):
    alone = module(lower(derive(home.system())), "model.py", [])
    module(lower(derive(pendulum.system(4))), "model.py", [])
    equations = derive(home.system())
    derive(pendulum.system(3))  # between a derivation and its lowering, too
    assert module(lower(equations), "model.py", []) == alone


def test_a_generation_lets_go_of_its_nodes_and_leaves_the_search_for_cycles_as_it_was():
    artefacts(double_pendulum.system(), "model")
    assert not any(nodes._KEPT)
    assert gc.isenabled()
    gc.disable()
    try:
        artefacts(double_pendulum.system(), "model")
        assert not gc.isenabled()
    finally:
        gc.enable()
