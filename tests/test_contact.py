"""Compliant contact: Hertz's duration and energy, Hunt and Crossley's restitution, friction, and what is refused."""

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp
from scipy.optimize import brentq
from sympy import Rational, sqrt, symbols

import qddot
from qddot.codegen.lagrange import derive
from qddot.model import Contact, Coordinate, DryFriction, Impact, ModelError, Parameter, Part, System

HALF = Rational(1, 2)
x, y, z, xdot, ydot, zdot = symbols("x y z xdot ydot zdot")
m, k, r, a, e, mu, N, F_t = symbols("m k r a e mu N F_t")
HERTZ = k * sqrt(r)
TIGHT = {"method": "dop853", "rtol": 1e-11, "atol": 1e-14}
STIFFNESS, MASS, SPEED = 4e6, 0.3, 1.5
ROWS = [
    Parameter(m, MASS, "kg", "mass"), Parameter(k, STIFFNESS / np.sqrt(0.04), "N/m^2", "modulus"),
    Parameter(r, 0.04, "m", "radius"),
]  # fmt: skip


def ball(name="hertz", rows=(), **contact):
    """A ball without weight that comes to a wall."""
    given = {"stiffness": HERTZ} | contact
    return System(
        name, "A ball at a wall", [Coordinate(y, "m", "distance")], [*ROWS, *rows], HALF * m * ydot**2,
        contacts=[Contact(N, y, "N", "the ball at the wall", **given)],
    )  # fmt: skip


DAMPING = Parameter(a, 0.2, "s/m", "damping")


def skidding():
    """A ball that meets a wall at an angle, and is slowed along it by friction."""
    return System(
        "skidding", "A ball along a wall", [Coordinate(y, "m", "distance"), Coordinate(x, "m", "along the wall")],
        [*ROWS, DAMPING, Parameter(mu, 0.25, "1", "friction")], HALF * m * (ydot**2 + xdot**2),
        quantities=[DryFriction(F_t, xdot, mu * N, "N", "friction at the wall")], generalized_forces={x: -F_t},
        contacts=[Contact(N, y, "N", "the ball at the wall", stiffness=HERTZ, damping=a)],
    )  # fmt: skip


@pytest.fixture(scope="module")
def models(tmp_path_factory):
    folder, made = tmp_path_factory.mktemp("contact"), {}

    def model(name):
        builds = {"hertz": ball, "damped": lambda: ball("damped", [DAMPING], damping=a), "skidding": skidding}
        if name not in made:
            made[name] = qddot.load(qddot.generate(builds[name](), folder))
        return made[name]

    return model


def test_hertz_takes_as_long_as_published_and_loses_nothing(models):
    """K. L. Johnson, Contact Mechanics (1985), equation 11.24: 2.94 times the greatest depth by the speed."""
    start = 1e-3
    depth = (5 * MASS * SPEED**2 / (4 * STIFFNESS)) ** 0.4
    share = 2 * quad(lambda s: 2.0 / 5 * s ** (-0.6) / np.sqrt(1 - s), 0, 1)[0]
    assert share == pytest.approx(2.94, abs=5e-3)
    run = qddot.simulate(models("hertz"), (0, 8e-3), initial=[start, -SPEED], **TIGHT)
    meets = start / SPEED
    lasts = share * depth / SPEED
    pushed = run.t[run["N"] > 0]
    assert pushed[0] > meets
    assert run["y"].min() == pytest.approx(-depth, rel=1e-3)
    assert run.extremes("y").least == pytest.approx(-depth, rel=1e-9)
    assert run["ydot"][-1] == pytest.approx(SPEED, rel=1e-9)
    # behind the contact the ball is where it would be, had it been thrown back that much later
    assert run["y"][-1] == pytest.approx(SPEED * (8e-3 - meets - lasts), abs=1e-11)
    energy = MASS * run["ydot"] ** 2 / 2 + 0.4 * STIFFNESS * np.maximum(-run["y"], 0) ** 2.5
    np.testing.assert_allclose(energy, MASS * SPEED**2 / 2, rtol=1e-9)
    np.testing.assert_allclose(run["N"], STIFFNESS * np.maximum(-run["y"], 0) ** 1.5, rtol=1e-12)


@pytest.mark.parametrize("method", ["dop853", "rodas5p"])
def test_hunt_and_crossley_give_back_what_their_equation_says(models, method):
    """From m v dv/dd = -k d^n (1 + b v), v the speed into the wall: v/b - log(1 + b v)/b^2 is the same at both ends."""
    b = 1.5 * 0.2

    def invariant(v):
        return v / b - np.log1p(b * v) / b**2

    out = brentq(lambda v: invariant(-v) - invariant(SPEED), 0.5, SPEED, xtol=1e-15)
    tolerances = {"rtol": 1e-11, "atol": 1e-14} if method == "dop853" else {"rtol": 1e-9, "atol": 1e-12}
    run = qddot.simulate(models("damped"), (0, 8e-3), initial=[1e-3, -SPEED], method=method, **tolerances)
    assert run["ydot"][-1] == pytest.approx(out, rel=1e-9 if method == "dop853" else 1e-6)
    assert out / SPEED == pytest.approx(1 - 0.2 * SPEED, abs=(0.2 * SPEED) ** 2)  # to first order, as they say

    def slope(t, s):
        return [s[1], STIFFNESS * max(-s[0], 0.0) ** 1.5 * (1 - b * s[1]) / MASS]

    found = solve_ivp(slope, (0, 8e-3), [1e-3, -SPEED], method="DOP853", rtol=1e-12, atol=1e-16, max_step=2e-6)
    np.testing.assert_allclose(run.states[-1], found.y[:, -1], rtol=1e-6)
    np.testing.assert_allclose(
        run["N"], STIFFNESS * np.maximum(-run["y"], 0) ** 1.5 * (1 - b * run["ydot"]), rtol=1e-9, atol=1e-9
    )
    assert (run["N"] >= 0).all()


