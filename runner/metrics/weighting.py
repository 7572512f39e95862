"""Frequency weightings of ISO 2631-1:1997 (Annex A, table A.1) as digital filters, and what is computed with them.

A weighting is a product of sections of second order: high pass, low pass, acceleration-velocity transition and upward
step (equations A.1 to A.4). Each becomes digital by the bilinear transformation, prewarped at its own corner, and the
remaining error of the gain over the weighting's range of frequencies is known: `error`.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from qddot.runner.machine.compiled import compiled
from qddot.runner.metrics.kind import metric

#: The largest error of the gain, relative, that is let pass; ISO 8041 tolerates 12 % in instruments.
TOLERANCE = 0.05


@dataclass(frozen=True)
class Weighting:
    """Corner frequencies in Hz and quality factors; infinite ones leave their factor out.

    low, high: the range of frequencies, Hz, for which the standard gives the weighting.
    """

    name: str
    f1: float
    f2: float
    f3: float
    f4: float
    Q4: float
    f5: float = np.inf
    Q5: float = np.inf
    f6: float = np.inf
    Q6: float = np.inf
    low: float = 0.5
    high: float = 80.0

    def sections(self) -> list[tuple[float, tuple[float, float, float], tuple[float, float, float]]]:
        """Of each section: corner (rad/s), numerator and denominator in powers of s, the constant first."""
        w1, w2, w3, w4, w5, w6 = (2 * np.pi * f for f in (self.f1, self.f2, self.f3, self.f4, self.f5, self.f6))
        found = [
            (w1, (0.0, 0.0, 1.0 / w1**2), (1.0, np.sqrt(2.0) / w1, 1.0 / w1**2)),
            (w2, (1.0, 0.0, 0.0), (1.0, np.sqrt(2.0) / w2, 1.0 / w2**2)),
            (w4, (1.0, 1.0 / w3, 0.0), (1.0, 1.0 / (self.Q4 * w4), 1.0 / w4**2)),
        ]
        if np.isfinite(w5):
            scale = (w5 / w6) ** 2
            step = (scale, scale / (self.Q5 * w5), scale / w5**2)
            found.append((w6, step, (1.0, 1.0 / (self.Q6 * w6), 1.0 / w6**2)))
        return found

    def gain(self, f: NDArray[np.float64]) -> NDArray[np.float64]:
        """Gain at frequencies f (n,), Hz, as the standard defines it."""
        s = 2j * np.pi * np.asarray(f)
        powers = np.array([np.ones_like(s), s, s**2])
        return np.abs(np.prod([(n @ powers) / (d @ powers) for _, n, d in self.sections()], axis=0))


WEIGHTINGS = {
    each.name: each
    for each in (
        Weighting("Wk", 0.4, 100.0, 12.5, 12.5, 0.63, 2.37, 0.91, 3.35, 0.91),
        Weighting("Wd", 0.4, 100.0, 2.0, 2.0, 0.63),
        Weighting("Wf", 0.08, 0.63, np.inf, 0.25, 0.86, 0.0625, 0.80, 0.1, 0.80, low=0.1, high=0.5),
    )
}


def digital(weighting: str, interval: float) -> NDArray[np.float64]:
    """Sections (n, 5) b0, b1, b2, a1, a2 of the filter of this name for samples an interval (s) apart."""
    rows = []
    for corner, (n0, n1, n2), (d0, d1, d2) in WEIGHTINGS[weighting].sections():
        K = corner / np.tan(0.5 * corner * interval)  # s = K (1 - 1/z) / (1 + 1/z), exact at the corner
        scale = d0 + d1 * K + d2 * K**2
        b = (n0 + n1 * K + n2 * K**2, 2 * (n0 - n2 * K**2), n0 - n1 * K + n2 * K**2)
        a = (2 * (d0 - d2 * K**2), d0 - d1 * K + d2 * K**2)
        rows.append([each / scale for each in (*b, *a)])
    return np.array(rows)


def digital_gain(sections: NDArray[np.float64], interval: float, f: NDArray[np.float64]) -> NDArray[np.float64]:
    """Gain at frequencies f (n,), Hz, of digital sections."""
    z = np.exp(-2j * np.pi * np.asarray(f) * interval)
    b, a = sections[:, :3], np.column_stack([np.ones(len(sections)), sections[:, 3:]])
    powers = np.array([np.ones_like(z), z, z**2])
    return np.abs(np.prod((b @ powers) / (a @ powers), axis=0))


@cache
def error(name: str, interval: float) -> float:
    """The largest relative error of the digital gain over the weighting's range."""
    weighting = WEIGHTINGS[name]
    f = np.geomspace(weighting.low, weighting.high, 200)
    if 2 * weighting.f2 * interval >= 1.0:  # the sampling does not even reach the low pass
        return np.inf
    exact = weighting.gain(f)
    return float(np.abs(digital_gain(digital(name, interval), interval, f) / exact - 1).max())


@cache
def slowest(name: str) -> float:
    """The longest interval between samples, s, two significant figures, at which the error is within TOLERANCE."""
    intervals = np.sort([m * 10.0**k for k in range(-5, 1) for m in np.arange(10, 100) / 10])
    return float(max(each for each in intervals if error(name, float(each)) <= TOLERANCE))


@compiled()
def moment(samples, first, stop, p, power):
    """Mean over the window of |weighted samples| to a power; p: sections of a digital filter, one after the other.

    The filter is at rest before the first sample; transposed direct form II.
    """
    state = np.zeros(2 * (len(p) // 5))
    total = 0.0
    for i in range(stop):
        x = samples[i]
        for k in range(len(p) // 5):
            y = p[5 * k] * x + state[2 * k]
            state[2 * k] = p[5 * k + 1] * x - p[5 * k + 3] * y + state[2 * k + 1]
            state[2 * k + 1] = p[5 * k + 2] * x - p[5 * k + 4] * y
            x = y
        if i >= first:
            total += (0.5 if i in (first, stop - 1) else 1.0) * abs(x) ** power
    return total / (stop - 1 - first)


@metric("weighted_rms", takes=("weighting",), required=("weighting",))
def weighted_rms(samples, first, stop, t0, h, p):
    """Frequency-weighted r.m.s. acceleration (ISO 2631-1:1997, equation 1)."""
    return np.sqrt(moment(samples, first, stop, p, 2))


@metric("vdv", "({}) s^0.25", takes=("weighting",), required=("weighting",))
def vibration_dose(samples, first, stop, t0, h, p):
    """Vibration dose value VDV, the fourth root of the integral of the weighted acceleration's fourth power (eq. 5)."""
    return (h * (stop - 1 - first) * moment(samples, first, stop, p, 4)) ** 0.25
