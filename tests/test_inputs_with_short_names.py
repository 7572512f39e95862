"""An input may have the name by which tables of generated modules call the state."""

import numpy as np
import pytest
from sympy import Abs, symbols

import qddot
from qddot.model import Coordinate, Input, Parameter, System

x, xdot, y, ydot, m, c = symbols("x xdot y ydot m c")


@pytest.mark.parametrize("held", [False, True])
def test_an_input_called_x_is_an_input(held, tmp_path):
    """Beside conditions in the state, whose modes the tables say to be of x, and without them."""
    drag = c * Abs(ydot) * ydot if held else c * ydot
    made = System(
        f"pushed_{held}".lower(), "A pushed mass", [Coordinate(y, "m", "place")],
        [Parameter(m, 1.0, "kg", "mass"), Parameter(c, 2.0, "N s/m", "drag")], m * ydot**2 / 2,
        generalized_forces={y: x + 0 * xdot - drag}, inputs=[Input(x, "N", "push")],
    )  # fmt: skip
    model = qddot.load(qddot.generate(made, tmp_path))
    assert model.tables.free_inputs == ("x",)
    assert len(model.tables.modes) == held
    run = qddot.simulate(model, (0, 40), method="dop853", initial=[0, 0], inputs={"x": 8.0}, rtol=1e-9, atol=1e-12)
    assert run["ydot"][-1] == pytest.approx(np.sqrt(4.0) if held else 4.0, rel=1e-8)
    np.testing.assert_array_equal(run["x"], 8.0)
