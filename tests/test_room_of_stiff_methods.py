"""The memory that stiff methods work in, on models with constraints."""

import pytest

import qddot
from qddot.runner.machine.memory import address
from qddot.runner.stiff.space import space_for


@pytest.mark.parametrize("method", ["ode15s", "rodas5p"])
def test_what_a_stiff_method_works_in_is_kept_beside_what_constraints_work_in(method):
    """Both have values and places of a kernel's entries: neither must take the other's room."""
    model = qddot.load("four_bar")
    run = qddot.prepare(model, (0, 1), method=method, initial=qddot.assemble(model, {"theta_1": 0.5}))
    space, arrays = space_for(run.problem, run.options, 20)
    for name in ("values", "places"):
        assert int(space[name]) == address(arrays[name])
    assert len(arrays["values"]) == run.problem.jacobian.pattern.entries
    held = arrays["held held"][0]
    assert {int(held[name]) for name in ("values", "places", "room")} <= {address(each) for each in arrays.values()}
