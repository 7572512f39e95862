"""Conditions in t and parameters alone are breakpoints: no method steps over a pulse, or across a corner."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from sympy import Abs, Heaviside, Max, Piecewise, Rational, Symbol, cos, sin, symbols

import qddot
from qddot.codegen.equations.notation import describe
from qddot.codegen.equations.terminal import text
from qddot.codegen.lagrange import derive
from qddot.model import Coordinate, Input, Output, Parameter, Quantity, State, System, t
from qddot.runner.report.energy import balance
from qddot.runner.switching import sides

HALF = Rational(1, 2)
x, xdot, m, k, c, F, t_1, t_2, w, omega, u = symbols("x xdot m k c F t_1 t_2 w omega u")


def system(name, force, parameters, **changes):
    """A mass on a spring and a damper under a force."""
    given = {
        "title": "Mass under a force of time",
        "coordinates": [Coordinate(x, "m", "place")],
        "parameters": [
            Parameter(m, 2.0, "kg", "mass"),
            Parameter(k, 50.0, "N/m", "stiffness"),
            Parameter(c, 0.4, "N s/m", "damping"),
            *(Parameter(Symbol(each), value, unit, f"number {each}") for each, (value, unit) in parameters.items()),
        ],
        "kinetic_energy": HALF * m * xdot**2,
        "potential_energy": HALF * k * x**2,
        "dissipation": HALF * c * xdot**2,
        "generalized_forces": {x: force},
    }  # fmt: skip
    return System(name=name, **given | changes)


def load(made, folder):
    return qddot.load(qddot.generate(made, folder))


@pytest.fixture(scope="module")
def pulse(tmp_path_factory):
    """A force F from t_1 on for w s, a microsecond by default; and an output that says so."""
    force = F * Piecewise((1, (t >= t_1) & (t < t_1 + w)), (0, True))
    parameters = {"F": (3e5, "N"), "t_1": (1.7, "s"), "w": (1e-6, "s")}
    made = system("pulse", force, parameters, outputs=[Output(Symbol("push"), force, "N", "the pulse")])
    return load(made, tmp_path_factory.mktemp("kernels"))


@pytest.fixture(scope="module")
def course(tmp_path_factory):
    """A ramp that is cut off, a square wave, a corner of |t - t_2| and a filter that is switched on: curves of time."""
    h = Symbol("h")
    force = F * (Max(0, t - t_1) - Max(0, t - t_1 - w)) + F * HALF * Heaviside(sin(omega * t) - HALF) + u
    numbers = {"F": (4.0, "N"), "t_1": (0.31, "s"), "w": (0.5, "s"), "omega": (7.0, "rad/s"), "t_2": (1.3, "s")}
    made = system(
        "course", force - h, numbers,
        inputs=[Input(u, "N", "a force from outside")],
        states=[State(h, Piecewise((x - h, t > t_2), (-h, True)), "N", "filter", Symbol("hdot"))],
        quantities=[Quantity(Symbol("y"), Abs(t - t_2) * x, "m s", "a corner", rate=Symbol("ydot"))],
        outputs=[Output(Symbol("rate"), Symbol("ydot"), "m", "a rate that jumps")],
    )  # fmt: skip
    return load(made, tmp_path_factory.mktemp("kernels"))


def after_pulse(span, start, width, F=3e5):
    """State at the end of a run from rest by the formula of the damped oscillator, the pulse integrated by SciPy."""

    def slope(t, y, force):
        return [y[1], (force - 50.0 * y[0] - 0.4 * y[1]) / 2.0]

    y = np.zeros(2)
    for (a, b), force in zip(pairwise((start, start + width, span)), (F, 0.0), strict=True):
        y = solve_ivp(slope, (a, b), y, args=(force,), method="DOP853", rtol=1e-12, atol=1e-14).y[:, -1]
    return y


METHODS = [
    ("dop853", {"rtol": 1e-6, "atol": 1e-9}, 1e-5), ("rodas5p", {"rtol": 1e-6, "atol": 1e-9}, 1e-5),
    ("taylor", {"rtol": 1e-9, "atol": 1e-12}, 1e-8), ("rk4", {"step": 1e-3}, 1e-6),
]  # fmt: skip


@pytest.mark.parametrize(("method", "options", "tolerance"), METHODS)
def test_a_pulse_of_a_microsecond_is_never_stepped_over(pulse, method, options, tolerance):
    run = qddot.simulate(pulse, (0, 5), method=method, initial=[0, 0], **options)
    np.testing.assert_allclose(run.states[-1], after_pulse(5.0, 1.7, 1e-6), rtol=0, atol=tolerance)
    back = qddot.simulate(pulse, (5, 0), method="dop853", rtol=1e-10, atol=1e-12, initial=run.states[-1])
    np.testing.assert_allclose(back.states[-1], 0.0, atol=5 * tolerance)


def test_each_run_of_a_batch_has_its_own_instants(pulse):
    """In lanes and one by one, from an epoch on too."""
    starts, widths = np.linspace(0.3, 4.2, 16), np.geomspace(1e-6, 0.5, 16)
    parameters = {"t_1": starts, "w": widths, "F": 0.3 / widths}
    expected = np.array([after_pulse(5.0, a, b, 0.3 / b) for a, b in zip(starts, widths, strict=True)])
    for method, options in (("dop853", {"rtol": 1e-9, "atol": 1e-12}), ("rk4", {"step": 1e-3})):
        batch = qddot.simulate_batch(
            pulse, (0, 5), method=method, parameters=parameters, initial=[0, 0], output_times=[5.0], **options
        )
        found = np.stack([batch["x"][:, -1], batch["xdot"][:, -1]], axis=1)
        np.testing.assert_allclose(found, expected, rtol=0, atol=2e-6)
    late = 1e6
    run = qddot.simulate(
        pulse, (late, late + 5), method="dop853", rtol=1e-8, atol=1e-11, initial=[0, 0],
        parameters={"t_1": late + 1.5, "w": 0.25, "F": 2.0},
    )  # fmt: skip
    np.testing.assert_allclose(run.states[-1], after_pulse(5.0, 1.5, 0.25, 2.0), rtol=0, atol=1e-7)


def test_outputs_see_the_pulse_they_are_in(pulse):
    run = qddot.simulate(
        pulse, (0, 3), method="dop853", initial=[0, 0], parameters={"w": 0.5, "F": 2.0},
        output_times=[1.0, 1.69, 1.71, 2.19, 2.21, 3.0],
    )  # fmt: skip
    assert run["push"].tolist()[-6:] == [0.0, 0.0, 2.0, 2.0, 0.0, 0.0]


def test_the_energy_that_a_pulse_puts_in_is_found(pulse):
    given = {"w": 0.5, "F": 3.0}
    run = qddot.simulate(pulse, (0, 5), method="dop853", rtol=1e-9, atol=1e-12, initial=[0.01, 0], parameters=given)
    found = balance(run, pulse, given, {})
    assert found.put_in[-1] > 0.1
    assert found.error < 1e-7 * found.size


def scipy_course(end):
    """The other model by SciPy at 1e-12, from corner to corner, which are written down by hand."""
    wave = [(np.arcsin(0.5) + 2 * np.pi * i) / 7.0 for i in range(9)] + [
        (np.pi - np.arcsin(0.5) + 2 * np.pi * i) / 7.0 for i in range(9)
    ]
    stops = sorted({0.0, end, *(s for s in (0.31, 0.81, 1.3, *wave) if 0 < s < end)})
    y = np.array([0.02, 0.0, 0.0])
    for a, b in pairwise(stops):
        middle = 0.5 * (a + b)
        on, late = float(np.sin(7.0 * middle) > 0.5), middle > 1.3
        ramp = 0 if middle < 0.31 else 1 if middle < 0.81 else 2

        def slope(t, y, on=on, late=late, ramp=ramp):
            force = 4.0 * (0.0, t - 0.31, 0.5)[ramp] + 2.0 * on - y[2] + 0.3 * np.sin(4.0 * t)
            return [y[1], (force - 50.0 * y[0] - 0.4 * y[1]) / 2.0, (y[0] if late else 0.0) - y[2]]

        y = solve_ivp(slope, (a, b), y, method="DOP853", rtol=1e-12, atol=1e-14).y[:, -1]
    return y


@pytest.mark.parametrize(
    ("method", "options", "tolerance"),
    [("dop853", {"rtol": 1e-11, "atol": 1e-13}, 1e-10), ("rk4", {"step": 1e-3}, 1e-10)],
)
def test_ramps_square_waves_and_corners_keep_the_order_of_a_method(course, method, options, tolerance):
    wave = qddot.signal.sine(0.3, 4.0 / (2 * np.pi))
    run = qddot.simulate(course, (0, 3), method=method, initial=[0.02, 0, 0], inputs={"u": wave}, **options)
    np.testing.assert_allclose(run.states[-1], scipy_course(3.0), rtol=0, atol=tolerance)
    assert run["rate"][-1] == pytest.approx(run["x"][-1] + 1.7 * run["xdot"][-1], rel=1e-12)


def breakpoints(model, name, start, end, **parameters):
    given = sides(model, model.constants(model.parameter_values(parameters)), start, end)
    return given[name].breakpoint_times()


def test_all_instants_are_found(course):
    names = {each.name: each.meaning for each in course.tables.inputs if each.input == "t"}
    assert len(names) == 4
    wave = next(name for name, meaning in names.items() if "sin" in meaning)
    found = breakpoints(course, wave, 0.0, 200.0, omega=7.0)
    first, second = np.arcsin(0.5) / 7.0, (np.pi - np.arcsin(0.5)) / 7.0
    period = 2 * np.pi / 7.0
    expected = np.sort([s + i * period for s in (first, second) for i in range(300)])
    np.testing.assert_allclose(found, expected[expected < 200.0], rtol=1e-14, atol=1e-14)
    line = next(name for name, meaning in names.items() if "t_2" in meaning)
    assert breakpoints(course, line, -5.0, 5.0).tolist() == [1.3]


@pytest.mark.parametrize("level", [0.999, 0.9999999])
def test_a_pulse_between_the_instants_that_are_looked_at_is_found(tmp_path, level):
    """cos(omega t) > 0.9999999 holds for 0.0001 of a period."""
    force = Piecewise((F, cos(omega * t) > Symbol("p")), (0, True))
    model = load(system("peaks", force, {"F": (1.0, "N"), "omega": (3.0, "rad/s"), "p": (level, "1")}), tmp_path)
    found = breakpoints(model, "side_1", 1.0, 20.0)
    half, period = np.arccos(level) / 3.0, 2 * np.pi / 3.0
    expected = np.sort([i * period + side * half for i in range(1, 10) for side in (-1, 1)])
    np.testing.assert_allclose(found, expected[expected < 20.0], rtol=1e-12 / (1 - level) ** 0.5)


def test_pages_show_the_conditions_and_not_their_sides():
    force = F * Piecewise((1, (t >= t_1) & (t < t_2)), (0, True)) + Max(0, t - t_1)
    made = system("shown", force, {"F": (1.0, "N"), "t_1": (1.0, "s"), "t_2": (2.0, "s")})
    page = text(describe(derive(made), "shown.py"), width=100)
    assert "side" not in page
    assert "t₁" in page and "t < t₂" in page


def test_conditions_of_time_and_state_and_of_parameters_alone_stay_where_they_are():
    force = Piecewise((F, t > x), (0, True)) + Piecewise((F, t_1 > t_2), (0, True)) + Max(u, 0)
    made = system(
        "others", force, {"F": (1.0, "N"), "t_1": (1.0, "s"), "t_2": (2.0, "s")}, inputs=[Input(u, "N", "input")]
    )
    assert not derive(made).switches.functions


def test_one_condition_and_its_contrary_are_one_side():
    force = Piecewise((F, t < t_1), (0, True)) + Piecewise((F, t >= t_1), (2 * F, True)) + Max(0, t_1 - t)
    made = system("once", force, {"F": (1.0, "N"), "t_1": (1.0, "s")})
    assert len(derive(made).switches.functions) == 1


def test_sides_follow_from_time_and_are_not_given(pulse):
    with pytest.raises(
        ValueError, match=r"side_1 follows from t and parameters \(1 where .* > 0, else 0\): leave it out"
    ):
        qddot.simulate(pulse, (0, 1), inputs={"side_1": 1.0}, initial=[0, 0], step=1e-2)
    assert "2 inputs" not in repr(pulse)
    assert pulse.tables.free_inputs == ()


def test_what_turns_too_often_or_has_no_end_is_refused(course):
    with pytest.raises(ValueError, match=r"the condition of side_\d turns 1.59e\+09 times from t = 0 to 1000"):
        qddot.prepare(course, (0, 1000), initial=[0, 0, 0], step=1.0, parameters={"omega": 1e7})
    ends = [qddot.crossing(course, "x", terminal=True)]
    with pytest.raises(ValueError, match=r"a condition in t is no straight line .*: give the run an end"):
        qddot.prepare(course, (0, float("inf")), initial=[0, 0, 0], method="dop853", events=ends)


def test_equilibrium_and_modes_are_those_at_their_time(tmp_path):
    stiff = Piecewise((k, t < t_1), (4 * k, True))
    made = system("stiffer", F, {"F": (5.0, "N"), "t_1": (1.0, "s")}, potential_energy=HALF * stiff * x**2)
    model = load(made, tmp_path)
    assert qddot.equilibrium(model, t0=0.0)[0] == pytest.approx(0.1)
    assert qddot.equilibrium(model, t0=2.0)[0] == pytest.approx(0.025)
    assert qddot.modes(model, t0=0.0)[0].natural_frequency == pytest.approx(5.0)
    assert qddot.modes(model, t0=1.0)[0].natural_frequency == pytest.approx(10.0)
    assert not model.tables.linear
