"""The functions that loops over lanes hold: within the errors that they state, over wide ranges, against mpmath."""

import math
import re
from functools import cache

import llvmlite.binding
import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numba import njit, types

from qddot.runner import abi
from qddot.runner.machine.calls import doubles
from qddot.runner.machine.compiled import ARITHMETIC
from qddot.runner.machine.elementary import FORMS
from qddot.runner.machine.lane_loop import LaneCompiler
from qddot.runner.machine.memory import LEAN
from qddot.runner.machine.pointers import calling, pointer

mpmath.mp.prec = 200
LANES = abi.LANES
FEATURES = llvmlite.binding.get_host_cpu_features()


def of_two(function):
    def loop(x, y, result):
        for lane in range(LANES):
            result[lane] = function(x[lane], y[lane])

    return loop


def of_one(function):
    def loop(x, y, result):
        for lane in range(LANES):
            result[lane] = function(x[lane])

    return loop


#: Rows of arguments, and of what comes of them.
ROWS = types.void(*[abi.POINTER] * 3)
call_rows = calling(ROWS)


@njit
def over(kernel, x, y, result):
    """A kernel, given by its address, over arrays: compiled once for all functions."""
    for i in range(0, 8 * len(x), 8 * LANES):
        rows = doubles(x.ctypes.data + i), doubles(y.ctypes.data + i), doubles(result.ctypes.data + i)
        call_rows(kernel, rows)


