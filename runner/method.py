"""What an integration method is to those who run it: its record."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from qddot.runner.problem import Trajectory
from qddot.runner.tableaux.butcher import ButcherTableau
from qddot.runner.tableaux.embedded import EmbeddedPair
from qddot.words import counted


@dataclass(frozen=True, eq=False)
class Method:
    """One integration method. integrate(problem, method, options, recorder=None) -> Trajectory runs it.

    A run with a recorder hands over its pieces (see `frame.pieces`) and saves nothing.

    family: "fixed", "adaptive", "stiff", "exact" (order 0: no error but rounding), "taylor" (order: the highest) or
    "auto". stages: of a step of Runge-Kutta methods, 0 for others. tableau: of explicit ones, None for others. pair: of
    adaptive ones, the tableau with error estimate and dense output. find: gives it by its name, which is all that is
    pickled of a method that has one.
    """

    name: str
    family: str
    order: int
    stages: int
    adaptive: bool
    stiff: bool
    citation: str
    integrate: Callable[..., Trajectory]
    tableau: ButcherTableau | None = None
    pair: EmbeddedPair | None = None
    find: Callable[[str], "Method"] | None = None

    def __repr__(self) -> str:
        """Family, order, stages, source."""
        stages = f", {counted(self.stages, 'stage')}" if self.stages else ""
        return f"<Method {self.name}: {self.family}, order {self.order}{stages}; {self.citation}>"

    def __reduce__(self) -> Any:
        """A method of the table is pickled by its name."""
        return (self.find, (self.name,)) if self.find is not None else super().__reduce__()
