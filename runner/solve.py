"""One call from any compiled right-hand side to its solution."""

from collections.abc import Mapping, Sequence
from typing import Any, Unpack

import numpy as np
from numpy.typing import ArrayLike, NDArray

from qddot.runner.checks import numbers, row, shown
from qddot.runner.frame.first_call import check_first_calls
from qddot.runner.frame.spans import span_of
from qddot.runner.inputs.bind import as_signal
from qddot.runner.inputs.signal import Signal, stack
from qddot.runner.keywords import OptionKeywords
from qddot.runner.method import Method
from qddot.runner.methods import METHODS
from qddot.runner.problem import Problem
from qddot.runner.result import Subject
from qddot.runner.simulate import Simulation, chosen_method, given_options
from qddot.runner.solution import Solution
from qddot.runner.tables import Quantity
from qddot.runner.takers import fitted


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
    **options: Unpack[OptionKeywords],
) -> Solution:
    """Integrate x' = rhs for any jitted function of the calling convention, rhs(t, x, u, c, dx), from x0 (n,).

    mass_matrix (n, n): M x' = rhs instead, M constant and possibly singular (an index-1 DAE; stiff methods only).
    constants: c. inputs: the channels of u, signals or numbers, in order; u has at least one element. A function is
    called once with arrays of exactly these sizes and bounds checks, see `first_call`: that covers the branch which t0
    and x0 take, others index unchecked.
    state_names: x_1, x_2, ... by default; the inputs are u_1, u_2, ... Otherwise as `simulate`.
    """
    chosen = chosen_method(method)
    settings = fitted(given_options(step, options), chosen)
    t0, t1 = span_of(span, chosen, settings)
    x = row("x0", x0)
    if not x.size:
        raise ValueError(f"x0 is {shown(x0)}, expected a row of finite numbers, one for each state")
    settings.tolerances(x.size)
    if isinstance(inputs, str | Mapping | Signal) or not isinstance(inputs, Sequence | np.ndarray):
        raise ValueError(f"inputs is {shown(inputs)}, expected a list of signals or numbers, one for each channel of u")
    signals = [as_signal(f"inputs[{i}]", value) for i, value in enumerate(inputs)]
    names = _names_of_states(state_names, x.size, [f"u_{i + 1}" for i in range(len(signals))])
    c = row("constants", constants)
    table = stack(signals, [0] * len(signals))
    M = None if mass_matrix is None else _mass_matrix(mass_matrix, x.size, chosen)
    if jacobian is not None and not chosen.stiff:
        raise ValueError(f"method {chosen.name} uses no jacobian; leave it out, or choose {_stiff_methods()}")
    problem = Problem(rhs, t0, t1, x, c, table, len(signals), names, jacobian, M)
    subject = Subject(
        name=getattr(rhs, "__name__", "rhs"),
        states=tuple(Quantity(name, "", "") for name in names),
        inputs=tuple(Quantity(f"u_{i + 1}", "", "") for i in range(len(signals))),
        headlines={"states": names, "inputs": tuple(f"u_{i + 1}" for i in range(len(signals)))},
    )
    check_first_calls(problem, settings)
    return Simulation(subject, problem, chosen, settings, None)(on_failure=on_failure)


def _names_of_states(names: Sequence[str] | None, n: int, taken: Sequence[str]) -> tuple[str, ...]:
    """Names of n states, x_1, x_2, ... by default; ValueError where two columns of the solution would have one name."""
    if names is None:
        return tuple(f"x_{i + 1}" for i in range(n))
    if isinstance(names, str) or not isinstance(names, Sequence | np.ndarray) or not all(map(_is_name, names)):
        raise ValueError(f"state_names is {shown(names)}, expected {n} names")
    if len(names) != n:
        raise ValueError(f"state_names has {len(names)} names for {n} states")
    known = {"t", "time", *taken}
    for i, name in enumerate(names):
        if name in known or name in names[:i]:
            whose = "another state" if name in names[:i] else "an input" if name in taken else "time"
            raise ValueError(f"state_names[{i}] is {name!r}, the name of {whose}; expected {n} different names")
    return tuple(map(str, names))


def _is_name(name: object) -> bool:
    return isinstance(name, str) and bool(name)


def _mass_matrix(mass_matrix: ArrayLike, n: int, method: Method) -> NDArray[np.float64]:
    M = numbers("mass_matrix", mass_matrix, f"({n}, {n}) finite numbers")
    if M.shape != (n, n) or not np.isfinite(M).all():
        raise ValueError(f"mass_matrix has shape {M.shape}, expected ({n}, {n}) finite numbers")
    if not method.stiff:
        raise ValueError(
            f"method {method.name} takes no mass matrix; there are {_stiff_methods()}, or solve for x' in rhs"
        )
    return M


def _stiff_methods() -> str:
    return ", ".join(name for name, each in METHODS.items() if each.stiff)
