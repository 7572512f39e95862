"""From a trajectory to a solution: outputs and inputs at the saved points, the message, the metadata."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from qddot.runner import abi
from qddot.runner.columns import Between
from qddot.runner.inputs.reader import sample
from qddot.runner.machine.compiled import compiled
from qddot.runner.machine.pointers import call_kernel, pointer
from qddot.runner.method import Method
from qddot.runner.options import Options
from qddot.runner.problem import Problem, Status, Trajectory, unchecked
from qddot.runner.solution import Solution
from qddot.runner.tables import Quantity

#: What to try after a run that failed.
ADVICE = {
    Status.NON_FINITE: "try a smaller step, a stiff method, or check the parameters",
    Status.STEP_UNDERFLOW: "try a stiff method, looser tolerances, or look for a singularity there",
    Status.NEWTON_FAILURE: "try a smaller max_step, or check the Jacobian and the parameters",
    Status.TOO_MANY_STEPS: "try a larger max_steps, looser tolerances or a stiff method",
    Status.TIME_LIMIT: "try a larger time_limit, a larger step or looser tolerances",
    Status.INTERRUPTED: "the solution holds what was computed until then",
    Status.NOT_STARTED: "give the initial state",
    Status.NO_EVENT: "give an end to the span, or another event",
    Status.PILED_UP: "let the event end the run once it does little, or write it as an Impact, which can come to rest",
}
WHAT = {
    Status.FINISHED: "finished",
    Status.TERMINATED: "ended by an event",
    Status.NON_FINITE: "diverged",
    Status.STEP_UNDERFLOW: "needs a step too small for the time to advance",
    Status.NEWTON_FAILURE: "stopped because Newton's iteration does not converge",
    Status.TOO_MANY_STEPS: "took more steps than max_steps",
    Status.TIME_LIMIT: "reached its wall-clock limit",
    Status.INTERRUPTED: "was interrupted",
    Status.NOT_STARTED: "has no static state to start from",
    Status.NO_EVENT: "met no terminal event",
    Status.PILED_UP: "cannot pass the time at which an event happens without end",
}


class IntegrationError(RuntimeError):
    """A run that did not reach its end; `solution` is the part that was computed."""

    def __init__(self, solution: Solution) -> None:
        super().__init__(solution.message)
        self.solution = solution

    def __reduce__(self) -> tuple[Any, ...]:
        """What an exception is pickled as by default is its message, from which none of these can be made."""
        return type(self), (self.solution,)


@dataclass(frozen=True, eq=False)
class Subject:
    """What is simulated, for the solution: its name, quantities, outputs kernel, parameters, headlines.

    reason: why its method is what it is, where that was not told.
    diagnose: says why a run that failed could not go on, "" where it does not know; None where nobody can tell.
    """

    name: str
    states: tuple[Quantity, ...]
    inputs: tuple[Quantity, ...]
    outputs: tuple[Quantity, ...] = ()
    output_kernel: Any = None
    parameters: Mapping[str, float] = field(default_factory=dict)
    headlines: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    diagnose: Callable[[Problem, Trajectory], str] | None = None
    reason: str = ""

    @cached_property
    def quantities(self) -> tuple[Quantity, ...]:
        """States, outputs, inputs."""
        return (*self.states, *self.outputs, *self.inputs)

    @cached_property
    def parameter_metadata(self) -> dict[str, float]:
        """The parameters as a solution's metadata name them."""
        return {f"parameter {name}": float(value) for name, value in self.parameters.items()}


