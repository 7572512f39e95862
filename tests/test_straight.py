"""Kernels compiled from their text by instructions: what they compute is what the text says."""

import ast
import builtins
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from models import MODELS
from numba import njit
from numba.core.errors import NumbaError
from written import written

import qddot
from qddot.runner import abi
from qddot.runner.machine import straight_code, straight_parts, straight_shapes
from qddot.runner.machine.compiled import ARITHMETIC
from qddot.runner.machine.inner import OUTER
from qddot.runner.machine.straight import straight
from qddot.runner.machine.straight_code import check
from qddot.runner.machine.text import StrayError, parsed

X, U, C = np.array([0.7, -0.4, 1.3]), np.array([0.2]), np.array([1.5, 0.6])


def function_of(folder, text, arguments="t, state, inputs, constants, values"):
    return written(folder, text, arguments, "rhs")


def compiled(function, **options):
    """The function of instructions, jitted."""
    kernel = njit(pipeline_class=OUTER, **ARITHMETIC)(straight(function, **options))
    kernel.compile(abi.VECTOR_KERNEL)
    return kernel


def results(function, kernel, count):
    """What the text gives in Python, and what the instructions give."""
    found = np.full(count, np.nan), np.full(count, np.nan)
    function(0.3, X, U, C, found[0])
    kernel(0.3, X, U, C, found[1])
    return found


@pytest.mark.parametrize("name", MODELS)
def test_every_kernel_of_every_model_gives_what_its_text_says(name):
    model, rng = qddot.load(name), np.random.default_rng(5)
    x = rng.uniform(0.1, 0.9, len(model.state_names))
    u = rng.uniform(0.1, 0.9, max(1, len(model.tables.inputs)))
    c = model.constants(model.parameter_values())
    for kernel in ("rhs", "jacobian", "energy", "outputs"):
        function = getattr(model.module, kernel).py_func
        check(parsed(function.__code__), vars(builtins) | function.__globals__)
        if model.tables.constraints and kernel != "energy":
            continue  # what it calls runs in compiled code alone
        size = model.tables.patterns[kernel].entries if kernel == "jacobian" else 4 + len(x) + len(model.tables.outputs)
        expected, found = np.zeros(size), np.zeros(size)
        function(0.2, x, u, c, expected)
        model.kernel(kernel)(0.2, x, u, c, found)
        assert found == pytest.approx(expected, rel=1e-11, abs=1e-11)


def test_what_numba_compiles_of_the_same_text_gives_the_same_numbers():
    model, rng = qddot.load("m113"), np.random.default_rng(6)
    x = rng.uniform(-0.3, 0.3, len(model.state_names))
    u, c = rng.uniform(-0.1, 0.1, len(model.tables.inputs)), model.constants(model.parameter_values())
    found = np.empty_like(x), np.empty_like(x)
    model.kernel("rhs")(0.2, x, u, c, found[0])
    model.module.rhs(0.2, x, u, c, found[1])
    assert (found[0] == found[1]).all()


@pytest.mark.parametrize("count", sorted({len(signature.args) for signature in abi.SIGNATURES.values()}))
def test_functions_of_as_many_arguments_as_kernels_have(tmp_path, count):
    arguments = [f"a_{k}" for k in range(count)]
    function = function_of(tmp_path, f"{arguments[-1]}[1] = {arguments[0]}[0] + 1.0", arguments=", ".join(arguments))
    kernel, arrays = njit(pipeline_class=OUTER, **ARITHMETIC)(straight(function)), [np.ones(2) for _ in arguments]
    kernel(*arrays)
    assert arrays[-1].tolist() == [1.0, 2.0]


def test_choices_junctions_powers_and_loops(tmp_path):
    function = function_of(tmp_path, """
a, b = state[0], state[1]
c = constants[1]
d = -a ** 5 + math.atan2(a, b) if (a < c and not b > 0.5) or a != a else math.nan
e = (math.sqrt(-b) if b < 0.0 else b) / 0.0
for place in range(2):
    values[place] = constants[place]
values[2] = d
values[3] = e
values[4] = 1.0 if a == 0.7 else 2.0
values[5] = math.pow(a, 2.5) - math.pi
""".strip().replace(" / 0.0", " / a"))  # fmt: skip
    expected, found = results(function, compiled(function), 6)
    assert found == pytest.approx(expected, rel=1e-14, nan_ok=True)


