"""One call from a model to its solution."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import Any, Unpack

import numpy as np
from numpy.typing import ArrayLike, NDArray

from qddot.runner import checks
from qddot.runner.assembly import assembled, assembled_on, manifold_of
from qddot.runner.checks import finite, finite_state, shown, unknown
from qddot.runner.columns import Between
from qddot.runner.diagnosis import diagnosis
from qddot.runner.equilibrium import Guess, rest
from qddot.runner.frame.acting import acting_of
from qddot.runner.frame.events import OutputCrossing, StateCrossing
from qddot.runner.frame.first_call import check_first_calls
from qddot.runner.frame.hold import switching_of
from qddot.runner.frame.spans import integrate, span_of
from qddot.runner.frame.stretches import Stretch, as_run
from qddot.runner.inputs.bind import bind
from qddot.runner.inputs.signal import Signal
from qddot.runner.keywords import OptionKeywords
from qddot.runner.load import Model, Parameters, as_model
from qddot.runner.manifold import Manifold, held_by, resting_of
from qddot.runner.matrices import PlacedKernel
from qddot.runner.method import Method
from qddot.runner.methods import find_method
from qddot.runner.options import TABLE, Options
from qddot.runner.pictures.arrange import MULTIPLIERS
from qddot.runner.problem import Problem, unchecked
from qddot.runner.result import IntegrationError, Subject, as_solution, metadata_of
from qddot.runner.solution import Solution
from qddot.runner.switching import sides
from qddot.runner.tables import Quantity
from qddot.runner.takers import fitted
from qddot.words import counted

__all__ = ["IntegrationError", "Simulation", "crossing", "prepare", "simulate"]

Crossing = StateCrossing | OutputCrossing


def simulate(
    model: Model,
    span: tuple[float, float],
    *,
    method: str | Method = "rk4",
    step: float | None = None,
    parameters: Parameters = None,
    inputs: Mapping[str, Signal | float] | None = None,
    initial: Mapping[str, float] | ArrayLike | None = None,
    guess: Guess = None,
    on_failure: str = "raise",
    **options: Unpack[OptionKeywords],
) -> Solution:
    """Integrate a model over span = (t0, t1) in s, backward where t1 < t0, to a terminal event where t1 is infinite.

    step: of fixed-step methods, in s. parameters: a set's name, values by name, or both as a tuple. inputs: signals or
    numbers by name, 0 where not given. initial: the state by name or as an array (n_states,); None starts from the
    static equilibrium, for which the search starts at `guess`, see `equilibrium`. Of a model with constraints `initial`
    may name some states, which are held; the others are found near `guess`, see `assemble`.
    options: those of `Options` that the method takes (output_times, progress, time_limit, rtol, atol, ...).
    Raises IntegrationError where the run fails, unless on_failure is "return"; EquilibriumError where there is no
    static state to start from; ValueError for anything given wrongly, naming it.
    """
    run = prepare(
        model,
        span,
        method=method,
        step=step,
        parameters=parameters,
        inputs=inputs,
        initial=initial,
        guess=guess,
        **options,
    )
    return run(on_failure=on_failure)


@dataclass(frozen=True, eq=False)
class Simulation:
    """A prepared run: everything checked, looked up and compiled. Calling it integrates.

    model: None where the right-hand side is no model's, see `solve`.
    """

    subject: Subject
    problem: Problem
    method: Method
    options: Options
    model: Model | None
    _workplaces: dict[Any, list[Any]] = field(default_factory=dict, init=False, repr=False)

    def __repr__(self) -> str:
        """Model, method, span and size."""
        problem, size = self.problem, counted(len(self.problem.state_names), "state")
        return f"<Simulation of {self.subject.name} by {self.method.name}: {problem.t0:g} to {problem.t1:g} s, {size}>"

    def __reduce__(self) -> tuple[Any, ...]:
        """Kernels are the model's: pickled, it carries them by name."""
        if self.model is None:
            return Simulation, (self.subject, replace(self.problem), self.method, self.options, None)
        problem = self.problem.without_kernels()
        return _unpickled, (self.model, replace(self.subject, output_kernel=None), problem, self.method, self.options)

    @cached_property
    def _metadata(self) -> dict[str, str | float]:
        """What is the same of all runs."""
        return metadata_of(self.subject, self.method, self.options)

    @cached_property
    def _manifold(self) -> Manifold:
        """The constraints of the model where runs start."""
        assert self.model is not None
        return manifold_of(self.model, self.problem.constants, self.problem.inputs, self.problem.t0)

    def __call__(self, initial: ArrayLike | None = None, *, on_failure: str = "raise") -> Solution:
        """Integrate, from another state (n_states,) where one is given; returns and raises as `simulate`."""
        if not isinstance(on_failure, str) or on_failure not in ("raise", "return"):
            raise ValueError(f"on_failure is {shown(on_failure)}, expected 'raise' or 'return'")
        problem = self.problem
        x = problem.initial_state
        if initial is not None:
            x = finite_state(self.subject.name, initial, problem.state_names)
            if self.model is not None and self.model.tables.constraints:
                x = assembled_on(self._manifold, x)
        problem = problem.started_from(x, self._workplaces)
        trajectory = integrate(problem, self.method, self.options)
        steps, end = trajectory.statistics.steps, float(trajectory.t[-1])
        whole = unchecked(Stretch, {"t0": problem.t0, "x": x, "steps": steps, "end": end})
        between = _Between(self, trajectory.extras.get("stretches") or (whole,))
        problem = as_run(problem, trajectory)
        solution = as_solution(self.subject, problem, self.method, self.options, trajectory, self._metadata, between)
        if not solution.success and on_failure == "raise":
            raise IntegrationError(solution)
        return solution