def as_solution(
    subject: Subject,
    problem: Problem,
    method: Method,
    options: Options,
    trajectory: Trajectory,
    metadata: Mapping[str, str | float],
    between: Callable[[], Between] | None = None,
) -> Solution:
    """The solution of this trajectory; metadata: see `metadata_of`; between: gives what lies between its points."""
    failed = trajectory.failed_state
    values = {
        "t": trajectory.t.view(),  # read-only for whom the solution is given; kernels take what they may write to
        "states": trajectory.states.view(),
        "beside": partial(_beside, subject, problem, trajectory.t, trajectory.states),
        "quantities": subject.quantities,
        "n_states": len(subject.states),
        "n_outputs": len(subject.outputs),
        "status": trajectory.status,
        "message": _message(subject, problem, method, options, trajectory),
        "statistics": trajectory.statistics,
        "metadata": dict(metadata),
        "failed_at": trajectory.failed_at,
        "failed_state": subject.states[failed].name if failed >= 0 else "",
        "extras": trajectory.extras,
        "headlines": subject.headlines,
        "between": between,
    }
    solution = unchecked(Solution, values)
    solution.__post_init__()
    return solution


def values_at(
    subject: Subject, problem: Problem, t: NDArray[np.float64], states: NDArray[np.float64]
) -> NDArray[np.float64]:
    """States, outputs and inputs (n, n_quantities) at times t (n,); at a jump, the limit from the right."""
    return np.concatenate([states, _beside(subject, problem, t, states)], axis=1)


def _beside(
    subject: Subject, problem: Problem, t: NDArray[np.float64], states: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Outputs and inputs at times t."""
    u, y = outputs_of(subject.output_kernel, len(subject.outputs), problem, t, states)
    return np.concatenate([y, u[:, : len(subject.inputs)]], axis=1)


def outputs_of(
    kernel: Any, count: int, problem: Problem, t: NDArray[np.float64], states: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Inputs (n, channels) and `count` outputs (n, count) at times t (n,); kernel: None where there is none."""
    u, y = np.zeros((len(t), max(1, len(problem.inputs.first)))), np.zeros((len(t), count))
    sample(problem.inputs, t, u)
    if kernel is not None:
        fill(pointer(kernel, abi.VECTOR_KERNEL, "outputs"), t, states, u, problem.constants, y)
        if problem.approach is not None:
            from qddot.runner.frame.slid import combine_outputs  # noqa: PLC0415 - few models have conditions

            combine_outputs(problem, kernel, t, states, u, y)
    return u, y


@compiled()
def fill(outputs, t, x, u, c, y):
    """Write the outputs (n, n_outputs) at times t (n,), states x (n, n_states) and inputs u (n, n_inputs)."""
    for i in range(len(t)):
        call_kernel(outputs, t[i], x[i], u[i], c, y[i])


def _message(subject: Subject, problem: Problem, method: Method, options: Options, trajectory: Trajectory) -> str:
    """How the run ended; for a failure also when, which state, its last value, and what to try."""
    status = trajectory.status
    if status in (Status.FINISHED, Status.TERMINATED):
        return f"{subject.name} {WHAT[status]} at t = {float(trajectory.t[-1]):.9g} s"
    at = trajectory.failed_at if np.isfinite(trajectory.failed_at) else trajectory.t[-1]
    step = f" with step {options.step:g} s" if options.step is not None and not method.adaptive else ""
    message = f"{subject.name} {WHAT[status]} at t = {at:.9g} s (method {method.name}{step})"
    if status is Status.PILED_UP:
        message += f": {trajectory.extras['piled_up']}"
    if trajectory.failed_state >= 0:
        state = subject.states[trajectory.failed_state]
        last = trajectory.states[-1, trajectory.failed_state]
        message += f": {state.name} left first, from {last:.6g} {state.unit}".rstrip()
        message += f" at t = {trajectory.t[-1]:.9g} s"
    found = trajectory.extras.get("advice") or (subject.diagnose and subject.diagnose(problem, trajectory))
    return f"{message}; {found or ADVICE[status]}"


def metadata_of(subject: Subject, method: Method, options: Options) -> dict[str, str | float]:
    """What a solution is told by: model, method, tolerances or step, parameters."""
    settings: dict[str, str | float] = {"model": subject.name, "method": method.name}
    if method.adaptive:
        settings |= options.tolerance_metadata
    elif options.step is not None:
        settings["step"] = float(options.step)
    if subject.reason:
        settings["method chosen, since"] = subject.reason
    return settings | subject.parameter_metadata
