"""Whether a right-hand side jumps at a state: what makes a solution stick or chatter, as dry friction does."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]

#: Distances at which both sides of a state are compared, relative to its size.
DISTANCES = 10.0 ** -np.arange(10.0)
#: Differences across so many distances in a row that agree to this part make a jump: smooth ones shrink tenfold.
IN_A_ROW, ALIKE = 3, 0.1
#: Part of the largest rate below which a jump is none.
SMALL = 1e-6


def jump(f: Callable[[Vector], Vector], x: Vector, sizes: Vector) -> tuple[int, int, float] | None:
    """(state whose rate jumps, state that passes x there, height) of the largest jump of f (n,) -> (n,) next to x.

    sizes (n,): of each state, how large it becomes. None where f does not jump.
    """
    found: tuple[int, int, float] | None = None
    with np.errstate(all="ignore"):
        least = SMALL * float(np.nanmax(np.abs(f(x)), initial=0.0))
        for i in range(len(x)):
            side = np.zeros(len(x))
            heights = []
            for distance in DISTANCES * (sizes[i] if sizes[i] > 0.0 else 1.0):
                side[i] = distance
                heights.append(f(x + side) - f(x - side))
            for rows in np.lib.stride_tricks.sliding_window_view(np.array(heights), IN_A_ROW, axis=0):
                last = rows[:, -1]
                alike = (np.abs(rows - last[:, None]) <= ALIKE * np.abs(last)[:, None]).all(axis=1)
                height = np.where(alike & (np.abs(last) > least), np.abs(last), 0.0)
                place = int(np.argmax(height))
                if height[place] > (found[2] if found else 0.0):
                    found = place, i, float(height[place])
    return found
