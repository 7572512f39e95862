"""An exact run: what is wanted when, and the Python loop around the compiled course of `propagate`."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numba import typeof, types
from numpy.typing import NDArray

from qddot.runner import abi
from qddot.runner.exact.course import begin_run, run_slice
from qddot.runner.exact.space import SPACE, Arrays, Linear, space_for
from qddot.runner.frame.log import FAILURES
from qddot.runner.frame.output_times import check_points, wanted_times
from qddot.runner.frame.pieces import Recorder
from qddot.runner.frame.slices import run_slices
from qddot.runner.frame.workplace import restorer, run_in_place
from qddot.runner.inputs.instants import ROUNDING
from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.compiling import working_time
from qddot.runner.options import Options
from qddot.runner.problem import Problem, Statistics, Status, Trajectory

if TYPE_CHECKING:
    from qddot.runner.method import Method

#: Intervals saved by default.
DEFAULT_INTERVALS = 5000
#: Row operations of a slice: some milliseconds.
SLICE_WORK = 1e6
#: Of the functions that Python calls; nothing in them allocates.
_ENTRY: dict[str, Any] = {"_nrt": False, "nogil": True}
_RECORD = typeof(np.zeros(1, dtype=SPACE)[0])


def integrate(problem: Problem, method: "Method", options: Options, recorder: Recorder | None = None) -> Trajectory:
    """Propagate x' = A x + B [u, 1] exactly, to rounding, and save at the wanted times.

    Wanted are options.output_times, or every options.every-th point of a grid of options.step, or 5001 points; start
    and end always. Events are found on Taylor series, see `follow`. Raises ValueError for a problem that is not said to
    be linear, for an event that makes no sense, and for times outside the span.
    """
    return run_in_place(_workplace, problem, method, options, recorder)


@dataclass(frozen=True, eq=False)
class _Workplace:
    """One run at a time: the record s and the arrays that it knows by address; A and B: room."""

    options: Options
    s: np.void
    arrays: Arrays
    A: NDArray[np.float64]
    B: NDArray[np.float64]
    restore: Callable[[], None]
    recorder: Recorder | None

    def run(self, problem: Problem) -> tuple[Trajectory, bool]:
        """See `Workplace`."""
        start, s, options = working_time(), self.s, self.options
        self.restore()
        self.arrays.saved[0] = problem.initial_state
        _compiled_begin()(s, problem.constants, self.A, self.B, problem.initial_state)
        if options.events or self.recorder is not None:
            from qddot.runner.exact.follow import integrate_closely  # noqa: PLC0415 - most runs watch for none

            found = integrate_closely(problem, options, s, self.arrays.outputs[1:-1], self.recorder)
            return found, found.status in (Status.FINISHED, Status.TERMINATED)
        status = run_slices(
            partial(_compiled_loop(), s, SLICE_WORK),
            fraction_done=lambda: float((s["t"] - problem.t0) / (problem.t1 - problem.t0)),
            progress=options.progress,
            time_limit=options.time_limit,
        )
        return _trajectory(s, self.arrays, status, working_time() - start), status is Status.FINISHED


def _workplace(problem: Problem, method: "Method", options: Options, recorder: Recorder | None) -> _Workplace:
    if problem.input_jacobian is None:
        raise ValueError(
            f"method {method.name} needs a linear model, x' = A x + B u: give qddot.simulate a generated model that is "
            "linear (qddot show MODEL), or choose another method, such as dop853"
        )
    n, t0, t1 = len(problem.initial_state), float(problem.t0), float(problem.t1)
    near = ROUNDING * max(abs(t0), abs(t1))
    outputs, spacing, first_even, last_even = _wanted(options, t0, t1, near)
    linear = Linear(problem.rhs, problem.jacobian, problem.input_jacobian)
    n_inputs = problem.input_jacobian.pattern.shape[1]
    s, arrays = space_for(linear, problem.inputs, n_inputs, outputs)
    s["next_output"], s["first_even"], s["last_even"], s["spacing"] = 1, first_even, last_even, spacing
    s["t"], s["segment_end"], s["t1"], s["limit"] = t0, t0, t1, options.divergence_limit
    A, B = np.empty((n, n)), np.empty((n, n_inputs + 1))
    return _Workplace(options, s, arrays, A, B, restorer(s, arrays.cursor), recorder)


def _wanted(options: Options, t0: float, t1: float, near: float) -> tuple[NDArray[np.float64], float, int, int]:
    """All times to save at, and of the evenly spaced among them the spacing, the first and the last index."""
    if options.output_times is not None:
        return _requested(options.output_times, t0, t1, near)
    step = options.step * (options.every or 1) if options.step is not None else (t1 - t0) / DEFAULT_INTERVALS
    if step < 4 * near:
        raise ValueError(f"step is {step}, too small to advance a time as large as {max(abs(t0), abs(t1))}")
    whole = max(1, int(np.ceil((t1 - t0 - near) / step)))
    check_points(whole)
    outputs = np.array(t0 + step * np.arange(whole + 1), dtype=np.float64)
    even = abs(outputs[-1] - t1) <= near
    outputs[-1] = t1
    return outputs, step, 0, whole if even else whole - 1


def _requested(
    times: NDArray[np.float64], t0: float, t1: float, near: float
) -> tuple[NDArray[np.float64], float, int, int]:
    inside = wanted_times(times, t0, t1)
    outputs = np.concatenate([[t0], inside, [t1]])
    if len(inside) < 2:
        return outputs, 0.0, len(outputs), 0
    spacing = float(inside[-1] - inside[0]) / (len(inside) - 1)
    even = np.abs(inside[0] + spacing * np.arange(-1, len(inside) + 1) - outputs) <= near
    if not even[1:-1].all():
        return outputs, 0.0, len(outputs), 0
    return outputs, spacing, 0 if even[0] else 1, len(inside) + 1 if even[-1] else len(inside)


@cache
def _compiled_begin() -> Any:
    return compiled(types.void(_RECORD, abi.VECTOR, abi.MATRIX, abi.MATRIX, abi.VECTOR), **_ENTRY)(begin_run)


@cache
def _compiled_loop() -> Any:
    return compiled(types.int64(_RECORD, types.float64), **_ENTRY)(run_slice)


def _trajectory(s: np.void, arrays: Arrays, status: Status, wall_time: float) -> Trajectory:
    """The states at the wanted times that were reached."""
    saved = int(s["next_output"])
    t, states = arrays.outputs[:saved].copy(), arrays.saved[:saved].copy()
    failed = status in FAILURES
    return Trajectory(
        t=t,
        states=states,
        status=status,
        statistics=Statistics(
            steps=int(s["steps"]),
            evaluations=int(s["products"]),
            factorizations=int(s["exponentials"]),
            wall_time=wall_time,
        ),
        failed_at=float(s["t"]) if failed else np.nan,
        failed_state=int(s["failed_state"]) if failed else -1,
    )
