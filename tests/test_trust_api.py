"""The walls of the Python API: whatever is given, it works, or one line says which argument was wrong."""

from decimal import Decimal
from fractions import Fraction

import numpy as np
import pytest
from numba import njit

import qddot

CAR = qddot.load("quarter_car")
ROAD = qddot.signal.table([0.0, 1.0, 2.0], [0.0, 0.01, 0.0])


@njit(cache=True)
def swinging(t, x, u, c, dx):
    dx[0], dx[1] = x[1], -x[0] + u[0]


#: What nobody should give, for any argument: a call may take it, if it means something there, or must name it.
BATTERY = {
    "True": True,
    "text": "abc",
    "bytes": b"abc",
    "complex": 1 + 2j,
    "nan": float("nan"),
    "infinite": float("inf"),
    "numpy nan": np.float32("nan"),
    "numpy truth": np.bool_(True),
    "numpy text": np.str_("1"),
    "decimal": Decimal("0.1"),
    "fraction": Fraction(1, 3),
    "huge": 10**400,
    "enormous": 10**5000,
    "below zero": -1.0,
    "no whole number": 2.5,
    "too large to count": 2**63,
    "nothing in it": [],
    "no names": {},
    "numbers by name": {"nobody": 1.0},
    "texts": ["1", "2"],
    "ragged": [[1.0], [1.0, 2.0]],
    "three deep": np.zeros((2, 2, 2)),
    "objects": [object()],
    "an object": object(),
    "a function": lambda t: t,
    "a signal": ROAD,
    "signals": [ROAD, ROAD],
    "a date": np.datetime64("2026-01-01"),
    "a range": range(3),
    "a set": {1.0, 2.0},
    "a model": CAR,
    "numbers that are no numbers": np.array([np.nan, 1.0]),
    "many lines": np.arange(3000.0).reshape(100, 30),
}

RUN = {"span": (0.0, 0.01), "step": 1e-3, "initial": np.zeros(4)}
QUICK = {"span": (0.0, 0.01), "method": "dop853", "initial": np.zeros(4)}
SOLVE = {"rhs": swinging, "span": (0.0, 0.01), "x0": [1.0, 0.0], "method": "dop853", "inputs": [0.0]}
PULSE = {"times": [0.0], "peak": 1.0, "duration": 0.1}
HOLE = {"depth": 0.1, "length": 1.0}
SHOT = {"t": [0.0, 1.0, 2.0], "values": [0.0, 1.0, 0.0], "times": [0.0]}
STEPPING = ["rtol", "atol", "max_step", "first_step", "max_steps", "divergence_limit", "time_limit", "progress"]
SAVING = ["output_times", "refine", "events", "controller"]

