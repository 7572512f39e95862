"""Functions compiled from their text: what they give is what Python gives, and what numba gives."""

import math
import random

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numba import float64, int64, njit, types
from numba.core.errors import NumbaError
from written import written

import qddot.runner.machine.inner as compilers
from qddot.runner.machine.compiled import ARITHMETIC, compiled
from qddot.runner.machine.inner import OUTER
from qddot.runner.machine.lowering import lowered
from qddot.runner.machine.memory import LEAN, floats, integers, layout, matrix, record, record_at
from qddot.runner.machine.memory import address as address_of
from qddot.runner.machine.text import StrayError


def function_of(folder, text):
    return written(folder, text, "n, a, x")


@pytest.fixture
def by_text(monkeypatch):
    """Compile a function as the runner does, and by nothing but its text: numba is not asked in its place."""

    def alone(function, state, mark=None):
        try:
            return lowered(function, state, mark)
        except StrayError as error:
            raise AssertionError(f"{function.__name__}: {error}") from error

    monkeypatch.setattr(compilers, "lowered", alone)
    return lambda function, *kinds: jitted(function, kinds)


def jitted(function, kinds):
    made = njit(pipeline_class=OUTER, **ARITHMETIC)(function)
    made.compile(kinds)
    return made


def assert_alike(function, made, arguments, changed):
    """Python and compiled code give the same, and leave the same in the array."""
    results = []
    for each in (function, made):
        x = changed.copy()
        results.append((each(*arguments, x), x))
    (expected, left), (found, also_left) = results
    assert (found is None) == (expected is None)
    assert expected is None or float(found) == pytest.approx(float(expected), rel=1e-14, nan_ok=True)
    np.testing.assert_allclose(also_left, left, rtol=1e-14)


KINDS = (int64, float64, types.Array(float64, 1, "C"))

BODIES = {
    "an integer becomes a float": "y = 0\nfor i in range(n):\n    y = y + a\nreturn y",
    "results of two types": "if n > 2:\n    return 1\nreturn a",
    "a truth or a number": "if n > 2:\n    return a > 0.0\nreturn 2",
    "loops left, gone on with, within others": """
total = 0.0
for i in range(n):
    for j in range(n - 1, -1, -1):
        if j == i:
            continue
        if j * i > 6:
            break
        total += i - a * j
    while True:
        total *= 0.5
        if total < 3.0:
            break
return total""",
    "ranges forwards and backwards by any step": """
total = 0
for step in (-3, -1, 1, 2):
    for i in range(2 * step, n * step, step):
        total += i * step
    for i in range(n):
        i += 5
        total += i
return total + i""",
    "while with a condition": "k = n\nwhile k > 0 and x[k - 1] < 2.0:\n    k -= 1\n    x[k] += a\nreturn k",
    "what is not reached": "while True:\n    if n > 1:\n        return a\n    return 2.0 * a\nreturn -a",
    "items from the end, of tuples, of pairs": """
pair = (n, a)
first, (second, third) = a, (n, pair[1])
x[-1], x[0] = x[0], x[n - n - 2]
return first + second * third + (1.0, 2.0, 4.0)[n % 3] + pair[-1]""",
    "what is not computed does no harm": """
found = 0.0
for i in range(2 * len(x)):
    if i < len(x) and x[i] > 0.0:
        found += x[i]
    if i >= len(x) or not x[i] > 0.0:
        found -= 1.0
    found += x[i] if i < len(x) else a
return found""",
    "comparisons in a row, and among": """
between = 0
for i in range(n):
    between += (0 < i <= 3) + 10 * (i in (1, 4)) + 100 * (0 <= i < len(x) != 2 and x[i] == x[i])
return between""",
    "whole numbers": """
k = 3 * n - 7
return (k // 4) + 10 * (k % 4) + 100 * (k & 5) + 1000 * (k | 2) + ((n << 3) >> 1) + abs(k) - -k + int(a)""",
    "powers, quotients, least and greatest": """
k = n / 3
return a ** 3 + a ** -2 + abs(a) ** 0.5 + n ** 2 + k ** n + max(a, n, 2) - min(n, 7) + 1 / (n + 1)""",
    "functions of modules": """
return math.sqrt(abs(a)) + np.sin(a) + math.pi + np.spacing(a) + (1.0 if np.isfinite(a) else 0.0) + round(a)""",
    "changes in place": "for i in range(len(x)):\n    x[i] += a\n    x[i] *= i + 1\n    x[i] /= 3\nreturn -x[0] - -n",
    "several at once": "b = c = a + 1\nb, c = c * 2.0, b\nx[0] = x[1] = b - c\nreturn b * 10 + c",
    "names of arguments mean something else": "n = n + 1\na = a * n\nreturn a",
    "a throwaway of many types": "_, b, _ = x, a, n\nfor _ in range(n):\n    b += 1\nreturn b",
    "nothing": "for i in range(n):\n    x[0] += i\n    if i == 2:\n        return",
}


@pytest.mark.parametrize("body", BODIES.values(), ids=BODIES.keys())
def test_bodies_give_what_python_gives(tmp_path, by_text, body):
    function = function_of(tmp_path, body)
    made = by_text(function, *KINDS)
    for n, a in ((0, 0.5), (1, -1.25), (3, 2.0), (5, 0.75)):
        if "return total + i" in body and n == 0:
            continue  # no value of i then
        assert_alike(function, made, (n, a), np.array([0.5, -1.0, 2.5, 3.0, -0.25]))


@compiled(**LEAN)
def _least(x):
    found = x[0]
    for i in range(1, len(x)):
        found = min(found, x[i])
    return found


