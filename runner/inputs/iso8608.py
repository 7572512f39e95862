"""Random roads after ISO 8608:2016: displacement PSD Gd(n) = Gd(n0) (n / n0)^-w over the spatial frequency n.

Heights are sums of cosines of random phase, one for each multiple of 1/length (Shinozuka and Jan, J. Sound and
Vibration 25 (1972) 111): the PSD of a road is that of its class exactly, not only in the mean over many roads.
"""

import numpy as np
from numpy.typing import NDArray

from qddot.runner.checks import finite, unknown, whole
from qddot.runner.inputs.shapes import hermite
from qddot.runner.inputs.signal import C0, START, Signal

Vector = NDArray[np.float64]

#: Reference spatial frequency n0, cycles/m (ISO 8608, 4.2).
REFERENCE_FREQUENCY = 0.1
#: Gd(n0) of each class, m^3: the geometric mean; the class reaches from half to twice of it (ISO 8608, table C.2).
CLASSES = {name: 16e-6 * 4.0**k for k, name in enumerate("ABCDEFGH")}
#: Range of spatial frequencies for which the standard reports PSDs, as wavelengths in m: 1/2.83 to 1/0.011.
SHORTEST, LONGEST = 1 / 2.83, 1 / 0.011
#: Samples on the shortest wave, at least; the spline through them is then within 1 % of it.
SAMPLES_PER_WAVE = 5
#: Largest exponent; measured roads have 1.5 to 3.
MOST_WAVINESS = 10
#: Most samples of a road: 640 MB of pieces.
MOST_SAMPLES = 10_000_000


def roughness(of: str | float) -> float:
    """Gd(n0) in m^3 of a class "A" to "H", or the number itself; raises ValueError for another."""
    if isinstance(of, str):
        if of not in CLASSES:
            raise ValueError(unknown("road class", of, CLASSES))
        return CLASSES[of]
    if finite("roughness", of) <= 0:
        raise ValueError(f"roughness is {of}, expected Gd(n0) in m^3, greater than 0")
    return float(of)


