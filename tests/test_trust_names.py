"""Names: what the generated code, the results and the printed page would confuse is refused, and all else works."""

import ast
from dataclasses import replace
from types import SimpleNamespace

import pytest
from derived import generated_module
from hypothesis import given, settings
from hypothesis import strategies as st
from sympy import Rational, Symbol, symbols

from qddot.codegen.equations.notation import describe
from qddot.codegen.generate import artefacts
from qddot.codegen.lagrange import derive
from qddot.codegen.lower import lower
from qddot.codegen.skeleton import reserved
from qddot.model.naming import LONGEST
from qddot.model.system import Coordinate, Input, ModelError, Output, Parameter, Quantity, System
from qddot.runner.batch.wanted import check_outputs
from qddot.runner.load import load

x, xdot, m, k = symbols("x xdot m k")
half = Rational(1, 2)
GOOD = System(
    name="named",
    title="Mass on a spring",
    coordinates=[Coordinate(x, "m", "displacement")],
    parameters=[Parameter(m, 2.0, "kg", "mass"), Parameter(k, 50.0, "N/m", "stiffness")],
    kinetic_energy=half * m * xdot**2,
    potential_energy=half * k * x**2,
)


def with_parameter(name):
    """The good system with one more parameter, raised to a power and in a kink so that the printer has work to do."""
    symbol = Symbol(name)
    more = Parameter(symbol, 0.5, "1", "named so")
    return replace(GOOD, parameters=(*GOOD.parameters, more), potential_energy=half * k * x**2 * (1 + symbol * x**2))


def with_coordinate(name):
    symbol = Symbol(name)
    coordinate = Coordinate(symbol, "m", "named so", velocity=Symbol("v"))
    T, potential = half * m * Symbol("v") ** 2, half * k * symbol**2
    return replace(GOOD, coordinates=[coordinate], kinetic_energy=T, potential_energy=potential)


def used(text):
    """Names that the functions of a module read or set."""
    for node in ast.parse(text).body:
        if isinstance(node, ast.FunctionDef):
            yield from (argument.arg for argument in node.args.args)
            yield from (part.id for line in node.body for part in ast.walk(line) if isinstance(part, ast.Name))


def test_the_reserved_names_are_all_that_generated_functions_use(system):
    """Of every shipped model: what its functions use is its own symbols, names given by the generator, or reserved."""
    text = artefacts(system, "test.py")[f"{system.name}.py"]
    program = lower(derive(system))
    own = {str(symbol) for symbol in program.slots} | {str(p) for p in program.equations.parameters}
    own |= {str(symbol) for kernel in program.kernels.values() for symbol, _ in kernel.temporaries}
    loops = [loop for kernel in program.kernels.values() for loop in kernel.loops]
    own |= {name for loop in loops for name in (loop.counter, *map(str, loop.symbols))}
    assert set(used(text)) - own <= reserved()
    assert {"math", "t", "state", "inputs", "derivative", "values"} <= reserved()


@pytest.mark.parametrize("name", sorted(reserved() - {"t"}))
def test_no_symbol_has_a_name_that_the_kernels_use(name):
    with pytest.raises(ModelError, match=f"parameter '{name}' would shadow a name that the generated kernels use"):
        artefacts(with_parameter(name), "test.py")


@pytest.mark.parametrize(
    "name", ["mass", "rhs", "LINEAR", "njit", "types", "print", "abs", "match", "self", "run", "steps"]
)
def test_other_names_work(name, tmp_path):
    """Names of the module's own tables and functions, of Python, and of results."""
    module = generated_module(with_parameter(name), tmp_path)
    constants, dx = [0.0] * (3 + len(module.CONSTANT)), [0.0, 0.0]
    module.constants.py_func([2.0, 50.0, 0.5], constants)
    module.rhs.py_func(0.0, [0.1, 0.2], [], constants, dx)
    assert dx == pytest.approx([0.2, -(50.0 * 0.1 + 2 * 0.5 * 50.0 * 0.1**3) / 2.0], rel=1e-14)


