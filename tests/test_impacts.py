"""Impacts: an impulse along the gap, through the masses of all that moves with it."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from sympy import Rational, cos, sin, symbols

import qddot
from qddot.codegen import lagrange
from qddot.codegen.equations.notation import describe
from qddot.codegen.equations.terminal import text
from qddot.codegen.lagrange import derive
from qddot.model import Coordinate, Impact, Input, ModelError, Parameter, System
from qddot.model.pendulum import system as pendulum

HALF = Rational(1, 2)
x, y, z, phi, xdot, ydot, zdot, phidot = symbols("x y z phi xdot ydot zdot phidot")
m, M, g, e, L, a, w = symbols("m M g e L a w")
TIGHT = {"rtol": 1e-10, "atol": 1e-12}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("kernels")


def hitting(**changes):
    """A pendulum on a cart; its bob hits a wall, and the cart a buffer that moves."""
    given = {
        "name": "hitting", "title": "A pendulum on a cart between a wall and a buffer",
        "coordinates": [Coordinate(x, "m", "cart"), Coordinate(phi, "rad", "pendulum")],
        "parameters": [
            Parameter(m, 1.0, "kg", "bob"), Parameter(M, 3.0, "kg", "cart"), Parameter(L, 0.5, "m", "length"),
            Parameter(g, 9.81, "m/s^2", "gravity"), Parameter(e, 0.7, "1", "restitution"),
            Parameter(a, 0.4, "m", "wall"),
        ],
        "inputs": [Input(w, "m", "place of the buffer")],
        "kinetic_energy": HALF * M * xdot**2
        + HALF * m * ((xdot + L * cos(phi) * phidot) ** 2 + (L * sin(phi) * phidot) ** 2),
        "potential_energy": -m * g * L * cos(phi),
        "events": [
            Impact(a - x - L * sin(phi), "wall", "the bob at the wall", restitution=e),
            Impact(x - w, "buffer", "the cart at its buffer", restitution=HALF),
        ],
    }  # fmt: skip
    return System(**given | changes)


@pytest.fixture(scope="module")
def cart(folder):
    return qddot.load(qddot.generate(hitting(), folder))


def before_and_behind(run, name):
    """States before and behind the first event of this name."""
    log = run.events
    k = int(np.flatnonzero(log.event == log.names.index(name))[0])
    return log.t[k], log.states[k], np.array([float(run.at(log.t[k])[each]) for each in ("x", "phi", "xdot", "phidot")])


@pytest.mark.parametrize(("method", "options"), [("dop853", TIGHT), ("rk4", {"step": 1e-3}), ("taylor", TIGHT)])
def test_the_impulse_goes_through_the_masses(cart, method, options):
    """M (v' - v) is along d gap/dq, and the gap parts at e times the rate at which it closed."""
    run = qddot.simulate(cart, (0, 0.6), method=method, initial=[0, -0.9, 0.4, 0], inputs={"w": -1.0}, **options)
    _, before, behind = before_and_behind(run, "wall")
    M_at = cart.matrix("mass")(0.0, before, np.zeros(1), cart.constants(cart.parameter_values()))
    n = np.array([-1.0, -0.5 * np.cos(before[1])])
    kick = M_at @ (behind[2:] - before[2:])
    assert np.cross([*kick, 0], [*n, 0])[2] == pytest.approx(0, abs=1e-9)
    assert n @ behind[2:] == pytest.approx(-0.7 * (n @ before[2:]), rel=1e-9)
    assert n @ before[2:] < 0
    np.testing.assert_allclose(behind[:2], before[:2], atol=1e-9)


def test_what_moves_by_itself_is_hit_with_its_speed(cart):
    """A buffer that comes at 2 m/s meets a cart at rest: the bob hangs, so its inertia along x is that of both."""
    push = qddot.signal.table([0.0, 1.0], [-0.2, 1.8])
    run = qddot.simulate(cart, (0, 0.12), method="dop853", initial=np.zeros(4), inputs={"w": push}, **TIGHT)
    t, before, behind = before_and_behind(run, "buffer")
    assert t == pytest.approx(0.1, abs=1e-10)
    assert not before.any()
    assert behind[2] == pytest.approx(2 + HALF * 2)
    # M^-1 n': the bob stays where it is, the cart takes it all
    assert behind[2] + 0.5 * behind[3] == pytest.approx(0, abs=1e-9)


def test_an_elastic_run_keeps_its_energy(cart):
    run = qddot.simulate(
        cart, (0, 3), method="dop853", initial=[0, -0.9, 0.4, 0], inputs={"w": -5.0}, parameters={"e": 1.0}, **TIGHT
    )
    assert len(run.events.times("wall"))
    place, angle, v, rate = run.states.T
    energy = 1.5 * v**2 + 0.5 * (v**2 + v * rate * np.cos(angle) + 0.25 * rate**2) - 9.81 * 0.5 * np.cos(angle)
    np.testing.assert_allclose(energy, energy[0], rtol=1e-7)
    assert (0.4 - place - 0.5 * np.sin(angle)).min() > -1e-9


def test_balls_in_a_row_hand_on_their_speed(folder):
    """Equal masses at rest and touching, hit from the left: one after the other, at one instant."""
    made = System(
        "cradle", "Three balls", [Coordinate(s, "m", f"ball {s}") for s in (x, y, z)],
        [Parameter(m, 2.0, "kg", "mass")], HALF * m * (xdot**2 + ydot**2 + zdot**2),
        events=[Impact(y - x - 1, "first", "the first meets the second"),
                Impact(z - y - 1, "second", "the second meets the third")],
    )  # fmt: skip
    model = qddot.load(qddot.generate(made, folder))
    run = qddot.simulate(model, (0, 1), method="dop853", initial=[-1, 1, 2, 2, 0, 0], **TIGHT)
    np.testing.assert_allclose(run.states[-1], [0, 1, 3, 0, 0, 2], atol=1e-9)
    assert run.events.times("first") == pytest.approx([0.5])
    assert run.events.times("second") == pytest.approx([0.5])


def test_a_ball_bounces_at_its_times(folder):
    made = System(
        "bounce", "A ball", [Coordinate(y, "m", "height")],
        [Parameter(m, 0.3, "kg", "mass"), Parameter(g, 9.81, "m/s^2", "gravity"), Parameter(e, 0.8, "1", "given back")],
        HALF * m * ydot**2, m * g * y, events=[Impact(y, "floor", "on the floor", restitution=e)],
    )  # fmt: skip
    ball = qddot.load(qddot.generate(made, folder))
    run = qddot.simulate(ball, (0, 3), method="tsit5", initial=[1.0, 0], **TIGHT)
    first = np.sqrt(2 / 9.81)
    times = first * (1 + 2 * np.cumsum([0, *0.8 ** np.arange(1, 6)]))
    np.testing.assert_allclose(run.events.times("floor")[:6], times, rtol=1e-9)
    assert run.extremes("y", after=first).greatest == pytest.approx(0.64, abs=1e-8)


def test_pages_say_what_an_impact_gives_back():
    page = text(describe(derive(hitting()), "hitting.py"), width=200)
    assert "the bob at the wall (wall): where this falls through zero, and parts again at e times its rate" in page


@pytest.fixture(scope="module")
def chains(folder):
    """A pendulum of five links whose tip hits a wall: one written out, one solved at run time."""
    gap = a - L * sum((sin(angle) for angle in symbols("theta_1:6")), Rational(0))
    wall = Impact(gap, "wall", "the tip at the wall", restitution=e)
    plain = pendulum(5)
    rows = (*plain.parameters, Parameter(a, 0.5, "m", "wall"), Parameter(e, 0.6, "1", "restitution"))
    made = replace(plain, name="striking", parameters=rows, events=(wall,))
    found = []
    for limit in (10**6, 0):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(lagrange, "_LONGEST_ELIMINATION", limit)
            patch.setattr(lagrange, "_SPARSE", 0)
            found.append(qddot.load(qddot.generate(made, folder / f"at_most_{limit}")))
    return found


def test_a_chain_solved_at_run_time_is_hit_as_one_written_out(chains):
    start = {f"theta_{k}": -0.1 for k in range(1, 6)}
    runs = [qddot.simulate(chain, (0, 3), method="dop853", initial=start, **TIGHT) for chain in chains]
    assert "decoupled" in Path(chains[1].module.__file__).read_text()
    assert "decoupled" not in Path(chains[0].module.__file__).read_text()
    count = len(runs[0].events.times("wall"))
    assert count >= 1
    np.testing.assert_allclose(runs[1].events.times("wall"), runs[0].events.times("wall"), rtol=1e-8)
    np.testing.assert_allclose(runs[1].states[-1], runs[0].states[-1], atol=1e-6)
    t = runs[0].events.times("wall")[0]
    before = runs[0].events.states[0]
    behind = np.array([float(runs[0].at(t)[name]) for name in chains[0].state_names])
    M = chains[0].matrix("mass")(t, before, np.zeros(1), chains[0].constants(chains[0].parameter_values()))
    n = -np.cos(before[:5])
    kick = np.linalg.solve(M, n)
    np.testing.assert_allclose(behind[5:], before[5:] - 1.6 * (n @ before[5:]) / (n @ kick) * kick, rtol=1e-8)


def test_a_cradle_keeps_its_momentum_and_loses_what_its_restitution_takes(folder):
    """Balls that touch, hit one after the other until none closes; e = 1 gives the last ball all of it."""
    made = System(
        "lossy", "Three balls", [Coordinate(s, "m", f"ball {s}") for s in (x, y, z)],
        [Parameter(m, 2.0, "kg", "mass"), Parameter(e, 0.5, "1", "restitution")],
        HALF * m * (xdot**2 + ydot**2 + zdot**2),
        events=[Impact(y - x - 1, "first", "the first meets the second", restitution=e),
                Impact(z - y - 1, "second", "the second meets the third", restitution=e)],
    )  # fmt: skip
    model = qddot.load(qddot.generate(made, folder))
    for restitution in (1.0, 0.5):
        v, pair = np.array([2.0, 0.0, 0.0]), [0, 1]
        while pair:
            k = pair.pop(0)
            mean, apart = (v[k] + v[k + 1]) / 2, restitution * (v[k] - v[k + 1]) / 2
            v[k], v[k + 1] = mean - apart, mean + apart
            pair += [j for j in (0, 1) if j not in (k, *pair) and v[j] > v[j + 1] + 1e-9]
        run = qddot.simulate(
            model, (0, 1), method="dop853", initial=[-1, 1, 2, 2, 0, 0], parameters={"e": restitution}, **TIGHT
        )
        np.testing.assert_allclose(run.states[-1, 3:], v, atol=1e-8)
        assert run.states[-1, 3:].sum() == pytest.approx(2.0, rel=1e-9)
        if restitution == 1.0:
            assert (run.states[-1, 3:] ** 2).sum() == pytest.approx(4.0, rel=1e-9)


BAD = [
    ([Impact(a - xdot, "wall", "at the wall")], "impact wall: its gap is a - xdot, expected a distance made of"),
    ([Impact(a - x, "wall", "at the wall", then={xdot: 0})], "impact wall has then, which follows"),
    ([Impact(a - x, "wall", "at the wall", restitution=1.5)], "impact wall has the restitution 1.5, expected a number"),
    ([Impact(a - x, "wall", "at the wall", restitution=True)], "impact wall"),
    ([Impact(a - x, "wall", "at the wall", direction=1)], "impact wall has the direction 1, but a gap closes, -1"),
]  # fmt: skip


@pytest.mark.parametrize(("events", "message"), BAD)
def test_impacts_that_are_none_are_told(events, message):
    with pytest.raises(ModelError, match=message):
        hitting(events=events)