LOOPS = """
kept = [0.0] * 2
values[0] = 0.5
for k in range(2):
    kept[k] = math.exp(state[k])
kept_1 = kept[1]
for i in range(2):
    a_i, a_i_plus_1 = state[i], state[1 - i]
    b_i = a_i * constants[i]
    values[0] = values[0] + b_i * a_i_plus_1
    values[2 * i + 1] = a_i - b_i * kept[i] + kept_1
    values[4 - 2 * i] = b_i
for j in range(3):
    values[j + 5] = state[j]
""".strip()


@pytest.mark.parametrize("whole", [False, True])
def test_loops_over_cells_whose_places_are_computed(tmp_path, whole):
    function = function_of(tmp_path, LOOPS)
    expected, found = results(function, compiled(function, whole=whole), 8)
    assert found == pytest.approx(expected, rel=1e-14)


def test_a_place_that_is_no_whole_number_is_left_to_numba(tmp_path):
    function = function_of(tmp_path, "for i in range(2):\n    values[i] = state[i / 2]")
    with pytest.raises(StrayError):
        check(parsed(function.__code__), vars(builtins) | function.__globals__)


def test_a_division_by_zero_is_an_infinity(tmp_path):
    function = function_of(tmp_path, "values[0] = state[0] / (state[1] - state[1])\nvalues[1] = math.log(-state[0])")
    kernel, found = compiled(function), np.zeros(2)
    kernel(0.3, X, U, C, found)
    assert found[0] == np.inf
    assert math.isnan(found[1])


NAMES = ["state[0]", "state[1]", "state[2]", "inputs[0]", "constants[0]", "constants[1]", "t", "0.5", "2.0"]
LEAVES = st.sampled_from(NAMES)


def deeper(inner):
    """Expressions of expressions."""
    pair = st.tuples(inner, inner)
    return st.one_of(
        st.tuples(pair, st.sampled_from("+-*")).map(lambda each: f"({each[0][0]} {each[1]} {each[0][1]})"),
        pair.map(lambda each: f"{each[0]} / (1.0 + {each[1]} * {each[1]})"),
        inner.map(lambda each: f"math.sin({each})"),
        inner.map(lambda each: f"-({each})"),
        inner.map(lambda each: f"math.tanh({each}) ** 3"),
        st.tuples(inner, inner, inner).map(lambda each: f"({each[0]} if {each[1]} < {each[2]} else 0.25)"),
    )


@settings(max_examples=12, deadline=None, print_blob=True)
@given(
    st.lists(st.recursive(LEAVES, deeper, max_leaves=6), min_size=3, max_size=12),
    st.randoms(use_true_random=False),
    st.sampled_from([1, 2, 1000]),
)
def test_random_lines_in_one_function_and_as_a_table(tmp_path_factory, expressions, chance, often):
    lines, known = [], list(NAMES)
    for k, expression in enumerate(expressions):
        lines.append(f"tmp_{k} = {expression} + 0.5 * {chance.choice(known)}")
        known.append(f"tmp_{k}")
    lines += [f"values[{k}] = {chance.choice(known)} - tmp_{k}" for k in range(len(expressions))]
    function = function_of(tmp_path_factory.mktemp("lines"), "\n".join(lines))
    expected, found = results(function, compiled(function, whole=True), len(expressions))
    assert found == pytest.approx(expected, rel=1e-12, abs=1e-12)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(straight_code, "WHOLE", 0)
        patch.setattr(straight_code, "SHORT", 0)
        patch.setattr(straight_shapes, "OFTEN", often)
        assert results(function, compiled(function), len(expressions))[1] == pytest.approx(found, rel=1e-12, abs=1e-12)


def steps(text):
    """The runs of a text, and the steps of the first."""
    found = straight_parts.runs(ast.parse(text).body, {"math": math, "table": table})
    return found, straight_shapes.steps_of(found[0], lambda node: node.value)


def table():
    """What may fail, for a text to call."""


