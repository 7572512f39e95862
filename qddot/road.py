"""Roads: height in m over distance in m, each a `qddot.Signal`; `qddot.drive` puts one under every axle of a model.

    step, ramp, sine        a jump or a steep edge; a slope; a wave
    cosine_bump, pothole    single obstacles
    iso8608                 a random road of a roughness class

A measured road is a `qddot.signal.table` of heights over distances. Names are those of a study's `[road]` kinds.
"""

from qddot.runner.inputs.iso8608 import random_road as iso8608
from qddot.runner.inputs.roads import cosine_bump, pothole, ramp, sine, step

__all__ = ["cosine_bump", "iso8608", "pothole", "ramp", "sine", "step"]
