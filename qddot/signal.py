"""Signals: what an input is over time, or a road over distance.

    constant, sine                      a number; mean + amplitude*sin(2π frequency t + phase)
    table, table_from_csv               samples, read as straight lines or cubics
    sampled                             a Python function, to a stated tolerance
    smoothed                            the mean of a signal over a window, for motions that must not jerk
    pulse_train, measured_pulse_train   one pulse, or several equal ones, of a standard shape or a measured one
    shot_times, recoil_impulse          when a burst fires; the impulse of a shot from masses and velocities

Each gives a `qddot.Signal` unless it says otherwise: call it for values, `.derivative(t)` for rates, `.shifted(rate,
offset)` to read it elsewhere.
"""

from qddot.runner.inputs.csv_table import table_from_csv
from qddot.runner.inputs.recoil import measured_pulse_train, recoil_impulse, shot_times
from qddot.runner.inputs.sampled import sampled
from qddot.runner.inputs.shapes import constant, pulse_train, sine
from qddot.runner.inputs.smoothing import smoothed
from qddot.runner.inputs.tables import table

__all__ = [
    "constant",
    "measured_pulse_train",
    "pulse_train",
    "recoil_impulse",
    "sampled",
    "shot_times",
    "sine",
    "smoothed",
    "table",
    "table_from_csv",
]