@compiled(**LEAN)
def _apply(function, y, count):
    y.sum += function(floats(y.place, count))
    y.calls += 1
    return y.calls, y.sum


def test_records_addresses_and_functions_that_are_handed_over(by_text):
    fields = layout("place calls", "sum")
    at = record_at(fields)

    values = np.array([3.0, -2.0, 4.0, 8.0])
    kept = record(fields, place=address_of(values), sum=0.5)

    def outermost(where, count):
        y = at(where)
        calls, total = _apply(_least, y, count)
        numbers = integers(where, 2)
        square = matrix(y.place, 2, 2)
        square[1, 0] = 7.0
        return total + calls + numbers[1] + square[1][0] + square.shape[0]

    made = by_text(outermost, int64, int64)
    assert made(kept.base.ctypes.data, 3) == 0.5 - 2.0 + 1 + 1 + 7.0 + 2
    assert (kept["calls"], kept["sum"], values[2]) == (1, -1.5, 7.0)


@pytest.mark.parametrize(
    "body",
    [
        "return sum([k * a for k in range(n)])",
        "y = np.zeros(n)\nreturn y.sum() + a",
        "x[1:3] = 2.0\nreturn a",
        "return float(len([1, 2, n]))",
        "for i, y in enumerate(x):\n    a += i * y\nreturn a",
        "if n > 9:\n    return a",
        "return x.max() + a",
    ],
)
def test_what_there_are_no_instructions_for_is_left_to_numba(tmp_path, body):
    function = function_of(tmp_path, body)
    made = njit(pipeline_class=OUTER, error_model="numpy")(function)
    x = np.array([0.5, -1.0, 2.5])
    assert made(3, 0.25, x.copy()) == function(3, 0.25, x.copy())


def test_a_name_without_a_value_is_no_global_one(tmp_path):
    function = function_of(tmp_path, "for i in range(n):\n    if i > 0:\n        a += np.pi\n    np = math\nreturn a")
    with pytest.raises(NumbaError, match="'np' is not defined"):
        njit(pipeline_class=OUTER)(function).compile(KINDS)


def _expression(rng, depth, whole):
    """The text of an expression of the names below, an integer where it is to be whole."""
    if depth == 0:
        names = ("n", "k", "m", "2", "-3") if whole else ("a", "b", "x[k % 5]", "n", "0.75", "-1.5")
        return rng.choice(names)
    one, other = (_expression(rng, depth - 1, whole) for _ in range(2))
    test = f"{_expression(rng, depth - 1, whole)} {rng.choice(('<', '<=', '>', '!=', '=='))} {other}"
    forms = [f"({one} + {other})", f"({one} - {other})", f"({one} * {other})", f"({one} if {test} else {other})"]
    forms += [f"min({one}, {other})", f"max({one}, {other})", f"abs({one})"]
    if whole:
        forms += [f"({one} % 7)", f"({one} // 3)", f"({one} % 1000)"]
    else:
        forms += [f"({one} / (1.0 + abs({other})))", f"(math.atan({one}))", f"(0.1 * {one}) ** 2"]
    return rng.choice(forms)


def _block(rng, depth, margin):
    """Lines of statements that change a, b, k, m and x, and end."""
    lines = []
    for _ in range(rng.randint(1, 3)):
        kind = rng.randrange(8 if depth else 4)
        if kind == 0:
            lines.append(f"{rng.choice('ab')} = math.atan({_expression(rng, 2, False)})")
        elif kind == 1:
            lines.append(f"{rng.choice('km')} = ({_expression(rng, 2, True)}) % 11")
        elif kind == 2:
            lines.append(f"x[{rng.choice('km')} % 5] += math.atan({_expression(rng, 1, False)})")
        elif kind == 3:
            lines.append("a, b, k, m = b, a, m, k")
        else:
            inner = _block(rng, depth - 1, "    ")
            test = f"{_expression(rng, 1, False)} > {_expression(rng, 1, False)}"
            if kind == 4:
                lines += [f"if {test}:", *inner, "else:", *_block(rng, depth - 1, "    ")]
            elif kind == 5:
                turn = f"i_{depth}"
                lines += [f"for {turn} in range({rng.choice('km')} % 4):", *inner, f"    if {test}:", "        break"]
            elif kind == 6:
                turn = f"w_{depth}"
                lines += [f"{turn} = 0", f"while {turn} < 3 and not {test}:", f"    {turn} += 1", *inner]
            else:
                lines += [f"if {test} or k == m:", *inner, *(["    return a + b"] if rng.random() < 0.3 else [])]
    return [margin + line for line in lines]


@settings(deadline=None, max_examples=30)
@given(seed=st.integers(0, 2**32), n=st.integers(-3, 6), a=st.floats(-3.0, 3.0))
def test_random_programs_give_what_python_gives(tmp_path_factory, seed, n, a):
    rng = random.Random(seed)
    body = ["b, k, m = 0.5 * a, 2, n", *_block(rng, 2, ""), "return a + 10.0 * b + 100.0 * k + 1000.0 * m"]
    function = function_of(tmp_path_factory.mktemp("program"), "\n".join(body))
    made = jitted(function, KINDS)
    assert_alike(function, made, (n, a), np.array([0.5, -1.0, 2.5, 3.0, -0.25]))


@pytest.mark.parametrize("value", [math.nan, -math.inf, 0.0, 2.5])
def test_what_compares_with_nothing(tmp_path, by_text, value):
    function = function_of(
        tmp_path, "return (a < 1.0) + 2 * (a != a) + 4 * (not a > 1.0) + 8 * (a == n) + max(a, 1.0) + min(2.0, a)"
    )
    assert_alike(function, by_text(function, *KINDS), (0, value), np.zeros(1))