def test_a_name_that_results_have_for_time_is_refused_where_it_would_stand_in_results():
    message = "'time' has the name of time in the results; choose another name"
    with pytest.raises(ModelError, match=f"coordinate {message}"):
        with_coordinate("time")
    with pytest.raises(ModelError, match=f"output {message}"):
        replace(GOOD, outputs=[Output(Symbol("time"), k * x, "N", "force")])
    with pytest.raises(ModelError, match=f"input {message}"):
        replace(GOOD, inputs=[Input(Symbol("time"), "N", "force")], generalized_forces={x: Symbol("time")})
    with pytest.raises(ModelError, match=f"quantity {message}"):
        replace(GOOD, quantities=[Quantity(Symbol("time"), 2 * x, "m", "stretch")], potential_energy=k * Symbol("time"))
    with pytest.raises(ModelError, match="t is used twice, as time and as coordinate"):
        with_coordinate("t")
    lower(derive(with_parameter("time")))


@pytest.mark.parametrize("name", ["run", "status", "block", "steps", "failed_at", "message", "q" * LONGEST])
def test_a_coordinate_of_any_other_name_can_be_loaded(name, tmp_path):
    for file, text in artefacts(with_coordinate(name), "test.py").items():
        (tmp_path / file).write_text(text)
    assert load(tmp_path / "named.py").state_names == (name, "v")


def test_what_a_store_of_results_calls_otherwise_cannot_be_kept_in_it(tmp_path):
    for file, text in artefacts(with_coordinate("run"), "test.py").items():
        (tmp_path / file).write_text(text)
    study = SimpleNamespace(outputs=SimpleNamespace(keep=["run"], every=1), metrics={})
    with pytest.raises(ValueError, match=r"outputs\.keep\.0: the results call something else 'run'; rename it"):
        check_outputs(study, SimpleNamespace(axes=[]), load(tmp_path / "named.py"))


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("q" * (LONGEST + 1), f"has {LONGEST + 1} characters, more than {LONGEST}"),
        ("κ", "is not a valid identifier"),
        ("ﬁx", "is not a valid identifier"),
        ("__class__", "is not a valid identifier"),
        ("x\n", "is not a valid identifier"),
        ("", "is not a valid identifier"),
        ("lambda", "is a Python keyword"),
        ("None", "is a Python keyword"),
    ],
)
def test_names_that_are_no_names_are_refused(name, message):
    with pytest.raises(ModelError, match=message):
        with_parameter(name)
    with pytest.raises(ModelError, match=message):
        replace(GOOD, name=name)


@pytest.mark.parametrize(
    ("one", "other"), [("x1", "x_1"), ("alpha_2", "alpha2"), ("b__c", "b_c"), ("x1dot", "xdot_1"), ("a_b_1", "a_b__1")]
)
def test_symbols_that_are_typeset_alike_are_refused(one, other):
    extra = [Parameter(Symbol(name), 1.0, "1", "named so") for name in (one, other)]
    made = replace(GOOD, parameters=(*GOOD.parameters, *extra), potential_energy=k * x**2 * Symbol(one) * Symbol(other))
    with pytest.raises(ModelError, match=f"model named: {one} and {other} are typeset alike; rename one of them"):
        artefacts(made, "test.py")


def test_a_rate_that_is_typeset_like_a_parameter_is_refused():
    coordinate = Coordinate(Symbol("x_1"), "m", "displacement")
    parameters = (*GOOD.parameters, Parameter(Symbol("x1dot"), 1.0, "1", "named so"))
    made = replace(
        GOOD,
        coordinates=[coordinate],
        parameters=parameters,
        kinetic_energy=half * m * Symbol("xdot_1") ** 2,
        potential_energy=k * Symbol("x_1") * Symbol("x1dot"),
    )
    with pytest.raises(ModelError, match="xdot_1 and x1dot are typeset alike"):
        describe(derive(made), "test.py")


@given(st.from_regex(r"[a-z]{1,2}(_?[a-z0-9]{1,2})?", fullmatch=True))
@settings(max_examples=30, deadline=None)
def test_any_name_is_refused_or_generates_kernels_with_the_right_numbers(name):
    try:
        made = with_parameter(name)
        program = lower(derive(made))
        describe(derive(made), "test.py")
    except ModelError as refused:
        assert name in str(refused)
        return
    values = {"x": 0.1, "xdot": 0.2, "m": 2.0, "k": 50.0, name: 0.5}
    constants = program.kernels["constants"].evaluate(values)
    values |= {str(symbol): constants[f"constants[{i}]"] for i, symbol in enumerate(program.constants)}
    found = program.kernels["rhs"].evaluate(values)["derivative[1]"]
    assert found == pytest.approx(-(50.0 * 0.1 + 2 * 0.5 * 50.0 * 0.1**3) / 2.0, rel=1e-14)
