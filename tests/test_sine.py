"""The sine of the inputs, beside mpmath."""

import mpmath
import numpy as np
from hypothesis import example, given, settings
from hypothesis import strategies as st

from qddot.runner.inputs.sine import FAR
from qddot.runner.inputs.sine import sine as compiled_sine
from qddot.runner.machine.compiled import compiled


@compiled()
def sine(angle):
    return compiled_sine(angle)  # which has no entry for Python


angles = st.floats(-FAR, FAR) | st.integers(-600_000, 600_000).map(lambda k: k * np.pi / 2)


@settings(deadline=None, max_examples=1000)  # the first call compiles
@given(angle=angles)
@example(angle=0.0)
@example(angle=5e-324)
@example(angle=FAR)
@example(angle=-FAR)
def test_sine_is_within_two_units_in_the_last_place(angle):
    with mpmath.workprec(1200):
        exact = mpmath.sin(mpmath.mpf(angle))
        assert abs(mpmath.mpf(sine(angle)) - exact) <= 2.5 * np.spacing(abs(float(exact)))
