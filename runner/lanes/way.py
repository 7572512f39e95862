"""Which way many runs of one method go: the one place that chooses."""

from typing import Literal

from qddot.runner.lanes.kernel import lane_rhs
from qddot.runner.load import Model
from qddot.runner.method import Method
from qddot.runner.options import TABLE, Options

#: In SIMD lanes; each by its own matrices, on all threads; one by one.
Way = Literal["lanes", "exact", "alone"]

#: Methods that run in lanes.
IN_LANES = ("euler", "heun", "midpoint", "rk4", "ode23", "ode45", "tsit5", "dop853", "vern7")


def way_of(model: Model, method: Method, options: Options) -> tuple[Way, str]:
    """The way of runs of this model, method and options; and why they do not go in lanes, nothing where they do."""
    for name, option in TABLE.items():
        if not (option.many or option.sampled) and getattr(options, name) not in (None, option.default):
            return "alone", f"option {name} is one of a single run"
    if method.family == "exact":
        return "exact", "exact propagation takes every run by its own matrices, on all threads"
    if method.name not in IN_LANES:
        return "alone", f"method {method.name} does not run in lanes; {', '.join(IN_LANES)} do"
    if model.tables.projected:
        return (
            "alone",
            f"model {model.name} has constraints, on which each run is kept by itself; Baumgarte's run in lanes",
        )
    if lane_rhs(model) is None:
        return "alone", f"model {model.name} has no lane kernel: it calls a function without vectors"
    return "lanes", ""
