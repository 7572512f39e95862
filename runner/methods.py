"""The table of integration methods by name; a family is imported when one of its methods is first asked for."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING, Any

from qddot.runner.checks import shown, unknown
from qddot.runner.options import Options
from qddot.runner.problem import Problem, Trajectory

if TYPE_CHECKING:
    from qddot.runner.explicit.tableau import ButcherTableau
    from qddot.runner.explicit.tableau_adaptive import EmbeddedPair


@dataclass(frozen=True, eq=False)
class Method:
    """One integration method. integrate(problem, method, options) -> Trajectory runs it.

    family: "fixed", "adaptive", "stiff" or "exact" (order 0: no error but rounding). stages: of one step, 0 for
    multistep methods. tableau: of explicit Runge-Kutta methods, None for others. pair: of adaptive ones, the tableau
    with error estimate and dense output.
    """

    name: str
    family: str
    order: int
    stages: int
    adaptive: bool
    stiff: bool
    citation: str
    integrate: Callable[[Problem, "Method", Options], Trajectory]
    tableau: "ButcherTableau | None" = None
    pair: "EmbeddedPair | None" = None

    def __reduce__(self) -> Any:
        """A method of the table is pickled by its name."""
        known = self.name in _HOMES and METHODS[self.name] is self
        return (find_method, (self.name,)) if known else super().__reduce__()


#: Name -> the module whose METHODS hold the method; a new method is its name here and its line there.
_HOMES = {
    **dict.fromkeys(("euler", "heun", "midpoint", "rk4"), "qddot.runner.explicit.fixed_methods"),
    **dict.fromkeys(("ode23", "ode45", "tsit5", "dop853", "vern7"), "qddot.runner.explicit.adaptive_methods"),
    **dict.fromkeys(("ode15s", "rodas5p"), "qddot.runner.stiff.methods"),
    "exact": "qddot.runner.exact.methods",
}


class _Methods(Mapping[str, Method]):
    """Name -> method, read-only; looking one up imports its family, and compiles nothing."""

    def __getitem__(self, name: str) -> Method:
        found = {method.name: method for method in import_module(_HOMES[name]).METHODS}
        return found[name]

    def __iter__(self) -> Iterator[str]:
        return iter(_HOMES)

    def __len__(self) -> int:
        return len(_HOMES)


METHODS: Mapping[str, Method] = _Methods()


def methods() -> Mapping[str, Method]:
    """All integration methods by name; see `Method` for what is known of each."""
    return METHODS


def find_method(name: str) -> Method:
    """The method of this name; raises ValueError with the nearest name that exists."""
    if not isinstance(name, str):
        raise ValueError(f"method is {shown(name)}, expected a method's name, such as 'rk4'")
    if name in _HOMES:
        return METHODS[name]
    raise ValueError(unknown("method", name, METHODS))
