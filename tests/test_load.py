import shutil
import sys
from pathlib import Path

import numpy as np
import pytest
from matrices import linear_matrices
from numba import njit

from qddot.runner.load import LoadError, available, load
from qddot.runner.simulate import prepare, simulate

SAMPLE = Path("tests/sample_models/oscillator.py")
STATE_ROW = '    ("q_1", "m", "displacement of the mass"),\n'


@pytest.fixture(scope="module")
def oscillator():
    return load(SAMPLE)


def test_model_is_loaded_from_a_file(oscillator):
    assert oscillator.name == "oscillator"
    assert oscillator.state_names == ("q_1", "qdot_1")
    assert oscillator.coordinate_names == ("q_1",)
    assert oscillator.tables.parameters[1].unit == "N/m"


@pytest.mark.parametrize("name", available())
def test_every_generated_model_loads_by_name(name):
    assert load(name).name == name


def test_unknown_model_names_the_nearest():
    with pytest.raises(LoadError, match="unknown model 'm13'; did you mean 'm113'"):
        load("m13")


def test_missing_file_is_named():
    with pytest.raises(LoadError, match=r"no file some/where\.py"):
        load("some/where.py")


@pytest.mark.parametrize(
    ("before", "after", "message"),
    [
        ('NAME = "oscillator"', "", "no table NAME, so this is no generated model"),
        ('NAME = "oscillator"', "NAME = 1", "NAME is 1, expected str"),
        (STATE_ROW, "", "STATE has 1 rows, COORDINATES is 1: expected a coordinate or more, and in STATE as many"),
        ("COORDINATES = 1", "COORDINATES = 0", "STATE has 2 rows, COORDINATES is 0"),
        (
            "CONVENTION = 2\n",
            "",
            "for edition 1 of the calling convention and this is edition 2: generate it anew",
        ),
        (
            "JACOBIAN = ((1,), (0, 1))",
            "JACOBIAN = ((1,),)",
            "JACOBIAN is 1 rows, expected the columns of each of 2",
        ),
        (
            "JACOBIAN = ((1,), (0, 1))",
            "JACOBIAN = ((1,), (0, 2))",
            r"JACOBIAN\[1\] is \(0, 2\), expected rising columns",
        ),
        (
            "JACOBIAN = ((1,), (0, 1))",
            "JACOBIAN = ((1,), (1, 0))",
            r"JACOBIAN\[1\] is \(1, 0\), expected rising columns",
        ),
        ("JACOBIAN = ((1,), (0, 1))", "JACOBIAN = ((1,), (0, 1.0))", r"JACOBIAN\[1\] is \(0, 1.0\), expected rising"),
        ("(0, 1, 2))", "(0, 1, 3))", r"INPUT_JACOBIAN\[1\] is \(0, 1, 3\), expected rising columns from 0 to 2"),
        ("MASS = ((0,),)", "MASS = ((1,),)", r"MASS\[0\] is \(1,\), expected rising columns from 0 to 0"),
        ("MASS = ((0,),)", "", "no table MASS, so this is no generated model"),
        (STATE_ROW, '    ("q_1", "m"),\n', r"STATE\[0\] is \('q_1', 'm'\), expected \(name, unit, meaning\)"),
        ('("F_spring"', '("F"', "the name 'F' stands twice in STATE, INPUT and OUTPUT"),
        ('("F_spring"', '("t"', "the name 't' stands twice in STATE, INPUT and OUTPUT, or is that of time"),
        ('("k_1", 50.0', '("m_1", 50.0', "PARAMETER names 'm_1' twice"),
        ('("k_1", 50.0', '("k_1", float("nan")', "PARAMETER k_1 is nan"),
        ('("k_1", 50.0', '("k_1", "50"', r"PARAMETER\[1\] is"),
        ('"weightless": {"g"', '"weightless": {"gg"', r"PARAMETER_SETS\['weightless'\] sets 'gg'"),
        ('("zdot_1", "z_1"', '("zdot_1", "y_1"', "INPUT zdot_1 is the rate of 'y_1', which is no input"),
        ('("z_1", "z_1", 0', '("z_1", "F", 0', "INPUT z_1 is the value of 'F', which is no input"),
        ('("zdot_1", "z_1", 1', '("zdot_1", "z_1", 3', "INPUT zdot_1 is of order 3, expected 0, 1 or 2"),
        (
            '("zdot_1", "z_1", 1',
            '("zdot_1", "z_1", "1"',
            r"INPUT\[2\] is .*expected \(name, input, order, unit,",
        ),
        ("RHS_INPUTS = 3", "RHS_INPUTS = 4", "RHS_INPUTS is 4, but INPUT has 3 rows"),
        ("RHS_INPUTS = 3", 'RHS_INPUTS = 3\nPOSITION = ("z_2",)', "POSITION names 'z_2', which is no input"),
        ("RHS_INPUTS = 3", 'RHS_INPUTS = 3\nPOSITION = ("z_1",)', "kernel 'positions' is missing"),
        ('"b_1": 0.0, "g"', '"b_{1..2}": 0.0, "g"', "sets 'b_2', which is no"),
        ('("k_1", 50.0', '("k_{2..1}", 50.0', "PARAMETER: .* expected ranges of one length that rise"),
        ('"one_over_m_1",', "1,", r"CONSTANT\[0\] is 1, expected a name"),
        ('"constant"', '"dense"', "MASS_MATRIX is 'dense', expected one of constant"),
        ("def mass(", "def masses(", "kernel 'mass' is missing or not compiled by numba"),
        ("def mass(t, x, u, c, values)", "def mass(t, x, c, values)", "kernel 'mass' takes 4 arguments, expected 5"),
        ("def input_jacobian(", "def lines(", "kernel 'input_jacobian' is missing"),
        ("LINEAR = True", "LINEAR = ", "SyntaxError"),
        ("LINEAR = True", "LINEAR = wrong", "NameError: name 'wrong' is not defined"),
    ],
)
def test_malformed_module_is_refused(tmp_path, before, after, message):
    text = SAMPLE.read_text()
    assert text.count(before) == 1
    path = tmp_path / "broken.py"
    path.write_text(text.replace(before, after))
    with pytest.raises(LoadError, match=message) as caught:
        load(path)
    assert str(path) in str(caught.value)


