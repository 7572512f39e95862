"""One call from a model, or from any compiled right-hand side, to its solution."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from runner.checks import finite, finite_state, unknown
from runner.diagnosis import diagnosis
from runner.equilibrium import Guess, rest
from runner.events.kinds import OutputCrossing, StateCrossing
from runner.inputs.bind import as_signal, bind
from runner.inputs.signal import Signal, stack
from runner.load import Model, Parameters
from runner.methods import METHODS, Method, find_method
from runner.options import Options
from runner.problem import Problem
from runner.result import IntegrationError, Subject, as_solution
from runner.solution import Solution
from runner.tables import Quantity

__all__ = ["IntegrationError", "Simulation", "crossing", "prepare", "simulate", "solve"]

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
    **options: Any,
) -> Solution:
    """Integrate a model over span = (t0, t1) in s.

    step: of fixed-step methods, in s. parameters: a set's name, values by name, or both as a tuple. inputs: signals or
    numbers by name, 0 where not given. initial: the state by name or as an array (n_states,); None starts from the
    static equilibrium, for which the search starts at `guess`, see `equilibrium`.
    options: those of `Options` (output_times, every, progress, time_limit, rtol, atol, ...).
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
    """A prepared run: everything checked, looked up and compiled. Calling it integrates."""

    subject: Subject
    problem: Problem
    method: Method
    options: Options

    def __call__(self, initial: ArrayLike | None = None, *, on_failure: str = "raise") -> Solution:
        """Integrate, from another state (n_states,) where one is given; returns and raises as `simulate`."""
        _check_on_failure(on_failure)
        problem = self.problem
        if initial is not None:
            x = finite_state(self.subject.name, initial, problem.state_names)
            problem = replace(problem, initial_state=x)
        trajectory = self.method.integrate(problem, self.method, self.options)
        solution = as_solution(self.subject, problem, self.method, self.options, trajectory)
        if not solution.success and on_failure == "raise":
            raise IntegrationError(solution)
        return solution


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
    **options: Any,
) -> Simulation:
    """What `simulate` with these arguments would run, to be run when called, as often as wanted. Raises as it does.

    at_rest: finds the static state as `rest` does, from the same arguments.
    """
    chosen, settings = _method(method), _options(step, options)
    t0, t1 = _span(span)
    if initial is not None and guess is not None:
        raise ValueError("initial and guess are both given; guess is where the search for a static state starts")
    p = model.parameter_values(parameters)
    c, table = model.constants(p), bind(model.tables, inputs)
    problem = Problem(
        rhs=model.kernel("rhs"),
        t0=t0,
        t1=t1,
        initial_state=at_rest(model, c, table, t0, guess) if initial is None else model.state(initial),
        constants=c,
        inputs=table,
        n_inputs=model.tables.rhs_inputs,
        state_names=model.state_names,
        jacobian=model.kernel("jacobian") if chosen.stiff else None,
        linear=_linear(model, chosen) if chosen.family == "exact" else None,
        by_item=True,
    )
    return Simulation(_subject(model, p), problem, chosen, settings)


def _subject(model: Model, p: NDArray[np.float64]) -> Subject:
    tables = model.tables
    return Subject(
        name=model.name,
        states=tables.states,
        outputs=tables.outputs,
        inputs=tuple(Quantity(channel.name, channel.unit, channel.meaning) for channel in tables.inputs),
        output_kernel=model.kernel("outputs") if tables.outputs else None,
        parameters=dict(zip((parameter.name for parameter in tables.parameters), p, strict=True)),
        headlines={
            "coordinates": model.coordinate_names,
            "outputs": tuple(output.name for output in tables.outputs),
            "inputs": tuple(channel.name for channel in tables.inputs if not channel.rate_of),
        },
        diagnose=partial(diagnosis, model),
    )


def crossing(model: Model, name: str, level: float = 0.0, *, direction: int = 0, terminal: bool = False) -> Crossing:
    """An event for `simulate`: a state or an output of the model crosses a level, in its unit.

    direction: 1 rising, -1 falling, 0 both. terminal: the run ends there. Raises ValueError for an unknown name.
    """
    level = finite("level", level)
    outputs = [output.name for output in model.tables.outputs]
    said: dict[str, Any] = {"direction": direction, "terminal": terminal, "name": name}
    if name in model.state_names:
        return StateCrossing(model.state_names.index(name), level, **said)
    if name not in outputs:
        raise ValueError(f"model {model.name}: {unknown('state or output', name, [*model.state_names, *outputs])}")
    return OutputCrossing(model.kernel("outputs"), len(outputs), outputs.index(name), level, **said)


