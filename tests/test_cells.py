"""Cells that are alike become loops: what these give is what the form gives that is written out."""

import math
from dataclasses import replace
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

import numpy as np
import pytest
from chains import Kind, kinds, renamed, system
from hypothesis import HealthCheck, example, given, settings

import qddot
from qddot.codegen.generate import artefacts
from qddot.codegen.lagrange import derive
from qddot.codegen.lower import lower
from qddot.codegen.render import module
from qddot.codegen.wall import check_module
from qddot.model import chain
from qddot.runner.machine.recurrences import read_recurrences
from qddot.runner.ranges import expanded, placed

KERNELS = ("rhs", "jacobian", "input_jacobian", "mass", "energy", "outputs")


def written(made, folder, folds):
    """The module of a system, its cells loops or written out."""
    text = module(lower(derive(made), folds=folds), "test.py", ())
    check_module(text)
    path = folder / f"{made.name}_{folds}.py"
    path.write_text(text)
    spec = spec_from_file_location(path.stem, path)
    found = module_from_spec(spec)
    spec.loader.exec_module(found)
    return found, text


def values(found, x, u, p):
    """What all kernels write, by name and place."""
    names = [row[0] for row in expanded(found.PARAMETER)]
    c = np.empty(len(names) + len(expanded(found.CONSTANT)))
    found.constants.py_func(np.array([p[name] for name in names]), c)
    u = np.array([u[row[0]] for row in expanded(found.INPUT)])
    given, all_values = dict(zip([*names, *expanded(found.CONSTANT)], c, strict=True)), {}
    for name in KERNELS:
        places = matrix_places(found, name)
        filled = np.full(len(places), np.nan)
        getattr(found, name).py_func(0.0, x, u, c, filled)
        all_values[name] = dict(zip(places, filled, strict=True))
    return all_values, given


def matrix_places(found, name):
    if hasattr(found, name.upper()):
        return [(i, j) for i, columns in enumerate(placed(getattr(found, name.upper()))) for j in columns]
    sizes = {"rhs": len(expanded(found.STATE)), "energy": 4, "outputs": len(expanded(found.OUTPUT))}
    return list(range(sizes[name]))


def close(one, other, what):
    assert one.keys() == other.keys(), what
    for place, value in one.items():
        assert value == pytest.approx(other[place], rel=1e-11, abs=1e-11), (what, place)


def first_rates(found, x, u, constants):
    """The rates of the states that the table RECURRENCE gives."""
    states, inputs = ([row[0] for row in expanded(rows)] for rows in (found.STATE, found.INPUT))
    table = read_recurrences(found.RECURRENCE, states, inputs, list(constants))
    numbers = list(constants.values())
    known = {"1": 1.0, "t": 0.0, **dict(zip(states, x, strict=True)), **u}

    def factor(each):
        return each.number * math.prod(numbers[place] for place in each.constants)

    def value(name):
        if name not in known:
            node = table.nodes[name]
            node = node.start if node.rule == "integral" else node
            parts = [value(each) for each in node.arguments[: 1 if hasattr(math, node.rule) else None]]
            known[name] = {
                "linear": lambda: sum(factor(f) * each for f, each in zip(node.factors, parts, strict=True)),
                "product": lambda: parts[0] * parts[1],
                "quotient": lambda: parts[0] / parts[1],
            }.get(node.rule, lambda: getattr(math, node.rule)(parts[0]))()
        return known[name]

    return [factor(table.nodes[state].factors[0]) * value(table.nodes[state].arguments[0]) for state in states]