def test_kernel_that_does_not_compile_is_named(tmp_path):
    path = tmp_path / "broken.py"
    path.write_text(SAMPLE.read_text().replace("values[0] = c[0]\n", "values[0] = c.nothing\n"))
    with pytest.raises(LoadError, match="model oscillator: kernel 'mass' does not compile"):
        load(path).kernel("mass")


def _constants(model):
    return model.constants(model.parameter_values(None))


def test_a_folder_copied_with_its_compiled_code_loads(tmp_path):
    """Cached code asks for its module by the name that the first folder gave it: what cannot be had is compiled."""
    first = tmp_path / "first"
    first.mkdir()
    shutil.copy2(SAMPLE, first / "copied.py")
    model = load(first / "copied.py")
    _constants(model)
    del sys.modules[model.module.__name__]  # as in a new process
    shutil.copytree(first, tmp_path / "second")
    shutil.rmtree(first)
    assert list((tmp_path / "second" / "__pycache__").rglob("copied.constants*.nbc"))
    np.testing.assert_array_equal(_constants(load(tmp_path / "second" / "copied.py")), [2.0, 50.0, 1.5, 9.81, 0.5])


def test_a_kernel_that_the_convention_does_not_know_is_refused(oscillator):
    with pytest.raises(LoadError, match="unknown kernel 'linear'"):
        oscillator.kernel("linear")


@pytest.mark.parametrize(
    ("parameters", "expected"),
    [
        (None, [2.0, 50.0, 1.5, 9.81]),
        ("undamped", [2.0, 50.0, 0.0, 0.0]),
        ({"k_1": 8}, [2.0, 8.0, 1.5, 9.81]),
        (("undamped", {"g": 1.62}), [2.0, 50.0, 0.0, 1.62]),
        ((None, {"g": 1.62}), [2.0, 50.0, 1.5, 1.62]),
    ],
)
def test_parameters_are_defaults_then_set_then_values(oscillator, parameters, expected):
    assert oscillator.parameter_values(parameters).tolist() == expected


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ("undampd", "model oscillator: unknown parameter set 'undampd'; did you mean 'undamped'"),
        ({"k1": 1.0}, "model oscillator: unknown parameter 'k1'; did you mean 'k_1'"),
        ({"k_1": np.nan}, "model oscillator: parameter k_1 is nan, expected a finite number"),
        ({"k_1": "stiff"}, "parameter k_1 is 'stiff', expected a number"),
        (3, "parameters is 3, expected a set's name, values by name"),
    ],
)
def test_wrong_parameter_is_named(oscillator, parameters, message):
    with pytest.raises(ValueError, match=message):
        oscillator.parameter_values(parameters)


def test_constants_are_those_of_the_parameters(oscillator):
    c = oscillator.constants(oscillator.parameter_values({"m_1": 4.0}))
    assert c.tolist() == [4.0, 50.0, 1.5, 9.81, 0.25]


