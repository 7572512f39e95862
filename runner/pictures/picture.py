"""What stands in a figure, ready to be drawn by anything: plain texts and numbers, scaled, nothing drawn yet."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]

#: Colours that stay apart for colour-blind readers (Wong, Nature Methods 8 (2011) 441).
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")


@dataclass(frozen=True, eq=False)
class Curve:
    """Values (n,) over x (n,) in the panel's unit; name: what it is called in a legend.

    colour: its place among the colours. raised: what is added to it in a picture, where curves would hide each other.
    band: the lower and the upper edge (n,) of an area around it.
    """

    x: Vector
    values: Vector
    name: str
    colour: int = 0
    raised: float = 0.0
    band: tuple[Vector, Vector] | None = None
    dashed: bool = False


@dataclass(frozen=True, eq=False)
class Panel:
    """Curves over one pair of axes. axis: what stands at the vertical one; above: over the panel, on the left.

    unit: of all values, legible; nothing where there are several, which names tell then.

    spacing: the distance between curves that are raised, each of whose levels bears its name; 0: nothing is raised.
    """

    curves: tuple[Curve, ...]
    axis: str
    above: str = ""
    spacing: float = 0.0
    legend: bool = True
    unit: str = ""


@dataclass(frozen=True, eq=False)
class Picture:
    """Panels from top to bottom over a common axis x. notes: what is not shown, and why, a line each."""

    title: str
    panels: tuple[Panel, ...]
    x: str = "t, s"
    notes: tuple[str, ...] = ()
