"""Metrics of the samples themselves: extremes, means, levels.

A metric is a function here or in `weighting`, with its name and unit above it, and stands nowhere else. Every one has
the same arguments: samples (n,) at t0 + i*h; the window first <= i < stop, two samples or more;
p, the metric's own numbers. Extremes are refined by the parabola through the greatest sample and its neighbours: the
error falls from second to fourth order in h where the quantity is smooth. Integrals are those of the line through the
samples (trapezoidal rule), and so are the times at which a level is crossed.
"""

from dataclasses import replace

import numpy as np

from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.memory import LEAN
from qddot.runner.metrics.kind import metric

#: A peak is refined where the second differences beside it are at least this part of its own: a kink is no peak.
SMOOTH = 0.25


@compiled(**LEAN)
def peak(samples, first, stop, sign):
    """Place (in samples) and value of the greatest of sign*samples, refined by a parabola where they are smooth."""
    k = first
    for i in range(first + 1, stop):
        if sign * samples[i] > sign * samples[k]:
            k = i
    if k < first + 2 or k > stop - 3:
        return float(k), samples[k]
    bend = samples[k - 1] - 2.0 * samples[k] + samples[k + 1]
    before = samples[k - 2] - 2.0 * samples[k - 1] + samples[k]
    after = samples[k] - 2.0 * samples[k + 1] + samples[k + 2]
    if bend == 0.0 or before / bend < SMOOTH or after / bend < SMOOTH:
        return float(k), samples[k]
    slope = samples[k + 1] - samples[k - 1]
    shift = -0.5 * slope / bend
    return k + shift, samples[k] + 0.25 * slope * shift


@metric("max")
def maximum(samples, first, stop, t0, h, p):
    """Greatest value."""
    return peak(samples, first, stop, 1.0)[1]


@metric("min")
def minimum(samples, first, stop, t0, h, p):
    """Least value."""
    return peak(samples, first, stop, -1.0)[1]


@metric("max_abs")
def largest_magnitude(samples, first, stop, t0, h, p):
    """Greatest absolute value."""
    return max(abs(peak(samples, first, stop, 1.0)[1]), abs(peak(samples, first, stop, -1.0)[1]))


@metric("peak_to_peak")
def peak_to_peak(samples, first, stop, t0, h, p):
    """Greatest minus least value."""
    return peak(samples, first, stop, 1.0)[1] - peak(samples, first, stop, -1.0)[1]


@metric("time_of_max", "s")
def time_of_maximum(samples, first, stop, t0, h, p):
    """Time of the greatest value, the first where there are several, s."""
    return t0 + h * peak(samples, first, stop, 1.0)[0]


@metric("time_of_min", "s")
def time_of_minimum(samples, first, stop, t0, h, p):
    """Time of the least value, the first where there are several, s."""
    return t0 + h * peak(samples, first, stop, -1.0)[0]


@metric("start")
def start(samples, first, stop, t0, h, p):
    """Value at the start of the window."""
    return samples[first]


@metric("final")
def final(samples, first, stop, t0, h, p):
    """Value at the end of the window."""
    return samples[stop - 1]


@metric("integral", "{} s")
def integral(samples, first, stop, t0, h, p):
    """Integral over time."""
    total = 0.5 * (samples[first] + samples[stop - 1])
    for i in range(first + 1, stop - 1):
        total += samples[i]
    return h * total


energy_dissipated = replace(integral, name="energy_dissipated", unit="J", of="dissipated_power")


@metric("mean")
def mean(samples, first, stop, t0, h, p):
    """Mean over time."""
    total = 0.5 * (samples[first] + samples[stop - 1])
    for i in range(first + 1, stop - 1):
        total += samples[i]
    return total / (stop - 1 - first)


@metric("rms")
def root_mean_square(samples, first, stop, t0, h, p):
    """Root of the mean square over time."""
    total = 0.5 * (samples[first] ** 2 + samples[stop - 1] ** 2)
    for i in range(first + 1, stop - 1):
        total += samples[i] ** 2
    return np.sqrt(total / (stop - 1 - first))


@metric("settling_time", "s", takes=("band",), required=("band",))
def settling_time(samples, first, stop, t0, h, p):
    """Time from the start of the window after which the value stays within p[0] of its final one."""
    band, end = p[0], samples[stop - 1]
    for i in range(stop - 2, first - 1, -1):
        outside = abs(samples[i] - end)
        if outside > band:
            inside = abs(samples[i + 1] - end)
            return h * (i - first + (outside - band) / (outside - inside))
    return 0.0


@metric("crossings", "", takes=("level",), required=("level",))
def crossings(samples, first, stop, t0, h, p):
    """How often the level p[0] is crossed, in both directions; a touch is none."""
    count, before = 0, 0.0
    for i in range(first, stop):
        side = np.sign(samples[i] - p[0])
        if side != 0.0:
            count += side * before < 0.0
            before = side
    return float(count)


@compiled(**LEAN)
def below(samples, first, stop, h, level):
    """Time for which the line through the samples is below a level; on the level is not below."""
    total = 0.0
    for i in range(first, stop - 1):
        a, b = level - samples[i], level - samples[i + 1]
        if a >= 0.0 and b >= 0.0:
            total += a + b > 0.0
        elif a > 0.0 or b > 0.0:
            total += max(a, b) / (abs(a) + abs(b))
    return h * total


@metric("time_below", "s", takes=("level",), required=("level",))
def time_below(samples, first, stop, t0, h, p):
    """Time spent below the level p[0], s."""
    return below(samples, first, stop, h, p[0])


@metric("time_above", "s", takes=("level",), required=("level",))
def time_above(samples, first, stop, t0, h, p):
    """Time spent above the level p[0], s."""
    return below(-samples, first, stop, h, -p[0])


@metric("dynamic_load", takes=("static",))
def dynamic_load(samples, first, stop, t0, h, p):
    """Greatest deviation of a wheel's load from its static value p[0]."""
    return max(peak(samples, first, stop, 1.0)[1] - p[0], p[0] - peak(samples, first, stop, -1.0)[1])


@metric("dynamic_load_coefficient", "", takes=("static",))
def dynamic_load_coefficient(samples, first, stop, t0, h, p):
    """Root mean square of the deviation of a wheel's load from its static value p[0], relative to that."""
    total = 0.5 * ((samples[first] - p[0]) ** 2 + (samples[stop - 1] - p[0]) ** 2)
    for i in range(first + 1, stop - 1):
        total += (samples[i] - p[0]) ** 2
    return np.sqrt(total / (stop - 1 - first)) / p[0]


@metric("lift_off_time", "s", takes=("static", "fraction"))
def lift_off_time(samples, first, stop, t0, h, p):
    """Time for which a wheel's load is below the part p[1] of its static value p[0], s."""
    return below(samples, first, stop, h, p[1] * p[0])
