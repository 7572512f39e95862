"""Figures in the style of qddot's own; needs the extra `report`, matplotlib.

panels     a figure of panels under each other, on a light grid
COLOURS    that stay apart for colour-blind readers
save       into a PNG, SVG or PDF file that appears whole or not at all
"""

from qddot.runner.pictures.figures import panels, save
from qddot.runner.pictures.picture import COLOURS

__all__ = ["COLOURS", "panels", "save"]
