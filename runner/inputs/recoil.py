"""A gun's recoil: what one shot gives, when the shots fall, and a measured force curve as the pulse."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from qddot.runner.checks import finite, row, shown, whole
from qddot.runner.inputs.pulses import Pulse, start_times, train
from qddot.runner.inputs.signal import START, Signal
from qddot.runner.inputs.tables import table_at

#: Mean velocity of the powder gases that leave the muzzle, as a multiple of the muzzle velocity: SAAMI, Gun Recoil
#: Formulae (2018), for high-powered rifles fired from the shoulder. It says nothing of cannon: a cannon's own factor
#: has to be given, or its charge left out, as for the paper's 30 mm gun (studies/library/guns.toml).
GAS_VELOCITY_FACTOR = 1.75

#: Most shots of a schedule.
MOST_SHOTS = 100_000

Vector = NDArray[np.float64]


def recoil_impulse(
    shell_mass: float,
    muzzle_velocity: float,
    charge_mass: float = 0.0,
    gas_velocity_factor: float = GAS_VELOCITY_FACTOR,
) -> float:
    """Impulse of one shot, N s: shell mass (kg) * muzzle velocity (m/s) + charge mass (kg) * factor * muzzle velocity.

    Without a charge mass it is the shell's momentum alone, which is too small by the gases' share. The factor's default
    is that of shoulder rifles (SAAMI); of a cannon, give its own.
    Raises ValueError naming the number that is not positive.
    """
    given = {"shell_mass": shell_mass, "muzzle_velocity": muzzle_velocity, "gas_velocity_factor": gas_velocity_factor}
    for name, value in given.items():
        if finite(name, value) <= 0:
            raise ValueError(f"{name} is {value}, expected a number greater than 0")
    if finite("charge_mass", charge_mass) < 0:
        raise ValueError(f"charge_mass is {charge_mass}, expected 0 or more")
    return (shell_mass + gas_velocity_factor * charge_mass) * muzzle_velocity


def shot_times(
    count: int, interval: float | None = None, *, rate_of_fire: float | None = None, start: float = 0.0
) -> Vector:
    """Times (count,) of equally spaced shots from `start` (s): interval in s, or rate_of_fire in rounds per minute.

    Raises ValueError naming the argument.
    """
    if whole("count", count) > MOST_SHOTS:
        raise ValueError(f"count is {shown(count)}, expected at most {MOST_SHOTS} shots")
    if interval is not None and rate_of_fire is not None:
        raise ValueError("give interval or rate_of_fire, not both")
    if interval is None and rate_of_fire is None:
        if count > 1:
            raise ValueError(f"{count} shots need an interval or a rate_of_fire")
        return np.array([finite("start", start)])
    name, value = ("interval", interval) if interval is not None else ("rate_of_fire", rate_of_fire)
    if finite(name, value) <= 0:
        raise ValueError(f"{name} is {value}, expected a number greater than 0")
    spacing = interval if interval is not None else 60.0 / finite(name, value)
    return np.asarray(finite("start", start) + finite("interval", spacing) * np.arange(count))


def measured_pulse_train(
    t: ArrayLike,
    values: ArrayLike,
    *,
    times: ArrayLike,
    kind: str = "linear",
    peak: float | None = None,
    duration: float | None = None,
    impulse: float | None = None,
) -> Signal:
    """A measured curve, samples (t, values) (n,), that starts anew at each of `times`; zero between, sums in overlaps.

    The curve starts with its first sample and ends with its last: a value there that is not 0 is a jump. kind: lines
    ("linear") or a spline ("cubic") between the samples. peak (the value of largest size), duration (s), impulse (the
    integral): at most two; the curve's values and time are stretched to have them, and stay as measured without.
    Raises ValueError naming the argument or the sample.
    """
    samples = row("t", t), row("values", values)
    curve = table_at(*samples, kind, None, lambda i: f"sample {i}")
    pieces = curve.pieces[1:-1].copy()
    begin, end = samples[0][0], samples[0][-1]
    pieces[:, START] -= begin
    inner = curve.breakpoints[(curve.breakpoints > begin) & (curve.breakpoints < end)]
    pulse = Pulse(pieces, np.concatenate([[0.0], inner - begin, [end - begin]]), end - begin)
    highest = samples[1][np.argmax(np.abs(samples[1]))]
    return train(_stretched(pulse, highest, peak, duration, impulse), start_times(times))


def _stretched(
    pulse: Pulse, highest: float, peak: float | None, duration: float | None, impulse: float | None
) -> Pulse:
    if peak is not None and duration is not None and impulse is not None:
        raise ValueError("a measured pulse takes two of peak, duration and impulse; given: all three")
    if duration is not None and finite("duration", duration) <= 0:
        raise ValueError(f"duration is {duration}, expected a time greater than 0")
    area = pulse.area()
    if (peak is not None and highest == 0) or (impulse is not None and area == 0):
        raise ValueError("the measured curve is 0 in peak or integral, so it cannot be scaled to one")
    longer = duration / pulse.duration if duration is not None else 1.0
    if peak is not None and impulse is not None:
        longer = finite("impulse", impulse) / area * highest / _nonzero("peak", peak)
        if longer <= 0:
            raise ValueError(f"peak {peak} and impulse {impulse} do not go with the signs of the measured curve")
    if peak is not None:
        return pulse.stretched(finite("peak", peak) / highest, longer)
    return pulse.stretched(finite("impulse", impulse) / area / longer if impulse is not None else 1.0, longer)


def _nonzero(what: str, value: float) -> float:
    if finite(what, value) == 0:
        raise ValueError(f"{what} is 0, expected another number")
    return value
