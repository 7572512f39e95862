"""Checks of what a person gives: names that exist, numbers that are finite."""

import difflib
import math
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray


def unknown(kind: str, name: object, known: Iterable[str]) -> str:
    """The message for a name that is not among those known: what was found, the nearest one, all of them."""
    names = list(known)
    if not names:
        return f"unknown {kind} {name!r}: there is none"
    lowered = {each.lower(): each for each in reversed(names)}
    nearest = difflib.get_close_matches(str(name).lower(), lowered, n=1, cutoff=0.0)[0]
    return f"unknown {kind} {name!r}; did you mean {lowered[nearest]!r}? There are: {_listed(names)}"


def finite(what: str, value: Any) -> float:
    """The value as a float; raises ValueError naming `what` if it is no finite number."""
    if isinstance(value, bool) or not isinstance(value, int | float | np.integer | np.floating):
        raise ValueError(f"{what} is {value!r}, expected a number")
    if not math.isfinite(value):
        raise ValueError(f"{what} is {value!r}, expected a finite number")
    return float(value)


def finite_state(what: str, values: ArrayLike, names: Sequence[str], called: str = "initial") -> NDArray[np.float64]:
    """A new state x (n_states,); raises ValueError naming `what`, as it is called, and the state that is not finite."""
    try:
        x = np.array(values, dtype=np.float64)
    except (TypeError, ValueError):
        raise ValueError(f"{what}: {called} is {values!r}, expected {len(names)} numbers") from None
    if x.shape != (len(names),):
        raise ValueError(f"{what}: {called} has shape {x.shape}, expected ({len(names)},): {_listed(names)}")
    for i in np.flatnonzero(~np.isfinite(x))[:1]:
        raise ValueError(f"{what}: {called} {names[i]} is {x[i]}, expected a finite number")
    return x


def _listed(names: Sequence[str]) -> str:
    return ", ".join(names[:40]) + (", ..." if len(names) > 40 else "")
