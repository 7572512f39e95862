"""`method="auto"`: which method a run takes, by the structure of its model and by its stiffness at the start.

Nothing is timed: the same run takes the same method everywhere, and says why.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from qddot.runner.inputs.reader import evaluate, reader_for
from qddot.runner.inputs.signal import InputTable
from qddot.runner.method import Method
from qddot.runner.methods import METHODS as KNOWN
from qddot.runner.options import TABLE, Options
from qddot.runner.problem import FOREVER, Problem, Trajectory
from qddot.runner.sparse import LARGE, fastest, sparse_matrix
from qddot.runner.takers import fitted, taken

if TYPE_CHECKING:
    from qddot.runner.load import Model

#: The most states that matrix exponentials are faster for than steps.
MOST_EXACT = 40
#: A real, decaying eigenvalue makes a run stiff that is so many times as fast as all that moves otherwise, and decays
#: so often within the span: a method for it, but no other, may pass it over.
STIFF, DECAYS = 100.0, 1000.0
#: A series ends at every knot of a spline, Runge-Kutta methods do not: so many knots a radian of the fastest mode are
#: more than it would take steps.
KNOTS = 3.0
#: Below, vern7 takes so many steps that dop853 is faster.
TIGHT = 1e-10


def choose(model: "Model", problem: Problem, options: Options) -> tuple[Method, Options, str]:
    """The method of a run, its options, and why it is this one. options: as they are given, not yet fitted."""
    rtol = TABLE["rtol"].default if options.rtol is None else options.least_rtol
    runge_kutta = "vern7" if rtol >= TIGHT else "dop853"
    rates = _rates(model, problem)
    linear = model.tables.linear and not model.tables.contacts
    if _may(options, "exact") and linear and len(model.state_names) <= MOST_EXACT and problem.t1 < FOREVER:
        return _chosen("exact", options, "the model is linear")
    span = abs(problem.t1 - problem.t0)
    fast, slow = _fast_and_slow(rates, span)
    if _may(options, "rodas5p") and fast > STIFF * slow and fast * span > DECAYS:
        return _chosen("rodas5p", options, f"the start is stiff: {fast:.3g}/s beside {slow:.3g}/s")
    reason = _against_series(model, problem, lambda: rates)
    if reason or not _may(options, "taylor"):
        return _chosen(runge_kutta, options, reason or "of the options given")
    return _chosen("taylor", options, "the model is smooth, and not stiff at the start")


def _against_series(model: "Model", problem: Problem, rates: Callable[[], np.ndarray]) -> str:
    """Why a series is no way to run a model."""
    if not model.tables.recurrence:
        return f"{model.tables.without_recurrence or 'the model'} has no recurrence"
    if model.tables.contacts:
        return "contacts may come to rest"
    if model.tables.modes and model.tables.patterns["approach"].entries:
        return "conditions in velocities or internal states may slide"
    return _against_knots(problem, rates)


def _against_knots(problem: Problem, rates: Callable[[], np.ndarray]) -> str:
    """Why its inputs have too many knots for a series; rates: gives the eigenvalues at the start, 1/s."""
    knots = _knots(problem)
    if knots <= KNOTS:
        return ""
    turns = abs(problem.t1 - problem.t0) * np.abs(rates()).max(initial=0.0)  # of the fastest mode, rad
    return f"the inputs have {knots} knots" if knots > KNOTS * turns else ""


def choose_for_many(
    model: "Model", options: Options, by_series: Callable[[], Problem] | None
) -> tuple[Method, Options, str]:
    """The same for many runs at once, which differ in inputs, parameters and starts.

    by_series: gives the run that has the most to lose by a series, whose steps end where pieces of inputs do; None
    where runs by Taylor's method do not go in lanes.
    """
    linear = model.tables.linear and not model.tables.contacts
    if _may(options, "exact") and linear and len(model.state_names) <= MOST_EXACT:
        return _chosen("exact", options, "the model is linear")
    reason = ""
    if by_series and _may(options, "taylor"):
        problem = by_series()
        reason = _against_knots(problem, partial(_rates, model, problem))
        if not reason:
            return _chosen("taylor", options, "the model is smooth, and many runs go in lanes")
    rtol = TABLE["rtol"].default if options.rtol is None else options.least_rtol
    return _chosen("vern7" if rtol >= TIGHT else "dop853", options, reason or "many runs go in lanes")


def _chosen(name: str, options: Options, reason: str) -> tuple[Method, Options, str]:
    method = KNOWN[name]
    if method.family == "exact":  # whose error is smaller than any tolerance
        options = replace(options, rtol=None, atol=None)
    return method, fitted(options, method), reason


def _may(options: Options, name: str) -> bool:
    """Whether a method takes all that is given; a tolerance asks exact propagation for no more than it does."""
    method = KNOWN[name]
    own = {*taken(method), *(("rtol", "atol") if method.family == "exact" else ())}
    return all(option in own or getattr(options, option) is None for option in TABLE)


def _rates(model: "Model", problem: Problem) -> np.ndarray:
    """The eigenvalues of the Jacobian at the start, 1/s, of many states the outermost; zero where it is not finite."""
    inputs, t = problem.inputs, float(problem.t0)
    u = np.zeros(max(1, len(inputs.first)))
    evaluate(inputs, reader_for(inputs), t, t, len(inputs.first), u)
    matrix, point = model.matrix("jacobian"), (t, np.array(problem.initial_state), u, problem.constants)
    if len(model.state_names) < LARGE:
        J = matrix(*point)
        return np.linalg.eigvals(J) if np.isfinite(J).all() else np.zeros(1)
    sparse = sparse_matrix(matrix, *point)
    return fastest(sparse) if np.isfinite(sparse.data).all() else np.zeros(1)


def _fast_and_slow(rates: np.ndarray, span: float) -> tuple[float, float]:
    """The fastest decay without swinging, and the fastest of all that is not as fast by far, or one over the span."""
    decays = -rates.real >= np.abs(rates.imag)
    fast = float(-rates.real[decays].min(initial=0.0, where=rates.real[decays] < 0))
    others = np.abs(rates[~decays | (np.abs(rates) * STIFF <= fast)])
    return fast, max(float(others.max(initial=0.0)), 1.0 / span if span > 0 else 0.0)


def _knots(problem: Problem) -> int:
    """Ends of pieces within the span that are no breakpoints: those of splines."""
    table: InputTable = problem.inputs
    ends = set()
    for i in range(problem.n_inputs):
        rate = table.rate[i]
        if rate != 0.0:
            starts = (table.pieces[table.first[i] + 1 : table.last[i] + 1, 0] - table.offset[i]) / rate
            low, high = sorted((problem.t0, problem.t1))
            ends.update(starts[(starts > low) & (starts < high)].tolist())
    return len(ends.difference(table.breakpoints.tolist()))


def _integrate(problem: Problem, method: Method, options: Options) -> Trajectory:
    raise ValueError("method auto chooses by what a generated model says of itself; for a function, name the method")


METHODS = (
    Method(
        name="auto",
        family="auto",
        order=0,
        stages=0,
        adaptive=True,
        stiff=False,
        citation="exact, taylor, vern7, dop853 or rodas5p, by structure and stiffness at the start",
        integrate=_integrate,
    ),
)