def test_a_call_that_may_fail_stands_between_runs():
    text = "\n".join([*(f"a_{k} = t * {k}.0" for k in range(9)), "b = table(a_0)", "values[0] = a_8 + b"])
    found, first = steps(text)
    assert [run.apart for run in found] == [True, False, True]
    assert [len(run.statements) for run in found] == [9, 1, 1]
    assert (len(first.shapes), len(first.steps), list(first.outside)) == (1, 9, ["t"])


def test_what_repeats_is_one_shape_whatever_its_operands():
    alike = [f"values[{k}] = {k + 2}.0 * (a_{k} - b_{k} * math.sin(a_{k + 1}))" for k in range(20)]
    _, found = steps("\n".join(alike))
    assert (len(found.shapes), len(found.steps)) == (1, 20)
    _, found = steps("\n".join(alike[:3]))  # what is seldom is taken apart
    assert {len(shape.indices) for shape in found.shapes} == {1, 3}
    assert len(found.steps) == 9


def test_steps_follow_those_they_need():
    _, found = steps("a = t + 1.0\nb = a * a\nc = t - 2.0\nd = b + c * t\nvalues[3] = d")
    levels = {step.value[1]: step.level for step in found.steps if step.value}
    assert levels == {"a": 1, "b": 2, "c": 1, "d": 3}


def test_where_order_matters_there_are_no_steps():
    assert steps("values[0] = t + 1.0\na = values[1] + values[0]")[1] is None
    assert steps("a = t + 1.0\na = a + 1.0")[1] is None


def test_long_sums_have_their_signs(tmp_path, monkeypatch):
    monkeypatch.setattr(straight_code, "WHOLE", 0)
    monkeypatch.setattr(straight_code, "SHORT", 0)
    lines = ["a, b = state[0], state[1]", "c = -a + b - 2.0 * a + a * b - constants[0]"]
    lines += [f"values[{k}] = c * ({' + '.join(f'{j}.0 * a' for j in range(k + 4))} - b - c)" for k in range(5)]
    function = function_of(tmp_path, "\n".join(lines))
    expected, found = results(function, compiled(function), 5)
    assert found == pytest.approx(expected, rel=1e-13)


def strays(function):
    """Whether a function is no straight line."""
    with pytest.raises(StrayError):
        check(parsed(function.__code__), vars(builtins) | function.__globals__)


@pytest.mark.parametrize(
    "body",
    [
        "while t > 1.0:\n    t = t - 1.0\nvalues[0] = t",
        "if t > 0.0:\n    values[0] = 1.0\nelse:\n    values[0] = 2.0",
        "values[0] = sum(state[1:])",
        "values[0] += t",
        "values[0] = t ** state[0]",
        "return",
    ],
)
def test_what_is_no_straight_line_is_compiled_otherwise(tmp_path, body):
    function = function_of(tmp_path, body)
    strays(function)
    expected, found = results(function, compiled(function), 1)
    assert found == pytest.approx(expected, rel=1e-15, nan_ok=True)


@pytest.mark.parametrize(
    "body", ["values[0] = math.nothing(t)", "values[0] = t.nothing", "values[0] = before\nbefore = 1.0"]
)
def test_what_is_no_python_either_is_refused_by_numba(tmp_path, body):
    function = function_of(tmp_path, body)
    strays(function)
    with pytest.raises((NumbaError, AttributeError), match=r"before|nothing"):
        compiled(function)


def test_a_text_that_changed_since_it_was_imported_is_left_to_numba(tmp_path):
    function = function_of(tmp_path, "values[0] = t + 1.0")
    file = next(tmp_path.glob("*.py"))
    file.write_text(file.read_text().replace("t + 1.0", "t + 2.0"))
    with pytest.raises(StrayError, match="its file holds another text"):
        parsed(function.__code__)
    file.unlink()
    with pytest.raises(StrayError, match="No such file"):
        parsed(function.__code__)


def test_a_sum_of_thousands_of_terms_compiles(tmp_path):
    function = function_of(tmp_path, f"values[0] = {' + '.join(['state[0]'] * 2500)}")
    expected, found = results(function, compiled(function), 1)
    assert found == pytest.approx(expected, rel=1e-11)
