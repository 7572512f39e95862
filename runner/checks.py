"""Checks of what a person gives: names that exist, numbers that are finite."""

import difflib
import math
from collections.abc import Iterable
from typing import Any

import numpy as np


def unknown(kind: str, name: object, known: Iterable[str]) -> str:
    """The message for a name that is not among those known: what was found, the nearest one, all of them."""
    names = list(known)
    if not names:
        return f"unknown {kind} {name!r}: there is none"
    lowered = {each.lower(): each for each in reversed(names)}
    nearest = difflib.get_close_matches(str(name).lower(), lowered, n=1, cutoff=0.0)[0]
    listed = ", ".join(names[:40]) + (", ..." if len(names) > 40 else "")
    return f"unknown {kind} {name!r}; did you mean {lowered[nearest]!r}? There are: {listed}"


def finite(what: str, value: Any) -> float:
    """The value as a float; raises ValueError naming `what` if it is no finite number."""
    if isinstance(value, bool) or not isinstance(value, int | float | np.integer | np.floating):
        raise ValueError(f"{what} is {value!r}, expected a number")
    if not math.isfinite(value):
        raise ValueError(f"{what} is {value!r}, expected a finite number")
    return float(value)
