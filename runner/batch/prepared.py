"""A run of a batch, ready to be integrated."""

from collections.abc import Mapping
from dataclasses import dataclass

from qddot.runner.inputs.signal import Signal
from qddot.runner.simulate import Simulation


@dataclass(frozen=True, eq=False)
class Run:
    """What `prepare` made of the run's settings, and the signals by name that went into it."""

    simulation: Simulation
    signals: Mapping[str, Signal]
