"""The benchmark bicycle, nonlinear, with ground contacts and rolling, beside what was published of it."""

import numpy as np
import pytest
from mechanisms import bicycle, energy, off

import qddot

#: J. P. Meijaard, J. M. Papadopoulos, A. Ruina, A. L. Schwab, Proc. R. Soc. A 463 (2007) 1955-1982, table 2, at 5 m/s;
#: the matrix that SymPy's own test of a bicycle has by Kane's method gives the same to the eight digits printed of it.
WEAVE = -0.77534188219585 + 4.46486771378823j
CAPSIZE, CASTER = -0.32286642900409, -14.07838969279822
#: That matrix, of lean, steer and their rates, in v: sympy/physics/mechanics/tests/test_kane3.py.
KANE = (
    (9.48977444677355, -0.891197738059089, -0.571523173729245, -0.105522449805691, -0.330515398992311),
    (11.7194768719633, -1.97171508499972, 30.9087533932407, 3.67680523332152, -3.08486552743311),
)


@pytest.fixture(scope="module")
def model(tmp_path_factory):
    return qddot.load(qddot.generate(bicycle(), tmp_path_factory.mktemp("kernels")))


def riding(model, speed, **moving):
    """Upright and straight ahead."""
    upright = dict.fromkeys(("x", "y", "psi", "phi", "delta", "theta_R", "theta_F", "phidot", "deltadot"), 0.0)
    given = upright | {"thetadot_R": -speed / 0.3} | moving
    return qddot.assemble(model, given, guess={"z": -0.3, "xdot": speed})


@pytest.mark.slow
def test_its_eigenvalues_are_those_published(model):
    found = [mode.eigenvalue for mode in qddot.modes(model, state=riding(model, 5.0))]
    for published in (WEAVE, CAPSIZE, CASTER):
        assert min(abs(each - published) for each in found) < 1e-9, published
    assert sum(abs(each) < 1e-5 for each in found) == 6  # where it is, how it is turned, how fast it goes


@pytest.mark.slow
@pytest.mark.parametrize("speed", [0.5, 8.0])
def test_its_eigenvalues_are_those_of_kanes_method(model, speed):
    rows = [(a, b * speed**2 + c, d * speed, e * speed) for a, b, c, d, e in KANE]
    expected = np.linalg.eigvals([[0, 0, 1, 0], [0, 0, 0, 1], *rows])
    found = [mode.eigenvalue for mode in qddot.modes(model, state=riding(model, speed))]
    for each in expected[expected.imag >= 0]:
        assert min(abs(each - other) for other in found) < 1e-9 * max(1.0, abs(each)), each


@pytest.mark.slow
def test_pushed_aside_it_rights_itself_without_losing_energy(model):
    """At 4.6 m/s, where it is stable, as in the paper's figure 4; what it does is conservative all the same."""
    start = riding(model, 4.6, phidot=0.5)
    times = np.linspace(0, 5, 101)
    found = qddot.simulate(model, (0, 5), initial=start, method="dop853", rtol=1e-10, atol=1e-11, output_times=times)
    held = energy(model, found)
    assert off(model, found).max() < 1e-11
    assert abs(found["phi"][-1]) < 0.3 * np.abs(found["phi"]).max()
    assert np.ptp(held) < 1e-9 * held[0]