def test_what_is_torn_off_is_not_held_back(models):
    """A ball deep in the wall that leaves faster than its damping lets it: nothing pulls."""
    run = qddot.simulate(models("damped"), (0, 1e-4), initial=[-1e-3, 8.0], **TIGHT)
    np.testing.assert_allclose(run["ydot"], 8.0, rtol=1e-12)
    np.testing.assert_array_equal(run["N"], 0.0)


def test_friction_at_the_contact_is_its_share_of_the_push(models):
    """While it slides, the impulse along the wall is mu times that against it."""
    run = qddot.simulate(models("skidding"), (0, 8e-3), initial={"y": 1e-3, "ydot": -SPEED, "xdot": 3.0}, **TIGHT)
    against = MASS * (run["ydot"][-1] + SPEED)
    assert run["xdot"][-1] == pytest.approx(3.0 - 0.25 * against / MASS, rel=1e-9)
    assert run["N"].max() > 100
    slow = qddot.simulate(models("skidding"), (0, 8e-3), initial={"y": 1e-3, "ydot": -SPEED, "xdot": 0.1}, **TIGHT)
    assert abs(slow["xdot"][-1]) < 1e-9  # it sticks before the wall lets it go


def test_lanes_take_compliant_contact(models):
    speeds = np.linspace(0.5, 2.0, 8)
    batch = qddot.simulate_batch(
        models("hertz"), (0, 1e-2), method="rk4", step=1e-6, initial={"y": 1e-3, "ydot": -speeds}, output_times=2
    )
    assert not batch.reason
    np.testing.assert_allclose(batch["ydot"][:, -1], speeds, rtol=1e-6)


def rigid(**contact):
    rows = [*ROWS[:1], Parameter(e, 0.5, "1", "restitution")]
    return System(
        "rigid", "A ball", [Coordinate(y, "m", "distance")], rows, HALF * m * ydot**2, e * y,
        contacts=[Contact(N, y, "N", "at the wall", **contact)],
    )  # fmt: skip


def test_rigid_contact_is_an_impact_that_rests():
    made = rigid(restitution=e)
    (impact,) = made.events
    assert isinstance(impact, Impact)
    assert (impact.name, impact.force, impact.unit, impact.restitution) == ("N", N, "N", e)
    assert derive(made).contacts
    assert rigid().events[0].restitution == 0


def test_copies_of_a_part_have_contacts_of_their_own():
    buffer = Part(
        "buffer", [Coordinate(y, "m", "distance")], ROWS, HALF * m * ydot**2,
        contacts=[Contact(N, y, "N", "at the wall", stiffness=HERTZ)],
    )  # fmt: skip
    both = (buffer("1") + buffer("2")).system("buffers", "Two buffers")
    assert [str(each.symbol) for each in both.outputs] == ["N_1", "N_2"]
    assert both.outputs[1].meaning == "at the wall, buffer 2"
    assert {str(each.symbol) for each in both.quantities} == {"gap_N_1", "N_1", "gap_N_2", "N_2"}


def test_a_gap_may_be_a_quantity():
    from qddot.model import Quantity

    height = symbols("h")
    made = System(
        "named", "A ball", [Coordinate(y, "m", "distance")], ROWS, HALF * m * ydot**2,
        quantities=[Quantity(height, 2 * y, "m", "height")], contacts=[Contact(N, height, "N", "low", stiffness=HERTZ)],
    )  # fmt: skip
    assert [str(each.symbol) for each in made.quantities] == ["h", "gap_N", "N"]


@pytest.mark.parametrize(
    ("contact", "message"),
    [
        ({"restitution": 0.5}, "contact N has stiffness and restitution, which follows from the damping there"),
        ({"stiffness": None, "damping": a}, "contact N has damping and no stiffness, without which it is rigid"),
        ({"stiffness": None, "exponent": 2}, "contact N has exponent and no stiffness"),
        ({"stiffness": None, "restitution": -0.1}, "contact N has the restitution -0.1, expected a number from 0 to 1"),
        ({"stiffness": None, "restitution": 1.5}, "contact N has the restitution 1.5, expected a number from 0 to 1"),
        ({"stiffness": -4.0}, "contact N has the stiffness -4.0, expected a number above 0"),
        ({"exponent": 0.5}, "contact N has the exponent 0.5, expected a number of at least 1"),
        ({"damping": True}, "contact N has the damping True, expected a number above 0"),
        ({"stiffness": k * y}, "contact N: stiffness depends on y; it may depend on parameters alone"),
    ],
)
def test_misuse_is_told(contact, message):
    with pytest.raises(ModelError, match=message):
        ball("bad", [DAMPING], **contact)


@pytest.mark.parametrize("gap", [k, ydot, y + ydot])
def test_a_gap_is_made_of_coordinates(gap):
    with pytest.raises(ModelError, match=r"contact N: its gap is .*, expected a distance made of coordinates, and of"):
        System(
            "bad", "A ball", [Coordinate(y, "m", "distance")], ROWS, HALF * m * ydot**2,
            contacts=[Contact(N, gap, "N", "at the wall", stiffness=HERTZ)],
        )  # fmt: skip
    with pytest.raises(ModelError, match="contacts holds 3, expected Contact"):
        System("bad", "A ball", [Coordinate(y, "m", "distance")], ROWS[:1], HALF * m * ydot**2, contacts=[3])
