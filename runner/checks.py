"""Checks of what a person gives: names that exist, numbers that are finite, whole, in a row."""

import difflib
import math
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

#: Characters of a wrong value that a message shows, and the largest whole number that compiled code takes.
SHOWN, MOST_WHOLE = 200, 2**63 - 1
#: How much of two names is alike where one may have been meant for the other, by difflib: Wz and Wk are.
ALIKE = 0.5


def unknown(kind: str, name: object, known: Iterable[str]) -> str:
    """The message for a name that is not among those known: what was found, one that is like it, all of them."""
    names = list(known)
    text = name if isinstance(name, str) else shown(name)
    if not names:
        return f"unknown {kind} {shown(name)}: there is none"
    lowered = {each.lower(): each for each in reversed(names)}
    close = difflib.get_close_matches(text[:SHOWN].lower(), lowered, n=1, cutoff=ALIKE)
    meant = f"did you mean {lowered[close[0]]!r}? There" if close else "there"
    return f"unknown {kind} {shown(name)}; {meant} are: {_listed(names)}"


def shown(value: object) -> str:
    """A value as messages show it: on one line, and not for ever."""
    try:
        text = " ".join(repr(value).split())
    except ValueError:  # an integer of thousands of digits
        text = f"a huge {type(value).__name__}"
    return text if len(text) <= SHOWN else text[: SHOWN - 3] + "..."


def number(what: str, value: Any) -> float:
    """The value as a float, perhaps infinite or NaN; raises ValueError naming `what` if it is no number."""
    if isinstance(value, bool) or not isinstance(value, int | float | np.integer | np.floating):
        raise ValueError(f"{what} is {shown(value)}, expected a number")
    try:
        return float(value)
    except OverflowError:
        raise ValueError(f"{what} is {shown(value)}, expected a finite number") from None


def finite(what: str, value: Any) -> float:
    """The value as a float; raises ValueError naming `what` if it is no finite number."""
    found = number(what, value)
    if not math.isfinite(found):
        raise ValueError(f"{what} is {shown(value)}, expected a finite number")
    return found


def positive(what: str, value: Any, expected: str = "a number") -> float:
    """The value as a float; raises ValueError naming `what` if it is no finite number greater than 0."""
    found = finite(what, value)
    if not found > 0:
        raise ValueError(f"{what} is {shown(value)}, expected {expected} greater than 0")
    return found


def whole(what: str, value: Any, least: int = 1, most: int = MOST_WHOLE) -> int:
    """The value as an int; raises ValueError naming `what` if it is no whole number from `least` to `most`."""
    if isinstance(value, bool) or not isinstance(value, int | np.integer):
        raise ValueError(f"{what} is {shown(value)}, expected a whole number, at least {least}")
    if not least <= value <= most:
        limit = f", at most {most}" if value > most else ""
        raise ValueError(f"{what} is {shown(value)}, expected a whole number, at least {least}{limit}")
    return int(value)


def direction(what: str, value: Any) -> int:
    """The value, which way something is crossed; raises ValueError naming `what` if it is not -1, 0 or 1."""
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or value not in (-1, 0, 1):
        raise ValueError(f"{what} is {shown(value)}, expected -1, 0 or 1")
    return int(value)


def flag(what: str, value: Any) -> bool:
    """The value as a bool; raises ValueError naming `what` if it is neither True nor False."""
    if not isinstance(value, bool | np.bool_):
        raise ValueError(f"{what} is {shown(value)}, expected True or False")
    return bool(value)


def terminal(what: str, value: Any) -> int:
    """The crossings that end a run, 0 for none; raises ValueError naming `what` if it is no flag and no count."""
    if isinstance(value, bool | np.bool_):
        return int(value)
    if not isinstance(value, int | np.integer) or not 1 <= value <= MOST_WHOLE:
        raise ValueError(f"{what} is {shown(value)}, expected True, False, or a number of crossings, at least 1")
    return int(value)


def numbers(what: str, values: Any, expected: str = "numbers") -> NDArray[np.float64]:
    """A new float64 array, perhaps with infinities and NaN; raises ValueError naming `what` for anything but numbers.

    Texts, truth values and objects are refused, which numpy would turn into numbers where it can.
    """
    array = _numbers(values)
    if array is None:
        raise ValueError(f"{what} is {shown(values)}, expected {expected}")
    return array


def _numbers(values: Any) -> NDArray[np.float64] | None:
    """The new array of `numbers`, None for anything but numbers."""
    try:
        array = np.asarray(values)
    except (TypeError, ValueError, OverflowError):  # rows of different lengths
        return None
    return array.astype(np.float64) if array.dtype.kind in "iuf" else None


def row(what: str, values: Any, expected: str = "a row of finite numbers") -> NDArray[np.float64]:
    """A new array (n,) of finite numbers; raises ValueError naming `what`, and the place of one that is not finite."""
    array = numbers(what, values, expected)
    if array.ndim != 1:
        raise ValueError(f"{what} has shape {array.shape}, expected {expected}")
    if (i := _not_finite(array)) is not None:
        raise ValueError(f"{what}[{i}] is {array[i]}, expected {expected}")
    return array


def finite_state(what: str, values: ArrayLike, names: Sequence[str], called: str = "initial") -> NDArray[np.float64]:
    """A new state x (n_states,); raises ValueError naming `what`, as it is called, and the state that is not finite."""
    x = _numbers(values)
    if x is None:
        raise ValueError(f"{what}: {called} is {shown(values)}, expected {len(names)} numbers")
    if x.shape != (len(names),):
        raise ValueError(f"{what}: {called} has shape {x.shape}, expected ({len(names)},): {_listed(names)}")
    if (i := _not_finite(x)) is not None:
        raise ValueError(f"{what}: {called} {names[i]} is {x[i]}, expected a finite number")
    return x


def _not_finite(x: NDArray[np.float64]) -> int | None:
    """Where a row (n,) is first infinite or NaN."""
    finite = np.isfinite(x).tolist()  # looked through as a list, short rows cost a fifth of what NumPy's search costs
    return finite.index(False) if False in finite else None


def _listed(names: Sequence[str]) -> str:
    return ", ".join(names[:40]) + (", ..." if len(names) > 40 else "")
