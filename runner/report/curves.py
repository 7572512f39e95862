"""What a figure of a run shows: names chosen, values and labels taken from the solution, nothing drawn yet."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from qddot.runner.checks import unknown
from qddot.runner.report.tables import headlines
from qddot.runner.solution import Solution

#: The most quantities that a panel shows where nobody chose them.
_CROWD = 6


@dataclass(frozen=True, eq=False)
class Curve:
    """One quantity: values (n,), its unit, and how it is called in the legend."""

    values: NDArray[np.float64]
    unit: str
    label: str


@dataclass(frozen=True, eq=False)
class Curves:
    """Panels from top to bottom, each with its curves over the times t (n,) in s."""

    title: str
    t: NDArray[np.float64]
    panels: tuple[tuple[Curve, ...], ...]


def curves(
    solution: Solution, title: str, panels: Sequence[Sequence[str]] = (), from_start: Sequence[str] = ()
) -> Curves:
    """The curves of a run, smooth however few points it saved; `default_panels` where none are chosen.

    from_start: those that are shown as change since the start.

    Raises ValueError with the nearest name for one that the run does not have.
    """
    chosen, shown = panels or default_panels(solution), solution.closely
    for name in [*(name for names in chosen for name in names), *from_start]:
        if name not in solution:
            raise ValueError(f"figure: {unknown('quantity', name, solution.names)}")

    def curve(name: str) -> Curve:
        quantity, values = solution.quantity(name), np.array(shown[name])
        label = quantity.meaning or name
        if name in from_start:
            return Curve(values - values[0], quantity.unit, f"{label}, change since the start")
        return Curve(values, quantity.unit, label)

    return Curves(title, np.array(shown.t), tuple(tuple(curve(name) for name in names) for names in chosen))


def default_panels(solution: Solution) -> tuple[tuple[str, ...], ...]:
    """Coordinates, outputs and the inputs that move, each kind grouped by unit, one panel a group."""
    panels: dict[tuple[str, str], list[str]] = {}
    for kind, names in headlines(solution).items():
        for name in names:
            panels.setdefault((kind, solution.quantity(name).unit), []).append(name)
    return tuple(tuple(names[:_CROWD]) for names in panels.values())
