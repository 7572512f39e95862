"""From the words of a study to the signals of a model: pure functions of the study that was read and of the model."""

from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from qddot.runner.checks import unknown
from qddot.runner.inputs.csv_table import samples_from_csv
from qddot.runner.inputs.formulas import units_of
from qddot.runner.inputs.recoil import measured_pulse_train, recoil_impulse, shot_times
from qddot.runner.inputs.shapes import pulse_train
from qddot.runner.inputs.signal import Signal
from qddot.runner.inputs.smoothing import smoothed
from qddot.runner.inputs.tables import table, table_at
from qddot.runner.load import Model
from qddot.runner.study.amounts import Amounts
from qddot.runner.study.input_kinds import FORMULAS
from qddot.runner.study.memory import Memory
from qddot.runner.study.road import profile_of, road_profile, road_signals
from qddot.runner.study.schema import StudyTable
from qddot.runner.study.units import magnitude


def study_signals(
    study: StudyTable, model: Model, p: NDArray[np.float64], path: Path, memory: Memory | None = None
) -> dict[str, Signal]:
    """Signals by input name of all that the study drives a model with parameters p by; in the inputs' own units.

    path: the study's file, for messages and for the files it names. Under a constant speed the signals of a road share
    one array of pieces. memory: holds signals of studies of which this is a change. Raises StudyError naming file, line
    and key.
    """
    amounts, memory = Amounts(path), memory or Memory()
    signals = {
        name: memory((name, spec), partial(input_signal, name, spec, model, amounts))
        for name, spec in study.inputs.items()
    }
    if study.road is None:
        return signals
    span = (amounts("span", study.span[0], "s"), amounts("span", study.span[1], "s"))
    profile = memory(("road", profile_of(study.road)), lambda: road_profile(study.road, amounts))
    roads = road_signals(study.road, model, p, span, amounts, profile)
    for name in signals:
        if name in roads:
            raise amounts.wrong(f"inputs.{name}", f"{name} already reads the road; leave out one of the two")
    return signals | roads


def input_signal(name: str, spec: Any, model: Model, amounts: Amounts) -> Signal:
    """The signal of one input, from its table of the study."""
    free = model.tables.free_inputs
    units = {channel.name: channel.unit for channel in model.tables.inputs if channel.name in free}
    key = f"inputs.{name}"
    if name not in units:
        raise amounts.wrong(key, unknown("input", name, units))
    with amounts.at(key):
        if spec.kind in FORMULAS:
            formula = FORMULAS[spec.kind]
            return formula(**amounts.given(key, spec, units_of(formula, units[name])))
        return _BUILD[spec.kind](key, spec, units[name], amounts)


def _pulses(key: str, spec: Any, unit: str, amounts: Amounts) -> Signal:
    times, sizes = _schedule(key, spec, amounts), _sizes(key, spec, unit, amounts)
    return pulse_train(spec.shape, times=times, rise=spec.rise, **sizes)


def _measured_pulses(key: str, spec: Any, unit: str, amounts: Amounts) -> Signal:
    t, values, place = _samples(key, spec, unit, amounts)
    table_at(t, values, "linear", None, place)  # names a bad sample by its line
    times, sizes = _schedule(key, spec, amounts), _sizes(key, spec, unit, amounts)
    return measured_pulse_train(t, values, times=times, kind=spec.interpolation, **sizes)


def _table(key: str, spec: Any, unit: str, amounts: Amounts) -> Signal:
    if spec.file is None and spec.t is not None and spec.values is not None and spec.resample is None:
        samples = table(spec.t, spec.values, spec.interpolation)
    else:
        t, values, place = _samples(key, spec, unit, amounts)
        samples = table_at(t, values, spec.interpolation, None, place)
    width = amounts.given(key, spec, {"smooth": "s"}).get("smooth")
    return samples if width is None else smoothed(samples, width)


_BUILD: Mapping[str, Callable[[str, Any, str, Amounts], Signal]] = {
    "pulse_train": _pulses,
    "measured_pulse_train": _measured_pulses,
    "table": _table,
}


def _samples(
    key: str, spec: Any, unit: str, amounts: Amounts
) -> tuple[NDArray[np.float64], NDArray[np.float64], Callable[[int], str]]:
    inline = spec.t is not None and spec.values is not None
    if inline == (spec.file is not None):
        raise amounts.wrong(key, "give either file, or t and values")
    if inline:
        if spec.resample is not None:
            raise amounts.wrong(f"{key}.resample", "only a file is resampled")
        return np.array(spec.t, dtype=np.float64), np.array(spec.values, dtype=np.float64), lambda i: f"sample {i}"
    return samples_from_csv(
        amounts.file(f"{key}.file", spec.file),
        spec.time,
        spec.value,
        spec.time_unit,
        spec.value_unit,
        unit,
        amounts.given(key, spec, {"resample": "s"}).get("resample"),
    )


def _schedule(key: str, spec: Any, amounts: Amounts) -> NDArray[np.float64]:
    """The times of the shots."""
    if (spec.times is None) == (spec.count is None):
        raise amounts.wrong(key, "give either times, or count with interval or rate_of_fire")
    if spec.times is not None:
        if spec.interval is not None or spec.rate_of_fire is not None or spec.start != 0.0:
            raise amounts.wrong(key, "times say it all; leave out start, interval and rate_of_fire")
        return np.array([amounts(f"{key}.times", t, "s") for t in spec.times])
    spacing = amounts.given(key, spec, {"interval": "s", "rate_of_fire": "1/min", "start": "s"})
    return shot_times(spec.count, **spacing)


def _sizes(key: str, spec: Any, unit: str, amounts: Amounts) -> dict[str, float]:
    """Those of peak, duration and impulse that are given, the impulse from the ammunition where that is."""
    sizes = amounts.given(key, spec, {"peak": unit, "duration": "s", "impulse": f"{unit} * s"})
    ammunition = amounts.given(key, spec, {"shell_mass": "kg", "muzzle_velocity": "m/s", "charge_mass": "kg"})
    if spec.gas_velocity_factor is not None:
        ammunition["gas_velocity_factor"] = spec.gas_velocity_factor
    if not ammunition:
        return sizes
    for needed in ("shell_mass", "muzzle_velocity"):
        if needed not in ammunition:
            raise amounts.wrong(key, f"ammunition needs shell_mass and muzzle_velocity; {needed} is missing")
    if "impulse" in sizes:
        raise amounts.wrong(f"{key}.impulse", "the ammunition gives the impulse; leave out one of the two")
    impulse = recoil_impulse(**ammunition)
    if unit == "N":
        return sizes | {"impulse": impulse}
    try:
        return sizes | {"impulse": magnitude(key, f"{impulse!r} N s", f"{unit} * s")}
    except ValueError:
        message = f"ammunition gives N s, but the input is in {unit}; give two of peak, duration and impulse"
        raise amounts.wrong(f"{key}.shell_mass", message) from None
