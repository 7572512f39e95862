"""Signals from sampled values."""

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from qddot.runner.checks import numbers, unknown
from qddot.runner.inputs.signal import C0, C1, START, Signal

#: Relative change of slope that makes a sample a kink rather than rounding.
KINK = 1e-9
KINDS = ("linear", "cubic")


def table(t: ArrayLike, values: ArrayLike, kind: str = "linear", breakpoints: ArrayLike | None = None) -> Signal:
    """Samples values (n,) at rising arguments t (n,), n >= 2; the end values hold outside.

    kind "linear": straight lines; every sample where the slope changes is a breakpoint. kind "cubic": a twice
    continuously differentiable spline (not-a-knot); its ends are breakpoints. breakpoints: replaces these.
    Raises ValueError naming the sample that is not finite, out of order or repeated.
    """
    return table_at(_samples("t", t), _samples("values", values), kind, breakpoints, lambda i: f"sample {i}")


def _samples(name: str, samples: ArrayLike) -> NDArray[np.float64]:
    array = numbers(name, samples, "one row of numbers")
    if array.ndim != 1:
        raise ValueError(f"{name} has shape {array.shape}, expected one row of numbers")
    return array


def table_at(
    t: NDArray[np.float64],
    values: NDArray[np.float64],
    kind: str,
    breakpoints: ArrayLike | None,
    place: Callable[[int], str],
    argument: str = "time",
) -> Signal:
    """As `table`, of float64 arrays; place(i) names sample i in messages, `argument` what t is."""
    if not isinstance(kind, str) or kind not in KINDS:
        raise ValueError(unknown("kind of table", kind, KINDS))
    if len(t) != len(values) or len(t) < 2:
        raise ValueError(
            f"a table needs two samples or more, as many values as {argument}s; found {len(t)} and {len(values)}"
        )
    for name, array in ((argument, t), ("value", values)):
        if not np.isfinite(array).all():
            i = int(np.argmin(np.isfinite(array)))
            raise ValueError(f"{place(i)}: {name} is {array[i]}, expected a finite number")
    if not (np.diff(t) > 0).all():
        i = int(np.argmin(np.diff(t) > 0))
        how = "repeats" if t[i + 1] == t[i] else "is before"
        raise ValueError(
            f"{place(i + 1)}: {argument} {t[i + 1]} {how} that of {place(i)}, {t[i]}; {argument}s must rise"
        )
    coefficients = _lines(t, values) if kind == "linear" else _spline(t, values)
    pieces = np.zeros((len(t) + 1, 8))
    pieces[0, START], pieces[0, C0] = t[0] - (t[-1] - t[0]), values[0]
    pieces[1:-1, START], pieces[1:-1, C0 : C0 + coefficients.shape[1]] = t[:-1], coefficients
    pieces[-1, START], pieces[-1, C0] = t[-1], values[-1]
    if breakpoints is not None:
        return Signal(pieces, np.unique(_samples("breakpoints", breakpoints)))
    return Signal(pieces, t[_kinks(pieces[:, C1])] if kind == "linear" else t[[0, -1]])


def _lines(t: NDArray[np.float64], values: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.stack([values[:-1], np.diff(values) / np.diff(t)], axis=1)


def _spline(t: NDArray[np.float64], values: NDArray[np.float64]) -> NDArray[np.float64]:
    from scipy.interpolate import CubicSpline  # noqa: PLC0415 - slow to import, and most runs need none

    return CubicSpline(t, values).c[::-1].T


def _kinks(slopes: NDArray[np.float64]) -> NDArray[np.bool_]:
    return np.abs(np.diff(slopes)) > KINK * np.maximum(np.abs(slopes[1:]), np.abs(slopes[:-1]))


def resampled(
    t: NDArray[np.float64], values: NDArray[np.float64], spacing: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Even samples of the lines through samples (t, values): arguments and values, `spacing` apart or a little less.

    Each is the mean over half a spacing to either side, within the table: no aliasing, and the integral is kept.
    """
    n = max(1, int(np.ceil((t[-1] - t[0]) / spacing * (1 - 1e-12))))
    even = np.linspace(t[0], t[-1], n + 1)
    edges = np.concatenate([t[:1], (even[1:] + even[:-1]) / 2, t[-1:]])
    areas = np.concatenate([[0.0], np.cumsum(np.diff(t) * (values[1:] + values[:-1]) / 2)])
    k = np.clip(np.searchsorted(t, edges, side="right") - 1, 0, len(t) - 2)
    s, slope = edges - t[k], np.diff(values)[k] / np.diff(t)[k]
    return even, np.diff(areas[k] + s * (values[k] + slope * s / 2)) / np.diff(edges)