@settings(max_examples=6, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(kind=kinds)
@example(kind=Kind(20))
@example(kind=Kind(20, coupling="exp", odd=frozenset((9,)), named=True))
@example(kind=Kind(20, coupling="cos", own=True))
@example(kind=Kind(12, coupling="exp", two=True, second=True))
@example(kind=Kind(20, own=True, odd=frozenset((7,)), second=True, hub=True, named=True, states=True))
@example(kind=Kind(20, two=True, interleaved=True, own=True, ground="cos", cubic=True, inputs=True))
def test_loops_give_what_the_form_written_out_gives(kind, tmp_path):
    made = system(kind)
    rng = np.random.default_rng(kind.n)
    (loops, _), (plain, _) = (written(made, tmp_path, folds) for folds in (True, False))
    x = rng.uniform(-0.5, 0.5, len(expanded(plain.STATE)))
    u = {row[0]: rng.uniform(-1, 1) for found in (loops, plain) for row in expanded(found.INPUT)}
    p = {row[0]: rng.uniform(0.5, 2) for row in expanded(plain.PARAMETER)}
    (found, constants), (expected, _) = (values(each, x, u, p) for each in (loops, plain))
    for name in KERNELS:
        close(found[name], expected[name], name)
    rates = first_rates(loops, x, u, constants)
    np.testing.assert_allclose(rates, list(expected["rhs"].values()), rtol=1e-11, atol=1e-11)


def test_names_that_loops_would_use_may_be_the_authors(tmp_path):
    plain = system(Kind(12))
    made = renamed(plain, {"m": "i", "k": "x_i", "c": "xddot_j"})
    rng = np.random.default_rng(1)
    x, p = rng.uniform(-0.5, 0.5, 24), rng.uniform(0.5, 2, 3)
    (one, text), (other, _) = (written(each, tmp_path, True) for each in (made, replace(plain, name="plain")))
    assert "for i in" not in text
    found = []
    for each in (one, other):
        given = dict(zip([row[0] for row in expanded(each.PARAMETER)], p, strict=True))
        found.append(values(each, x, {}, given)[0])
    for name in KERNELS:
        close(found[0][name], found[1][name], name)


#: Of each kind of thing something, and an odd cell in the middle.
RICH = Kind(24, odd=frozenset((11,)), own=True, coupling="exp", ground="cos", named=True, states=True)


@pytest.fixture(scope="module")
def both(tmp_path_factory):
    """A model with loops, and the same written out."""
    folder = tmp_path_factory.mktemp("cells")
    found = []
    for folds in (True, False):
        path = folder / f"row_{folds}.py"
        path.write_text(module(lower(derive(system(RICH, path.stem)), folds=folds), "test.py", ()))
        found.append(qddot.load(path))
    texts = [Path(each.module.__file__).read_text() for each in found]
    assert [("for i in range" in text, "shared = [0.0] *" in text) for text in texts] == [(True, True), (False, False)]
    return found


@pytest.mark.parametrize("name", ["rhs", "jacobian", "energy", "outputs"])
def test_compiled_loops_give_what_their_text_says(both, name):
    model, rng = both[0], np.random.default_rng(2)
    x, u = rng.uniform(-0.5, 0.5, len(model.state_names)), np.zeros(1)
    c = model.constants(model.parameter_values())
    size = model.tables.patterns[name].entries if name == "jacobian" else len(x) + 4
    expected, found = np.zeros(size), np.zeros(size)
    getattr(model.module, name).py_func(0.0, x, u, c, expected)
    model.kernel(name)(0.0, x, u, c, found)
    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("method", ["dop853", "rk4", "ode15s", "taylor"])
def test_runs_of_loops_are_those_of_the_form_written_out(both, method):
    given = {"step": 1e-3} if method == "rk4" else {"rtol": 1e-9, "atol": 1e-11}
    initial = {"x_3": 0.3, "x_12": -0.2, "xdot_24": 1.0}
    loops, plain = (qddot.simulate(each, (0, 0.5), initial=initial, method=method, **given) for each in both)
    np.testing.assert_allclose(loops.states[-1], plain.states[-1], rtol=0, atol=1e-8)


def test_lanes_of_loops_are_runs_alone(both):
    model, starts = both[0], np.random.default_rng(4).uniform(-0.3, 0.3, (10, len(both[0].state_names)))
    batch = qddot.simulate_batch(model, (0, 0.2), initial=starts, step=2e-3, method="rk4", output_times=3)
    for run in (0, 7, 9):
        alone = qddot.simulate(model, (0, 0.2), initial=starts[run], step=2e-3, method="rk4")
        np.testing.assert_allclose(batch.final[run], alone.states[-1], rtol=0, atol=1e-12)


def test_the_file_of_a_chain_does_not_grow_with_it():
    sizes = [len(artefacts(chain.system(n), "chain.py")[f"chain_{n}.py"]) for n in (100, 400)]
    assert sizes[1] < 1.05 * sizes[0] < 10_000


@pytest.mark.parametrize(
    "kind",
    [
        {"coupling": "cos", "own": True},
        {"coupling": "exp", "named": True, "cubic": True},
        {"two": True, "interleaved": True, "second": True, "states": True, "inputs": True, "ground": "tanh"},
        {"reversed": True, "odd": frozenset((5,)), "ground": "cos"},
    ],
    ids=str,
)
def test_files_of_all_kinds_of_chains_do_not_grow_with_them(kind, tmp_path):
    sizes = [len(module(lower(derive(system(Kind(n, **kind)))), "test.py", ())) for n in (30, 130)]
    assert sizes[1] < 1.06 * sizes[0] < 25_000