class InLanes:
    """A function over arrays, eight at a time, compiled as kernels are; `assembly` is what came of it."""

    def __init__(self, name):
        function = FORMS[name]
        loop = (of_two if name in ("pow", "atan2") else of_one)(function)
        options = {**ARITHMETIC, "pipeline_class": LaneCompiler, **LEAN}
        kernel = njit(ROWS, **options)(loop)
        self.assembly = next(iter(kernel.inspect_asm().values()))
        self._kernel, self._place = kernel, pointer(kernel, ROWS, name)

    def __call__(self, x, y):
        rows = -(-len(x) // LANES) * LANES
        x_rows, y_rows = (np.resize(each, rows).astype(float) for each in (x, y))
        result = np.empty(rows)
        over(self._place, x_rows, y_rows, result)
        return result[: len(x)]


compiled = cache(InLanes)


def evaluate(name, x, y=(1.0,)):
    """The function in lanes at x, or at x and y."""
    return compiled(name)(x, y)


def ulps(found, exact):
    """Distance of a float from an exact value, in units of the last place of the exact value."""
    if mpmath.isnan(exact):
        return 0.0 if math.isnan(found) else math.inf
    if math.isinf(found) or mpmath.isinf(exact):
        return 0.0 if mpmath.mpf(found) == exact or abs(exact) > mpmath.mpf(1.797693134862315e308) else math.inf
    return float(abs(mpmath.mpf(found) - exact) / mpmath.mpf(math.ulp(float(exact))))


def logarithmic(low, high, signs=True):
    """Floats spread evenly over magnitudes."""
    exponent = st.floats(math.log10(low), math.log10(high))
    sign = st.sampled_from([1.0, -1.0]) if signs else st.just(1.0)
    return st.builds(lambda e, s: s * 10.0**e, exponent, sign)


#: name, mpmath's function, arguments, allowed ulp.
CASES = [
    ("sin", mpmath.sin, logarithmic(1e-9, 1e6), 1.0),
    ("cos", mpmath.cos, logarithmic(1e-9, 1e6), 1.0),
    ("tan", mpmath.tan, logarithmic(1e-9, 1e6), 3.0),
    ("exp", mpmath.exp, st.floats(-708.0, 709.7), 1.0),
    ("log", mpmath.log, logarithmic(1e-307, 1e308, signs=False), 1.0),
    ("tanh", mpmath.tanh, logarithmic(1e-9, 40.0), 3.0),
    ("sinh", mpmath.sinh, logarithmic(1e-9, 709.0), 3.0),
    ("cosh", mpmath.cosh, logarithmic(1e-9, 709.0), 2.0),
    ("atan", mpmath.atan, logarithmic(1e-9, 1e9), 2.0),
    ("asin", mpmath.asin, st.floats(-1.0, 1.0), 3.0),
    ("acos", mpmath.acos, st.floats(-1.0, 1.0), 3.0),
]


@pytest.mark.parametrize(("name", "exact", "arguments", "allowed"), CASES, ids=[case[0] for case in CASES])
def test_functions_of_one_number_are_within_their_error(name, exact, arguments, allowed):
    @settings(max_examples=60, deadline=None)
    @given(st.lists(arguments, min_size=8, max_size=32))
    def check(xs):
        for x, found in zip(xs, evaluate(name, xs), strict=True):
            assert ulps(found, exact(mpmath.mpf(x))) <= allowed, (name, x, found)

    check()


def test_sine_and_cosine_hold_next_to_multiples_of_a_quarter_turn():
    near = np.array([k * math.pi / 2 for k in (1, 2, 3, 4, 7, 1000, 12345, 600000)])
    x = np.concatenate([near, np.nextafter(near, 0), -near])
    for name, exact in (("sin", mpmath.sin), ("cos", mpmath.cos)):
        for each, found in zip(x, evaluate(name, x), strict=True):
            assert ulps(found, exact(mpmath.mpf(each))) <= 1.0, (name, each)


def test_sine_and_cosine_hold_after_hundreds_of_thousands_of_quarter_turns():
    x = np.random.default_rng(2026).uniform(5e5, 1e6, 500)
    for name, exact in (("sin", mpmath.sin), ("cos", mpmath.cos)):
        for each, found in zip(x, evaluate(name, x), strict=True):
            assert ulps(found, exact(mpmath.mpf(each))) <= 1.0, (name, each)


@settings(max_examples=60, deadline=None)
@given(st.lists(st.tuples(logarithmic(1e-100, 1e100, signs=False), st.floats(-50, 50)), min_size=8, max_size=32))
def test_powers_are_within_their_error(pairs):
    x, y = np.array(pairs).T
    for base, exponent, found in zip(x, y, evaluate("pow", x, y), strict=True):
        exact = mpmath.mpf(base) ** mpmath.mpf(exponent)
        if 1e-300 < abs(exact) < 1e300:
            small = abs(exponent * math.log(base)) <= 10
            assert ulps(found, exact) <= (2.0 if small else 40.0), (base, exponent)


@settings(max_examples=60, deadline=None)
@given(st.lists(st.tuples(logarithmic(1e-9, 1e9), logarithmic(1e-9, 1e9)), min_size=8, max_size=32))
def test_angles_are_within_their_error(pairs):
    y, x = np.array(pairs).T
    for up, across, found in zip(y, x, evaluate("atan2", y, x), strict=True):
        assert ulps(found, mpmath.atan2(mpmath.mpf(up), mpmath.mpf(across))) <= 2.0, (up, across)


def test_special_arguments_give_what_libm_gives():
    inf, nan = math.inf, math.nan
    np.testing.assert_array_equal(evaluate("exp", [0, -inf, inf, nan, 800, -800]), [1, 0, inf, nan, inf, 0])
    np.testing.assert_array_equal(evaluate("log", [1, 0, inf, nan, -1]), [0, -inf, inf, nan, nan])
    np.testing.assert_array_equal(evaluate("tanh", [0, inf, -inf, nan]), [0, 1, -1, nan])
    np.testing.assert_array_equal(evaluate("sin", [0, inf, nan]), [0, nan, nan])
    np.testing.assert_array_equal(evaluate("cos", [0, inf, nan]), [1, nan, nan])
    x = [0, 0, 0, 2, -2, -2, -2, 5, nan, inf, inf, -0.5, 4]
    y = [0, 2, -2, 0, 3, 2, 0.5, nan, 2, 2, -2, inf, 0.5]
    with np.errstate(all="ignore"):
        np.testing.assert_array_equal(evaluate("pow", x, y), np.power(np.array(x, float), np.array(y, float)))
    np.testing.assert_array_equal(
        evaluate("atan2", [0, 1, -1, 0], [1, 0, 0, -1]), np.arctan2([0, 1, -1, 0], [1, 0, 0, -1])
    )


@pytest.mark.skipif(not FEATURES.get("avx"), reason="this machine has no AVX")
@pytest.mark.parametrize("name", ["sin", "exp", "log", "pow", "tanh", "atan2"])
def test_loops_over_these_functions_are_vectors(name):
    assembly = compiled(name).assembly
    assert re.search(r"v(mul|fn?m\w*)pd\s.*%[yz]mm", assembly)
    assert not re.search(r"v(add|mul|div|fn?m\w*)sd|\bcall", assembly)
