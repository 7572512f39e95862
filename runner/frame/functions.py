"""The functions that a method's loop calls by their addresses in its space: each compiled once, when a run needs it.

So a loop, whose machine code is its own, is compiled without what few runs need, and what all loops share is compiled
for the first of them only.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from qddot.runner.frame.hold import KEEP_SIDES, RELEASE, TAKE_SIDES, keep, let_go, take
from qddot.runner.frame.space import PREPARE, WITHIN
from qddot.runner.frame.step_end import AT_START, FINISH, WALK, at_start, finish, walk
from qddot.runner.machine.pointers import pointer


@dataclass(frozen=True)
class DenseOutput:
    """A method's dense output: functions of the address of its space, `BY_ADDRESS`.

    prepare writes what dense output needs beyond the step itself; it may be called twice. within gives the address of
    the state at part theta of the step, 0 to 1, at 0 without any preparation; sketch that of about this state, without
    any preparation beyond the slope at the end of the step.
    """

    prepare: Any
    within: Any
    sketch: Any


def give_functions(space: np.void, dense: DenseOutput, *, events: bool, conditions: bool, points: bool = True) -> None:
    """Put into a space what its run needs: where it watches for events, holds conditions, or saves points in steps."""
    if not (events or conditions or points):
        return
    found: list[tuple[str, Any, Any]] = [("prepare", dense.prepare, PREPARE), ("within", dense.within, WITHIN)]
    if events or points:
        found.append(("finish", finish, FINISH))
    if events:
        found.append(("at_start", at_start, AT_START))
    if events or conditions:
        found.append(("walk", walk, WALK))
    if conditions:
        found += [
            ("sketch", dense.sketch, WITHIN),
            ("take_sides", take, TAKE_SIDES),
            ("keep_sides", keep, KEEP_SIDES),
            ("release", let_go, RELEASE),
        ]
    for name, function, signature in found:
        space[name] = pointer(function, signature, name)
