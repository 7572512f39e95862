"""Inner functions become part of what calls them: machine code once, however deep they lie, and none of their own."""

import numpy as np
import pytest
from numba import float64, njit

from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.memory import BY_ADDRESS, LEAN
from qddot.runner.machine.pointers import pointer

SIGNATURE = float64(float64)


@compiled(**LEAN)
def cube(x):
    return max(x, 0.0) ** 3


@compiled(**LEAN)
def middle(x):
    return cube(x) + cube(2.0 * x)


@compiled(**LEAN)
def twice(x):
    return middle(x) + cube(x)


@compiled(**BY_ADDRESS)
def reached(x):
    return middle(x) - cube(x)


def outer(x):
    return twice(x) + middle(x)


def library(function):
    return function.get_compile_result(SIGNATURE).library


@pytest.mark.parametrize("make", [compiled(SIGNATURE), njit], ids=["outer", "of another"])
def test_who_calls_them_holds_all_of_them(make):
    function = make(outer)
    for x in (-1.0, 0.3, 2.0):
        assert function(x) == pytest.approx(19 * max(x, 0.0) ** 3, rel=1e-15)
    assert library(function).get_pointer_to_function(function.get_compile_result(SIGNATURE).fndesc.llvm_func_name)


def test_they_have_no_machine_code_and_no_address():
    inner = library(cube)
    assert not inner._compiled
    with pytest.raises(ValueError, match="cube is compiled within what calls it, expected one with an address"):
        pointer(cube, SIGNATURE, "cube")


def test_one_that_is_called_by_its_address_has_one():
    assert pointer(reached, SIGNATURE, "reached") > 0


def test_what_they_call_is_optimised_with_the_outermost():
    """Nothing is left to call: the loop over an inner function is one of vectors."""

    def loop(x, y):
        for i in range(len(x)):
            y[i] = middle(x[i])

    summed = compiled(None, _nrt=False)(loop)
    x, y = np.linspace(-1.0, 1.0, 65), np.empty(65)
    summed(x, y)
    np.testing.assert_allclose(y, 9 * np.maximum(x, 0.0) ** 3, rtol=1e-15)
    text = next(iter(summed.inspect_llvm().values()))
    body = text[text.index("define") :]
    assert "x double>" in body and "call double @_ZN" not in body
