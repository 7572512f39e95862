"""Long kernels, compiled as a table of what repeats, beside the same text written out, and beside mechanics."""

import numpy as np
import pytest
from numba import njit

import qddot
from benchmarks.cases import carrier
from qddot.runner import abi
from qddot.runner.machine import straight_code
from qddot.runner.machine.compiled import ARITHMETIC
from qddot.runner.machine.inner import OUTER
from qddot.runner.machine.straight import straight

STEP = 1e-6


@pytest.fixture(scope="module")
def model(tmp_path_factory):
    """A carrier on two wheels, each kernel of it compiled as a table."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(straight_code, "WHOLE", 0)
        patch.setattr(straight_code, "SHORT", 20)
        made = qddot.load(qddot.generate(carrier.system(2), tmp_path_factory.mktemp("carrier")))
        for kernel in ("rhs", "jacobian", "energy"):
            made.kernel(kernel)
        yield made


@pytest.fixture(scope="module")
def states(model):
    """Any attitude, and speeds of some m/s and rad/s."""
    return np.random.default_rng(20261127).normal(size=(4, len(model.state_names)))


def value(model, kernel, x, count, **given):
    """What a kernel writes."""
    found = np.full(count, np.nan)
    model.kernel(kernel)(0.0, x, np.zeros(1), model.constants(model.parameter_values(given)), found)
    return found


@pytest.mark.parametrize("kernel", ["rhs", "jacobian"])
def test_a_table_gives_what_the_text_written_out_gives(model, states, kernel):
    whole = njit(pipeline_class=OUTER, **ARITHMETIC)(straight(getattr(model.module, kernel).py_func, whole=True))
    whole.compile(abi.VECTOR_KERNEL)
    count = len(states[0]) if kernel == "rhs" else model.tables.patterns[kernel].entries
    for x in states:
        expected = np.full(count, np.nan)
        whole(0.0, x, np.zeros(1), model.constants(model.parameter_values()), expected)
        found = value(model, kernel, x, count)
        assert found == pytest.approx(expected, rel=1e-9, abs=1e-11 * np.abs(expected).max())


def test_its_jacobian_is_that_of_differences(model, states):
    jacobian, n = model.matrix("jacobian"), len(states[0])
    c = model.constants(model.parameter_values())
    for x in states:
        steps = STEP * np.eye(n)
        columns = [(value(model, "rhs", x + h, n) - value(model, "rhs", x - h, n)) / (2 * STEP) for h in steps]
        expected = np.array(columns).T
        assert jacobian(0.0, x, np.zeros(1), c) == pytest.approx(expected, rel=1e-5, abs=1e-8 * np.abs(expected).max())


def test_without_dampers_it_keeps_its_energy(model, states):
    free = {"c": 0.0, "c_t": 0.0}
    for x in states:
        along = value(model, "rhs", x, len(x), **free)
        ahead, behind = (value(model, "energy", x + sign * STEP * along, 4, **free)[:2] for sign in (1, -1))
        power = (ahead - behind) / (2 * STEP)  # of kinetic and potential energy
        assert abs(power.sum()) < 1e-6 * np.abs(power).max()