def solve(
    rhs: Any,
    span: tuple[float, float],
    x0: ArrayLike,
    *,
    method: str | Method = "rk4",
    step: float | None = None,
    constants: ArrayLike = (),
    inputs: Sequence[Signal | float] = (),
    jacobian: Any = None,
    mass_matrix: ArrayLike | None = None,
    state_names: Sequence[str] | None = None,
    on_failure: str = "raise",
    **options: Any,
) -> Solution:
    """Integrate x' = rhs for any jitted function of the calling convention, rhs(t, x, u, c, dx), from x0 (n,).

    mass_matrix (n, n): M x' = rhs instead, M constant and possibly singular (an index-1 DAE; stiff methods only).
    constants: c. inputs: the channels of u, signals or numbers, in order; u has at least one element.
    state_names: x_1, x_2, ... by default; the inputs are u_1, u_2, ... Otherwise as `simulate`.
    """
    chosen, settings = _method(method), _options(step, options)
    t0, t1 = _span(span)
    x = np.array(x0, dtype=np.float64)
    if x.ndim != 1 or not x.size or not np.isfinite(x).all():
        raise ValueError(f"x0 is {x0!r}, expected a row of finite numbers")
    names = tuple(state_names) if state_names is not None else tuple(f"x_{i + 1}" for i in range(x.size))
    if len(names) != x.size:
        raise ValueError(f"state_names has {len(names)} names for {x.size} states")
    signals = [as_signal(f"input {i}", value) for i, value in enumerate(inputs)]
    c = np.array(constants, dtype=np.float64).reshape(-1)
    table = stack(signals, [0] * len(signals))
    M = None if mass_matrix is None else _mass_matrix(mass_matrix, x.size, chosen)
    problem = Problem(rhs, t0, t1, x, c, table, len(signals), names, jacobian, M)
    subject = Subject(
        name=getattr(rhs, "__name__", "rhs"),
        states=tuple(Quantity(name, "", "") for name in names),
        inputs=tuple(Quantity(f"u_{i + 1}", "", "") for i in range(len(signals))),
        headlines={"states": names, "inputs": tuple(f"u_{i + 1}" for i in range(len(signals)))},
    )
    return Simulation(subject, problem, chosen, settings)(on_failure=on_failure)


def _linear(model: Model, method: Method) -> Any:
    if not model.tables.linear:
        raise ValueError(
            f"method {method.name} propagates linear models only and model {model.name} is nonlinear; choose another, "
            "such as dop853 or tsit5"
        )
    return model.kernel("linear")


def _mass_matrix(mass_matrix: ArrayLike, n: int, method: Method) -> NDArray[np.float64]:
    M = np.array(mass_matrix, dtype=np.float64)
    if M.shape != (n, n) or not np.isfinite(M).all():
        raise ValueError(f"mass_matrix has shape {M.shape}, expected ({n}, {n}) finite numbers")
    if not method.stiff:
        stiff = ", ".join(name for name, each in METHODS.items() if each.stiff)
        raise ValueError(f"method {method.name} takes no mass matrix; there are {stiff}, or solve for x' in rhs")
    return M


def _method(method: str | Method) -> Method:
    return method if isinstance(method, Method) else find_method(method)


def _options(step: float | None, options: Mapping[str, Any]) -> Options:
    names = [each.name for each in fields(Options)]
    for name in options:
        if name not in names:
            raise ValueError(unknown("option", name, names))
    return Options(step=step, **options)


def _check_on_failure(on_failure: str) -> None:
    if on_failure not in ("raise", "return"):
        raise ValueError(f"on_failure is {on_failure!r}, expected 'raise' or 'return'")


def _span(span: tuple[float, float]) -> tuple[float, float]:
    if len(span) != 2:
        raise ValueError(f"span is {span!r}, expected (start, end)")
    t0, t1 = (finite("span", t) for t in span)
    if not t0 < t1:
        raise ValueError(f"span is ({t0}, {t1}), expected a start before the end")
    return t0, t1
