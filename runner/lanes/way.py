"""Which way many runs of one method go: the one place that chooses."""

from typing import Literal

from qddot.runner.lanes.kernel import form_of, lane_rhs
from qddot.runner.load import Model
from qddot.runner.method import Method
from qddot.runner.options import TABLE, Options

#: In SIMD lanes; each by its own matrices, on all threads; one by one.
Way = Literal["lanes", "exact", "alone"]

#: Methods that run in lanes.
IN_LANES = ("euler", "heun", "midpoint", "rk4", "ode23", "ode45", "tsit5", "dop853", "vern7", "taylor")

#: The largest tables of recurrences that are compiled for lanes: beyond, a run alone fills the vectors as well, in code
#: that is compiled in a fraction of the time (a pendulum of 24 links, a chain of 300 masses: 3 s beside 7 s).
MOST_NODES, MOST_UNKNOWNS = 400, 16


def way_of(model: Model, method: Method, options: Options) -> tuple[Way, str]:
    """The way of runs of this model, method and options; and why they do not go in lanes, nothing where they do."""
    for name, option in TABLE.items():
        if not (option.many or option.sampled) and getattr(options, name) not in (None, option.default):
            return "alone", f"option {name} is one of a single run"
    if method.family == "exact":
        return "exact", "exact propagation takes every run by its own matrices, on all threads"
    why = _why_alone(model, method)
    return ("alone", why) if why else ("lanes", "")


def _why_alone(model: Model, method: Method) -> str:
    if method.name not in IN_LANES:
        return f"method {method.name} does not run in lanes; {', '.join(IN_LANES)} do"
    if model.tables.projected:
        return f"model {model.name} has constraints, on which each run is kept by itself; Baumgarte's run in lanes"
    if model.tables.events:
        return f"model {model.name} has events that act, and each run stops at times of its own"
    if method.family == "taylor":
        return _why_no_series(model)
    if lane_rhs(model, form_of(model, method)) is None:
        return f"model {model.name} has no lane kernel: it calls a function without vectors"
    return ""


def _why_no_series(model: Model) -> str:
    """Why runs by Taylor's method go alone."""
    if not model.tables.recurrence:
        return f"model {model.name} has no recurrences"
    table = model.recurrences
    if table.multipliers:
        return f"model {model.name} has constraints, whose factors each run by taylor takes for itself"
    if table.sides:
        return f"model {model.name} has conditions, on which each run by taylor turns for itself"
    if len(table.nodes) > MOST_NODES or len(table.unknowns) > MOST_UNKNOWNS:
        return f"model {model.name} is so large that a run by taylor fills vectors alone"
    return ""