#: Function, arguments that work, and those of them or beside them that are given wrongly.
CALLS = {
    "simulate": (
        qddot.simulate,
        {"model": CAR, **RUN},
        ["model", "span", "method", "step", "parameters", "inputs", "initial", "on_failure", "every", "time_limit"],
    ),
    "simulate adaptively": (qddot.simulate, {"model": CAR, **QUICK}, [*STEPPING, *SAVING]),
    "prepare": (qddot.prepare, {"model": CAR, **RUN}, ["model", "span", "method", "step", "parameters", "inputs"]),
    "solve": (
        qddot.solve,
        SOLVE,
        ["rhs", "span", "x0", "method", "constants", "inputs", "jacobian", "mass_matrix", "state_names", "on_failure"],
    ),
    "solve stiffly": (qddot.solve, SOLVE | {"method": "ode15s"}, ["max_order", "bdf", "mass_matrix", "jacobian"]),
    "simulate_batch": (
        qddot.simulate_batch,
        {"model": CAR, **QUICK, "runs": 1},
        ["model", "span", "method", "parameters", "initial", "inputs", "output_times", "names", "threads", *STEPPING],
    ),
    "equilibrium": (qddot.equilibrium, {"model": CAR}, ["model", "parameters", "inputs", "t0", "guess"]),
    "modes": (qddot.modes, {"model": CAR}, ["model", "parameters", "state", "inputs", "t0"]),
    "crossing": (qddot.crossing, {"model": CAR, "name": "z_s"}, ["model", "name", "level", "direction", "terminal"]),
    "per_run": (qddot.per_run, {"signal": ROAD}, ["signal", "rate", "offset"]),
    "pulse_train": (qddot.signal.pulse_train, PULSE, ["shape", "times", "peak", "duration", "rise"]),
    "pulse_train of an impulse": (
        qddot.signal.pulse_train,
        {"times": 0.0, "impulse": 1.0, "duration": 0.1},
        ["impulse"],
    ),
    "measured_pulse_train": (
        qddot.signal.measured_pulse_train,
        SHOT,
        ["t", "values", "times", "kind", "peak", "duration", "impulse"],
    ),
    "table": (qddot.signal.table, {"t": [0.0, 1.0], "values": [0.0, 1.0]}, ["t", "values", "kind", "breakpoints"]),
    "sine": (qddot.signal.sine, {"amplitude": 1.0, "frequency": 1.0}, ["amplitude", "frequency", "phase", "mean"]),
    "constant": (qddot.signal.constant, {"value": 1.0}, ["value"]),
    "random_road": (
        qddot.road.iso8608,
        {"of": "C", "seed": 1, "length": 5.0},
        ["of", "seed", "length", "waviness", "shortest", "longest", "fade"],
    ),
    "wave": (qddot.road.sine, {"amplitude": 0.1, "wavelength": 1.0}, ["amplitude", "wavelength", "phase", "mean"]),
    "ramp": (qddot.road.ramp, {"height": 0.1, "length": 1.0}, ["height", "length", "at"]),
    "step": (qddot.road.step, {"height": 0.1}, ["height", "at"]),
    "cosine_bump": (qddot.road.cosine_bump, {"height": 0.1, "length": 1.0}, ["height", "length", "at"]),
    "pothole": (qddot.road.pothole, HOLE, ["depth", "length", "at", "edge"]),
    "drive": (
        qddot.drive,
        {"model": CAR, "road": ROAD, "speed": 1.0, "positions": {"z_r": 0.0}},
        ["model", "road", "speed", "parameters", "start", "positions"],
    ),
    "drive at a speed that varies": (
        qddot.drive,
        {"model": CAR, "road": ROAD, "speed": ROAD, "positions": {"z_r": 0.0}, "span": (0.0, 1.0)},
        ["span"],
    ),
    "recoil_impulse": (
        qddot.signal.recoil_impulse,
        {"shell_mass": 0.7, "muzzle_velocity": 900.0},
        ["shell_mass", "muzzle_velocity", "charge_mass", "gas_velocity_factor"],
    ),
    "shot_times": (qddot.signal.shot_times, {"count": 2, "interval": 1.0}, ["count", "interval", "start"]),
    "shot_times of a rate": (qddot.signal.shot_times, {"count": 2, "rate_of_fire": 60.0}, ["rate_of_fire"]),
    "load": (qddot.load, {"name_or_path": "quarter_car"}, ["name_or_path"]),
}

#: What a message calls an argument where not by its name: the kind of a thing whose name was looked up, and not found.
CALLED = {
    "of": ("road class", "roughness"),
    "shape": ("pulse shape",),
    "kind": ("kind of table",),
    "name": ("state or output",),
    "name_or_path": ("model", "no file"),
    "parameters": ("parameter",),
    "inputs": ("input",),
    "initial": ("state",),
    "guess": ("coordinate",),
    "positions": ("input", "position"),
    "names": ("state or output",),
    "peak": ("pulse",),
    "impulse": ("pulse",),
    "length": ("road", "samples"),
    "shortest": ("road", "samples", "longest"),
    "t": ("table",),
    "values": ("table", "value"),
    "speed": ("span",),
    "output_times": ("output time",),
}


@pytest.mark.parametrize(("call", "argument"), [(call, each) for call, row in CALLS.items() for each in row[2]])
def test_a_wrong_argument_is_named_in_one_line(call, argument):
    function, works, _ = CALLS[call]
    for what, value in BATTERY.items():
        try:
            function(**works | {argument: value})
        except (ValueError, TypeError) as error:
            message = str(error)
            assert "\n" not in message, (what, message)
            assert len(message) < 2000, (what, message)
            named = [argument, *CALLED.get(argument, ())]
            assert any(name in message for name in named), (what, message)
        except qddot.IntegrationError:
            assert argument in ("max_steps", "divergence_limit", "time_limit", "max_step", "first_step", "inputs"), what


