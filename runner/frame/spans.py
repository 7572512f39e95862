"""Spans of time as people give them: forward, backward, of length zero, and without an end."""

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from qddot.runner.checks import finite, number, shown
from qddot.runner.frame.output_times import check_within
from qddot.runner.options import Options
from qddot.runner.problem import FOREVER, Problem, Statistics, Status, Trajectory

if TYPE_CHECKING:
    from qddot.runner.method import Method

#: The shortest step, in spacings of floating-point time.
LEAST_STEP = 64


def span_of(span: Any, method: "Method", options: Options) -> tuple[float, float]:
    """Start and end in s, the end FOREVER away where it is infinite; ValueError naming what is wrong with the span.

    An infinite end takes a terminal event, and a method that finds events. Output times must follow the way of the run.
    """
    if not isinstance(span, tuple | list | np.ndarray) or len(span) != 2:
        raise ValueError(f"span is {shown(span)}, expected (start, end)")
    t0, t1 = finite("span: its start", span[0]), number("span: its end", span[1])
    if math.isinf(t1):
        _check_endless(span, method, options)
        t1 = t0 + math.copysign(FOREVER, t1)
    else:
        check_advances(options, max(abs(t0), abs(t1)))
    finite("span: its end", t1)
    times = options.output_times
    if times is not None and len(times) > 1 and t0 != t1 and (times[1] > times[0]) != (t1 > t0):
        way = "rise" if t1 > t0 else "fall"
        raise ValueError(f"output_times must {way}, as the span from {t0} to {t1} does")
    return t0, t1


def check_advances(options: Options, largest: float) -> None:
    """ValueError where the longest step that is allowed would not change a time of this size, s."""
    if options.max_step is not None and options.max_step < LEAST_STEP * np.spacing(largest):
        raise ValueError(f"max_step is {options.max_step:g}, too small to advance a time as large as {largest:g}")


def _check_endless(span: Any, method: "Method", options: Options) -> None:
    if method.family not in ("adaptive", "stiff", "taylor", "auto"):
        raise ValueError(f"span is {shown(span)}, but method {method.name} goes to a finite end; expected (start, end)")
    if not any(getattr(event, "terminal", False) for event in options.events):
        raise ValueError(f"span is {shown(span)}, but no event with terminal=True would end the run")


def integrate(problem: Problem, method: "Method", options: Options) -> Trajectory:
    """The trajectory of a problem over any span."""
    if problem.t1 == problem.t0:
        return _at_once(problem, method, options)
    if problem.acting is not None:
        from qddot.runner.frame.acting import integrate_acting  # noqa: PLC0415 - most models have no such events

        found = integrate_acting(problem, problem.acting, method, options)
    elif problem.t1 < problem.t0:
        from qddot.runner.frame.backward import integrate_backward  # noqa: PLC0415 - most runs go forward

        found = integrate_backward(problem, method, options)
    else:
        found = method.integrate(problem, method, options)
    if found.status is Status.FINISHED and abs(problem.t1 - problem.t0) >= FOREVER:
        status = Status.NO_EVENT
        return Trajectory(found.t, found.states, status, found.statistics, extras=found.extras)
    return found


def _at_once(problem: Problem, method: "Method", options: Options) -> Trajectory:
    """A run from t0 to t0: its one point, whose algebraic states are made to fit as at the start of any run."""
    t0 = float(problem.t0)
    check_within(options.output_times, t0, t0)
    x = np.array(problem.initial_state, dtype=np.float64)
    evaluations = jacobians = 0
    if problem.mass_matrix is not None and np.linalg.matrix_rank(problem.mass_matrix) < len(x):
        from qddot.runner.frame.consistent import AlgebraicEquations, consistent_state  # noqa: PLC0415 - as above

        rtol, atol = options.tolerances(len(x))
        equations = AlgebraicEquations(problem, t0, t0, np.maximum(atol / rtol, np.finfo(np.float64).tiny))
        x = consistent_state(equations, x, options.least_rtol)
        evaluations, jacobians = equations.evaluations, equations.jacobians
    extras = {}
    if options.events:
        from qddot.runner.frame.events import EventLog, names_of, watch_for  # noqa: PLC0415 - as above

        watch_for(options.events, len(x), degree=1)
        none = np.zeros(0)
        extras["events"] = EventLog(none, np.zeros(0, dtype=np.int64), np.zeros((0, len(x))), names_of(options.events))
    counts = Statistics(evaluations=evaluations, jacobians=jacobians)
    return Trajectory(np.array([t0]), x[None], Status.FINISHED, counts, extras=extras)
