"""Runs whose end lies before their start: the same problem in the time s = -t, which rises.

With y(s) = x(-s), y' = -f(-s, y, u(-s)). So the loops know one direction only, and runs forward pay nothing for the
other; a kernel gets a small compiled cover that calls it by its address. Inputs are read at (-rate) s + offset; the
rate of one, du/dt, is that of -u in s.
"""

from dataclasses import replace
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numba import njit

from qddot.runner import abi
from qddot.runner.frame.events import Event, EventLog, OutputCrossing
from qddot.runner.frame.output_times import check_within
from qddot.runner.inputs.signal import C0, PHASE, InputTable
from qddot.runner.machine.kernel import Kernel
from qddot.runner.machine.memory import BY_ADDRESS
from qddot.runner.machine.pointers import EVENT_SIGNATURE, call_event, call_kernel, call_matrix_kernel, pointer
from qddot.runner.matrices import PlacedKernel
from qddot.runner.options import Options
from qddot.runner.problem import Held, Problem, Trajectory

if TYPE_CHECKING:
    from qddot.runner.method import Method


def integrate_backward(problem: Problem, method: "Method", options: Options) -> Trajectory:
    """The trajectory of a problem with t1 < t0, its times falling. Directions of events are those along the run."""
    check_within(options.output_times, float(problem.t0), float(problem.t1))
    found = method.integrate(mirrored(problem), method, mirrored_options(options))
    extras = dict(found.extras)
    if "events" in extras:
        log: EventLog = extras["events"]
        extras["events"] = replace(log, t=mirrored_times(log.t))
    return replace(found, t=mirrored_times(found.t), failed_at=0.0 - found.failed_at, extras=extras)


def mirrored_times(t: Any) -> Any:
    """Times t on the other side of 0, without a negative zero."""
    return 0.0 - t


def mirrored(problem: Problem) -> Problem:
    """The problem in the time s = -t."""
    return replace(
        problem,
        rhs=None if problem.rhs is None else cover(problem.rhs, "rhs"),
        jacobian=_mirrored_jacobian(problem.jacobian),
        input_jacobian=_mirrored_jacobian(problem.input_jacobian),
        held=_mirrored_constraints(problem.held),
        switching=None if problem.switching is None else cover(problem.switching, "modes"),
        approach=_mirrored_approach(problem.approach),
        t0=0.0 - problem.t0,
        t1=0.0 - problem.t1,
        sense=-problem.sense,
        inputs=_mirrored_inputs(problem.inputs),
        by_item=False,
    )


def _mirrored_inputs(table: InputTable) -> InputTable:
    """The channels in s = -t; those of order 1 read pieces of the other sign, behind the others."""
    count = len(table.pieces)
    turned = table.pieces.copy()
    turned[:, C0:PHASE] *= -1.0  # of a product of two of these factors, amplitude and frequency, ...
    turned[:, PHASE - 1] *= -1.0  # ... only the first
    shift = np.where(table.order == 1, count, 0)
    return InputTable(
        pieces=np.concatenate([table.pieces, turned]),
        first=table.first + shift,
        last=table.last + shift,
        rate=-table.rate,
        offset=table.offset,
        order=table.order,
        breakpoints=np.ascontiguousarray(mirrored_times(table.breakpoints[::-1])),
    )


def mirrored_options(options: Options) -> Options:
    """The options in the time s = -t."""
    times = options.output_times
    return replace(
        options,
        output_times=None if times is None else mirrored_times(times),
        events=tuple(map(_mirrored_event, options.events)),
    )


def _mirrored_event(event: Any) -> Any:
    if isinstance(event, Event):
        return replace(event, function=cover(event.function, "event"))
    if isinstance(event, OutputCrossing):
        return replace(event, outputs=cover(event.outputs, "outputs"))
    return event


def _mirrored_jacobian(jacobian: Any) -> Any:
    if isinstance(jacobian, PlacedKernel):
        return replace(jacobian, kernel=cover(jacobian.kernel, "values"))
    return None if jacobian is None else cover(jacobian, "jacobian")


def _mirrored_approach(approach: PlacedKernel | None) -> PlacedKernel | None:
    return None if approach is None else replace(approach, kernel=cover(approach.kernel, "approach"))


def _mirrored_constraints(held: Held | None) -> Held | None:
    if held is None:
        return None
    return replace(held, kernel=replace(held.kernel, kernel=cover(held.kernel.kernel, "constraints")))


@cache
def cover(function: Any, kind: str) -> Any:
    """A jitted function of s that calls this one at t = -s; rhs and Jacobians, their values, with the other sign.

    The address of the other stands in it as a number, so it is compiled anew in each process.
    """
    if kind == "event":
        place = pointer(function, EVENT_SIGNATURE, kind)

        def event(s, x, u, c):
            return call_event(place, -s, x, u, c)

        return njit(EVENT_SIGNATURE)(event)
    if kind == "jacobian":
        place = pointer(function, abi.MATRIX_KERNEL, kind)

        def jacobian(s, x, u, c, J):
            call_matrix_kernel(place, -s, x, u, c, J)
            for i in range(J.shape[0]):
                for j in range(J.shape[1]):
                    J[i, j] = -J[i, j]

        return njit(abi.MATRIX_KERNEL)(jacobian)
    place, sign = pointer(function, abi.VECTOR_KERNEL, kind), -1.0 if kind in ("rhs", "values") else 1.0

    def kernel(s, x, u, c, result):
        call_kernel(place, -s, x, u, c, result)
        for i in range(len(result)):
            result[i] = sign * result[i]

    return Kernel(njit(abi.VECTOR_KERNEL, **BY_ADDRESS)(kernel), abi.VECTOR_KERNEL)
