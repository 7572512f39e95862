"""Generated right-hand sides against equations of motion written by hand: the same values for hardly more work."""

from random import Random

import counted
import pytest
from models import CONSTRAINED, shipped_once

from qddot.codegen.lagrange import derive
from qddot.codegen.lower import lower
from qddot.codegen.sources import shipped_names

#: Operations of the equations in `counted`, as they count themselves.
BY_HAND = {
    "cart_pole": 21,
    "chain": 69,
    "double_pendulum": 30,
    "half_car": 32,
    "m113": 73,
    "one_axle": 2,
    "pendulum": 85,
    "quarter_car": 10,
    "recoil_damper": 43,
}
#: How much more a generated right-hand side may do: a share of the work by hand, and one operation.
ALLOWANCE = 0.15


@pytest.fixture(scope="module")
def programs():
    return {name: lower(derive(shipped_once(name))) for name in BY_HAND}


def test_every_shipped_model_has_been_written_by_hand():
    assert {*BY_HAND, *CONSTRAINED} == set(shipped_names())


@pytest.mark.parametrize("name", BY_HAND)
def test_a_right_hand_side_does_what_a_person_would_write(programs, name):
    program, chance, tally = programs[name], Random(name), [0]
    system = program.equations.system
    state = {str(symbol): chance.uniform(-1, 1) for c in system.coordinates for symbol in (c.symbol, c.rate)}
    state |= {str(z.symbol): chance.uniform(-1, 1) for z in system.states}
    modes = program.equations.modes
    free = dict.fromkeys(map(str, modes.functions), 0.0)
    inputs = {str(channel): chance.uniform(-1, 1) for channel in program.channels} | free
    parameters = {str(p.symbol): (float(p.default) or 1.0) * chance.uniform(0.5, 2) for p in system.parameters}
    q, v = (
        [counted.Counted(state[str(s)], tally) for s in of]
        for of in zip(*((c.symbol, c.rate) for c in system.coordinates), strict=True)
    )
    u = {name: counted.Counted(value, tally) for name, value in inputs.items()}
    z = ([counted.Counted(state[str(each.symbol)], tally) for each in system.states],) if system.states else ()
    by_hand = [part.value for part in getattr(counted, name)(q, v, u, parameters, *z)]

    constants = program.kernels["constants"].evaluate(parameters)
    named = {str(symbol): constants[f"constants[{k}]"] for k, symbol in enumerate(program.constants)}
    found = program.kernels["rhs"].evaluate(state | inputs | named)
    n = len(system.coordinates)
    assert [found[f"derivative[{n + k}]"] for k in range(len(by_hand))] == pytest.approx(by_hand, rel=1e-9, abs=1e-12)

    assert tally[0] == BY_HAND[name]
    additions = len(modes.written)  # of a mode, in each condition
    assert program.kernels["rhs"].operations <= BY_HAND[name] * (1 + ALLOWANCE) + 1 + additions


def test_coriolis_terms_that_cancel_are_in_no_kernel_of_the_pole(programs):
    """With them they were 38, 96 and 6 operations."""
    kernels = programs["cart_pole"].kernels
    assert kernels["rhs"].operations <= 24
    assert kernels["jacobian"].operations <= 50
    assert kernels["mass"].operations <= 5