def random_road(
    of: str | float,
    *,
    seed: int,
    length: float = 200.0,
    waviness: float = 2.0,
    shortest: float = SHORTEST,
    longest: float = LONGEST,
    fade: float = 0.0,
) -> Signal:
    """A random road of a class "A" to "H" or of Gd(n0) in m^3: heights in m over the distance 0 to `length` in m.

    waviness: the exponent w. shortest, longest: the waves that it has, m; there are none longer than `length`. fade:
    over this distance the road grows from level ground at its begin, so that a vehicle drives onto it without a jolt.
    Same arguments, same road, in any process; another length is another road. Before 0 and behind `length` the heights
    at the ends hold. The spline has continuous curvature, in the fade slope. Raises ValueError naming the argument.
    """
    _check(seed, length, waviness, shortest, longest, fade)
    if length * SAMPLES_PER_WAVE > MOST_SAMPLES * shortest:
        raise ValueError(f"length is {length:g} and shortest {shortest:g} m: that is more than {MOST_SAMPLES} samples")
    n = max(8, int(np.ceil(length * SAMPLES_PER_WAVE / shortest)))
    frequencies = np.arange(n // 2 + 1) / length
    waves = (frequencies >= (1 - 1e-9) / longest) & (frequencies <= (1 + 1e-9) / shortest)
    if not waves.any():
        raise ValueError(f"a road of {length:g} m has no wave from {shortest:g} to {longest:g} m; give a longer length")
    psd = roughness(of) * (frequencies[waves] / REFERENCE_FREQUENCY) ** -waviness
    phases = np.random.default_rng(seed).uniform(0, 2 * np.pi, len(frequencies))[waves]
    spectrum = np.zeros(len(frequencies), dtype=np.complex128)
    spectrum[waves] = n / 2 * np.sqrt(2 * psd / length) * np.exp(1j * phases)
    return _spline(spectrum, n, length, fade)


def _check(seed: int, length: float, waviness: float, shortest: float, longest: float, fade: float) -> None:
    whole("seed", seed, least=0)
    for name, value in {"length": length, "shortest": shortest}.items():
        if finite(name, value) <= 0:
            raise ValueError(f"{name} is {value}, expected a length greater than 0")
    if finite("longest", longest) <= shortest:
        raise ValueError(f"longest is {longest:g}, expected a wavelength greater than the shortest, {shortest:g}")
    if not 0 <= finite("fade", fade) <= length:
        raise ValueError(f"fade is {fade}, expected a distance from 0 to the length, {length:g}")
    if not 0 <= finite("waviness", waviness) <= MOST_WAVINESS:
        raise ValueError(f"waviness is {waviness:g}, expected an exponent from 0 to {MOST_WAVINESS}")


def _spline(spectrum: NDArray[np.complex128], n: int, length: float, fade: float) -> Signal:
    """The periodic cubic spline through the n even samples of a spectrum; its slopes follow from the spectrum, too.

    With sum z_j e^(i j theta) for the samples, continuity of the second derivative, m_(j-1) + 4 m_j + m_(j+1) =
    3 (z_(j+1) - z_(j-1)) / h, turns into m = 3 i sin(theta) / ((2 + cos(theta)) h) z.
    """
    h = length / n
    theta = 2 * np.pi * np.arange(len(spectrum)) / n
    heights = np.fft.irfft(spectrum, n)
    slopes = np.fft.irfft(spectrum * 3j * np.sin(theta) / ((2 + np.cos(theta)) * h), n)
    x = np.linspace(0.0, length, n + 1)
    heights, slopes = np.append(heights, heights[0]), np.append(slopes, slopes[0])
    if fade > 0:
        angle = np.pi * np.minimum(x / fade, 1.0) / 2
        grown, growth = np.sin(angle) ** 2, np.where(x < fade, np.pi / (2 * fade) * np.sin(2 * angle), 0.0)
        heights, slopes = grown * heights, grown * slopes + growth * heights
    pieces = np.zeros((n + 2, 8))
    ends = np.stack([np.stack([each[:-1], each[1:]], axis=1) for each in (heights, slopes)])
    pieces[1:-1] = hermite(x[:-1], x[1:], ends[0], ends[1])
    pieces[0, START], pieces[-1, START] = -length, length
    pieces[0, C0], pieces[-1, C0] = heights[0], heights[-1]
    return Signal(pieces, x[[0, -1]])


def power_spectral_density(road: Signal, begin: float, end: float, parts: int = 1) -> tuple[Vector, Vector]:
    """Spatial frequencies (cycles/m) and the one-sided displacement PSD (m^3) of a road between two distances (m).

    Welch's method: Hann windows over `parts` lengths that overlap by half, the slope of each removed.
    """
    from scipy.signal import welch  # noqa: PLC0415 - slow to import, and runs need none

    n = 2 ** int(np.ceil(np.log2((end - begin) / 0.05)))
    heights = road(np.linspace(begin, end, n, endpoint=False))
    frequencies, psd = welch(heights, n / (end - begin), nperseg=2 * n // (parts + 1), detrend="linear")
    return frequencies[1:], psd[1:]


def octave_bands(frequencies: Vector, psd: Vector) -> tuple[Vector, Vector]:
    """Centres (cycles/m) and mean PSD (m^3) of the octave bands that the frequencies cover, about n0 = 0.1 cycles/m."""
    octaves = np.round(np.log2(frequencies / REFERENCE_FREQUENCY)).astype(int)
    centres = np.arange(octaves.min() + 1, octaves.max())
    means = np.array([psd[octaves == k].mean() for k in centres])
    return REFERENCE_FREQUENCY * 2.0**centres, means


def road_class(value: float) -> str:
    """The class whose range about its Gd(n0) holds this value, in m^3; smoother than A is A, rougher than H is H."""
    place = round(np.log(value / CLASSES["A"]) / np.log(4))
    return list(CLASSES)[min(max(place, 0), len(CLASSES) - 1)]