def test_the_arguments_that_the_battery_varies_work():
    for function, works, _ in CALLS.values():
        function(**works)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: qddot.simulate("m113", (0, 1)), r"model is 'm113', expected a model: qddot.load\('m113'\)"),
        (lambda: qddot.simulate(CAR, 10), r"span is 10, expected \(start, end\)"),
        (lambda: qddot.simulate(CAR, (0, 1), inputs=ROAD), "inputs is <Signal of .*, expected a mapping from names"),
        (lambda: qddot.simulate(CAR, (0, 10**400), step=1.0), "span: its end is 1000.*, expected a finite number"),
        (lambda: qddot.simulate(CAR, (0, 1), method="ode15s", max_order=2.5), "max_order is 2.5, expected a whole"),
        (lambda: qddot.simulate(CAR, (0, 1), step=0.1, every=2**63), "every is 9223372036854775808, expected a whole"),
        (lambda: qddot.simulate(CAR, (0, 1), method="ode45", atol=[1e-6] * 3), "atol has 3 entries, expected one"),
        (lambda: qddot.simulate(CAR, (0, 1), step=0.1, atol=[1e-6] * 3), "atol: method rk4 takes none"),
        (lambda: qddot.simulate(CAR, (0, 1), method="ode45", rtol=[]), r"rtol is \[\], expected a number between"),
        (lambda: qddot.simulate(CAR, (1, 2), method="ode45", max_step=1e-20), "max_step is 1e-20, too small"),
        (lambda: qddot.simulate(CAR, (1, 2), method="ode15s", max_step=1e-20), "max_step is 1e-20, too small"),
        (lambda: qddot.solve(**SOLVE, state_names=["a", "a"]), r"state_names\[1\] is 'a', the name of another state"),
        (lambda: qddot.solve(**SOLVE, state_names=["a", "u_1"]), r"state_names\[1\] is 'u_1', the name of an input"),
        (lambda: qddot.solve(**SOLVE, state_names=["t", "b"]), r"state_names\[0\] is 't', the name of time"),
        (lambda: qddot.solve(**SOLVE, state_names="ab"), "state_names is 'ab', expected 2 names"),
    ],
)
def test_what_was_accepted_once_is_refused_by_name(call, message):
    with pytest.raises(ValueError, match=message):
        call()


@njit
def reads_constants(t, x, u, c, dx):
    dx[0], dx[1] = x[1], -c[2] * x[0]


@njit
def reads_inputs(t, x, u, c, dx):
    dx[0], dx[1] = x[1], u[3]


@njit
def writes_too_much(t, x, u, c, dx):
    for i in range(3):
        dx[i] = x[0]


@njit
def writes_too_little(t, x, u, c, dx):
    dx[0] = x[1]


@njit
def adds_up(t, x, u, c, dx):
    dx[0] = x[1]
    dx[1] += x[0]


@njit
def half_a_jacobian(t, x, u, c, J):
    J[0, 1], J[1, 0] = 1.0, -1.0


@njit
def reads_far(t, x, u, c):
    return c[5]


@njit
def only_compiled(t, x, u, c, dx):
    """Plain Python raises at the root of a negative number: the check is by a compiled copy."""
    dx[0] = x[1]
    dx[1] = -c[1] * x[0] + 0.0 * min(math_root(-1.0), 0.0)


@njit
def math_root(value):
    return np.sqrt(value)


@pytest.mark.parametrize(
    ("rhs", "more", "message"),
    [
        (reads_constants, {"constants": [1.0, 2.0]}, "rhs reads constants beyond the 2 given: index 2 is out of"),
        (reads_inputs, {"inputs": [0.0, 0.0]}, "rhs reads inputs beyond the 2 given: index 3 is out of bounds"),
        (writes_too_much, {}, r"rhs writes beyond the \(2,\) of its last argument, as x0 has 2 states"),
        (writes_too_little, {}, r"rhs does not write dx\[1\]; x0 has 2 states"),
        (adds_up, {}, r"rhs does not write dx\[1\]"),
        (swinging, {"jacobian": half_a_jacobian, "method": "ode15s"}, r"jacobian does not write J\[0, 0\]"),
        (swinging, {"events": [qddot.Event(reads_far)]}, r"events\[0\] reads constants beyond the 0 given"),
        (only_compiled, {"constants": [1.0]}, "rhs reads constants beyond the 1 given"),
    ],
)
def test_a_function_that_leaves_its_arrays_is_stopped_at_its_first_call(rhs, more, message):
    with pytest.raises(ValueError, match=message):
        qddot.solve(**SOLVE | {"rhs": rhs} | more)


def test_a_function_is_checked_once_for_the_sizes_it_gets():
    qddot.solve(**SOLVE | {"rhs": reads_constants, "constants": [1.0, 2.0, 4.0]})
    s = qddot.solve(**SOLVE | {"rhs": reads_constants, "constants": [1.0, 2.0, 4.0], "rtol": 1e-9})
    np.testing.assert_allclose(s["x_1"], np.cos(2 * s.t), atol=1e-8)
    with pytest.raises(ValueError, match="rhs reads constants beyond the 2 given"):
        qddot.solve(**SOLVE | {"rhs": reads_constants, "constants": [1.0, 2.0]})