@dataclass(frozen=True, eq=False)
class _Between:
    """What lies between the saved points of a run, when called; stretches: those that it was integrated in."""

    simulation: Simulation
    stretches: tuple[Stretch, ...]

    def __call__(self) -> Between:
        from qddot.runner.dense.output import (  # noqa: PLC0415 - most runs are read as they were saved
            Chain,
            DenseOutput,
        )

        run = self.simulation
        parts = [
            DenseOutput(
                run.subject,
                each.seen(run.problem),
                run.method,
                run.options if each.first_step is None else replace(run.options, first_step=each.first_step),
                each.steps,
                each.end,
            )
            for each in self.stretches
        ]
        return parts[0] if len(parts) == 1 else Chain(tuple(parts))


def prepare(
    model: Model,
    span: tuple[float, float],
    *,
    method: str | Method = "rk4",
    step: float | None = None,
    parameters: Parameters = None,
    inputs: Mapping[str, Signal | float] | None = None,
    initial: Mapping[str, float] | ArrayLike | None = None,
    guess: Guess = None,
    at_rest: Callable[..., NDArray[np.float64]] = rest,
    **options: Unpack[OptionKeywords],
) -> Simulation:
    """What `simulate` with these arguments would run, to be run when called, as often as wanted. Raises as it does.

    at_rest: finds the static state as `rest` does, from the same arguments.
    """
    model, chosen = as_model(model), chosen_method(method)
    given = given_options(step, options)
    settings = fitted(given, chosen)
    t0, t1 = span_of(span, chosen, settings)
    settings.tolerances(len(model.state_names))
    if initial is not None and guess is not None and not model.tables.constraints:
        raise ValueError("initial and guess are both given; guess is where the search for a static state starts")
    p = model.parameter_values(parameters)
    c = model.constants(p)
    table = bind(model.tables, inputs, sides(model, c, t0, t1))
    problem = Problem(
        rhs=None,
        t0=t0,
        t1=t1,
        initial_state=at_rest(model, c, table, t0, guess)
        if initial is None
        else assembled(model, c, table, t0, initial, guess),
        constants=c,
        inputs=table,
        n_inputs=len(table.first) if _reads_all(settings.events) else model.tables.rhs_inputs,
        state_names=model.state_names,
        by_item=True,
    )
    subject = _subject(model, p)
    if chosen.family == "auto":
        from qddot.runner.auto import choose  # noqa: PLC0415 - most runs name their method

        chosen, settings, reason = choose(model, problem, given)
        subject = replace(subject, reason=reason)
    return _unpickled(model, subject, problem, chosen, settings)