def test_positions_follow_the_geometry():
    model = load("m113")
    places = model.positions(model.parameter_values("as_run_unloaded"))
    assert places == pytest.approx({"z_1": 1.66, "z_2": 1.0, "z_3": 0.34, "z_4": -0.32, "z_5": -0.98})
    longer = model.positions(model.parameter_values(("as_run_unloaded", {"l_6": 1.0})))
    assert longer["z_5"] == pytest.approx(-1.32)
    assert load("pendulum").positions(load("pendulum").parameter_values()) == {}


def test_zero_mass_is_named(oscillator):
    with pytest.raises(ValueError, match=r"constant one_over_m_1 is inf; zero: m_1"):
        oscillator.constants(oscillator.parameter_values(("weightless", {"m_1": 0.0})))


def test_constant_that_is_not_finite_is_named_with_its_cause(oscillator):
    with pytest.raises(ValueError, match="constant one_over_m_1 is inf; a parameter is too large or too small"):
        oscillator.constants(oscillator.parameter_values({"m_1": 1e-310}))


def test_state_by_name_or_array(oscillator):
    assert oscillator.state({"qdot_1": 3}).tolist() == [0.0, 3.0]
    assert oscillator.state([1, 2]).tolist() == [1.0, 2.0]


WRONG_STATES = [
    ([1.0], r"initial has shape \(1,\), expected \(2,\): q_1, qdot_1"),
    ([[1.0, 2.0]], r"initial has shape \(1, 2\), expected \(2,\)"),
    ([1.0, np.nan], "initial qdot_1 is nan, expected a finite number"),
    (["1.0", "fast"], "initial is .*'fast'.*, expected 2 numbers"),
]


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"q1": 1.0}, "unknown state 'q1'; did you mean 'q_1'"),
        ({"q_1": np.inf}, "initial q_1 is inf, expected a finite number"),
        *WRONG_STATES,
    ],
)
def test_wrong_state_is_named(oscillator, values, message):
    with pytest.raises(ValueError, match=message):
        oscillator.state(values)


@pytest.mark.parametrize(("values", "message"), WRONG_STATES)
def test_wrong_state_of_a_prepared_run_is_named(oscillator, values, message):
    run = prepare(oscillator, (0, 1), step=1e-2, initial=[0.0, 0.0])
    with pytest.raises(ValueError, match=message):
        run(values)


def test_prepared_run_starts_where_it_is_told(oscillator):
    start = [0.5, -1.0]
    found = prepare(oscillator, (0, 1), step=1e-2, initial=[0.0, 0.0])(start)
    assert found.states[0].tolist() == start
    np.testing.assert_array_equal(found.states, simulate(oscillator, (0, 1), step=1e-2, initial=start).states)


def test_kernels_obey_the_calling_convention(oscillator):
    """The Jacobian and (A, B) against differences of rhs, the energy balance against the accelerations."""
    c = oscillator.constants(oscillator.parameter_values())
    x, u, h = np.array([0.3, -0.7]), np.array([4.0, 0.1, 0.2]), 1e-6
    slope = np.zeros(2)

    def rhs(x):
        oscillator.kernel("rhs")(0.0, x, u, c, slope)
        return slope.copy()

    J = oscillator.matrix("jacobian")(0.0, x, u, c)
    A, B = linear_matrices(oscillator)
    differences = np.stack([(rhs(x + h * e) - rhs(x - h * e)) / (2 * h) for e in np.eye(2)], axis=1)
    np.testing.assert_allclose(J, differences, atol=1e-8)
    np.testing.assert_allclose(A @ x + B @ [*u, 1.0], rhs(x), atol=1e-13)


def test_a_kernel_is_called_from_python_and_from_compiled_code_with_arrays_that_may_be_read_only():
    model = load("quarter_car")
    rhs, c = model.kernel("rhs"), model.constants(model.parameter_values())
    x, u, slope, other = np.linspace(-0.1, 0.2, 4), np.zeros(2), np.empty(4), np.empty(4)

    @njit
    def compiled(t, x, u, c, dx):
        rhs(t, x, u, c, dx)

    compiled(0.0, x, u, c, other)
    for array in (x, u, c):
        array.flags.writeable = False
    rhs(0, x, u, c, slope)
    expected = np.empty(4)
    model.module.rhs.py_func(0.0, x, u, c, expected)
    np.testing.assert_allclose(slope, expected, rtol=1e-13)
    np.testing.assert_array_equal(slope, other)
    slope.flags.writeable = False
    with pytest.raises(TypeError):
        rhs(0.0, x, u, c, slope)
    with pytest.raises(TypeError):
        rhs(0.0, x[::2], u, c, other)
