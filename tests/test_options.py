import numpy as np
import pytest

from qddot.runner.options import Options


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"step": 0}, "step is 0, expected a number greater than 0"),
        ({"step": "1e-3"}, "step is '1e-3', expected a number"),
        ({"step": float("nan")}, "step is nan, expected a finite number"),
        ({"step": -1e-3}, "step is -0.001, expected a number greater than 0"),
        ({"step": float("inf")}, "step is inf, expected a finite number"),
        ({"every": 0}, "every is 0, expected a whole number, at least 1"),
        ({"every": 2.5}, "every is 2.5, expected a whole number"),
        ({"max_steps": True}, "max_steps is True, expected a whole number"),
        ({"rtol": 0}, "rtol is 0, expected a number between 0 and 1"),
        ({"atol": [1e-3, -1]}, "atol is .*, expected a number >= 0"),
        ({"time_limit": -1}, "time_limit is -1"),
        ({"max_order": 6}, "max_order is 6, expected an order from 1 to 5"),
        ({"output_times": [0, 2, 1]}, r"output_times must rise: \[2\] = 1.0 follows \[1\] = 2.0"),
        ({"output_times": [0, 1, 1]}, r"output_times must rise: \[2\] = 1.0 follows \[1\] = 1.0"),
        ({"output_times": [0, np.nan]}, r"output_times\[1\] is not finite"),
        ({"output_times": []}, "output_times has shape"),
        ({"output_times": [1], "every": 3}, "output_times and every are both given"),
        ({"output_times": [1], "refine": 3}, "output_times and refine are both given"),
    ],
)
def test_wrong_option_is_named(given, message):
    with pytest.raises(ValueError, match=message):
        Options(**given)


def test_arrays_are_copied_and_cannot_be_changed():
    times = np.array([0.0, 1.0])
    options = Options(output_times=times, atol=[1e-6, 1e-3])
    times[1] = -1.0
    assert options.output_times[1] == 1.0
    with pytest.raises(ValueError, match="read-only"):
        options.atol[0] = 1.0