def _unpickled(model: Model, subject: Subject, problem: Problem, method: Method, options: Options) -> Simulation:
    """A simulation of what is given without kernels."""
    exact = method.family == "exact"
    problem = replace(
        problem,
        rhs=model.kernel("rhs") if method.family != "taylor" else None,
        jacobian=model.matrix("jacobian") if method.stiff or exact else None,
        input_jacobian=_constant(model, method) if exact else None,
        recurrences=model.series if method.family == "taylor" else None,
        held=held_by(model),
        acting=acting_of(model, resting_of(model, stiff=method.stiff)),
        **switching_of(model, method, options),
    )
    check_first_calls(problem, options)
    subject = replace(subject, output_kernel=model.kernel("outputs") if model.tables.outputs else None)
    return Simulation(subject, problem, method, options, model)


def _subject(model: Model, p: NDArray[np.float64]) -> Subject:
    tables = model.tables
    multipliers = tuple(constraint.name for constraint in tables.constraints)
    return Subject(
        name=model.name,
        states=tables.states,
        outputs=tables.outputs,
        inputs=tuple(Quantity(channel.name, channel.unit, channel.meaning) for channel in tables.courses),
        parameters=dict(zip((parameter.name for parameter in tables.parameters), p, strict=True)),
        headlines={
            "coordinates": model.coordinate_names,
            "outputs": tuple(output.name for output in tables.outputs if output.name not in multipliers),
            **({MULTIPLIERS: multipliers} if multipliers else {}),
            "inputs": tables.free_inputs,
        },
        diagnose=partial(diagnosis, model),
    )


def crossing(
    model: Model,
    name: str,
    level: float = 0.0,
    *,
    direction: int = 0,
    terminal: bool | int = False,
    called: str | None = None,
) -> Crossing:
    """An event for `simulate`: a state or an output of the model crosses a level, in its unit.

    direction: 1 rising, -1 falling, 0 both. terminal: the run ends there; a number n ends it at the n-th crossing in
    this direction. called: the event's name in `solution.events`, that of the state or output by default. How closely a
    step is followed: see `runner.frame.events`. Raises ValueError for an unknown name.
    """
    model, level = as_model(model), finite("level", level)
    way = checks.direction("direction", direction)
    if not isinstance(name, str):
        raise ValueError(f"name is {shown(name)}, expected that of a state or an output")
    outputs = [output.name for output in model.tables.outputs]
    if not (called is None or isinstance(called, str)):
        raise ValueError(f"called is {shown(called)}, expected a name for the event")
    said: dict[str, Any] = {"direction": way, "terminal": terminal, "name": called or name}
    if name in model.state_names:
        return StateCrossing(model.state_names.index(name), level, **said)
    if name not in outputs:
        raise ValueError(f"model {model.name}: {unknown('state or output', name, [*model.state_names, *outputs])}")
    return OutputCrossing(model.kernel("outputs"), len(outputs), outputs.index(name), level, **said)


def _reads_all(events: Sequence[Any]) -> bool:
    """Whether events may read inputs that the right-hand side does not."""
    return not all(isinstance(event, StateCrossing) for event in events)


def _constant(model: Model, method: Method) -> PlacedKernel:
    """The derivative of a linear model's rhs by the inputs."""
    if not model.tables.linear:
        raise ValueError(
            f"method {method.name} propagates linear models only and model {model.name} is nonlinear; choose another, "
            "such as dop853 or tsit5"
        )
    return model.matrix("input_jacobian")


def chosen_method(method: str | Method) -> Method:
    """The method of this name, or this one."""
    return method if isinstance(method, Method) else find_method(method)


def given_options(step: float | None, options: Mapping[str, Any]) -> Options:
    """The options that are given, checked."""
    for name in options:
        if name not in TABLE:
            raise ValueError(unknown("option", name, TABLE))
    return Options(step=step, **options)
