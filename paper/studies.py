"""Studies of the paper, with the parameter set that all of them are computed with."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from qddot import Study, read_study, reading
from qddot.paper.schema import Taken


@dataclass(frozen=True)
class Studies:
    """The studies of a folder by their file names; parameter_set: taken by all of them in place of their own."""

    folder: Path
    parameter_set: str | None = None

    def study(self, name: str, changes: Mapping[str, Any] | None = None) -> Study:
        """A study made ready to run, with these values by dotted key in place of its own."""
        own = {} if self.parameter_set is None else {"parameter_set": self.parameter_set}
        return read_study(self.folder / name, {**own, **(changes or {})})

    def number(self, taken: Taken) -> float:
        """What a claim takes of a run of its study."""
        solution = self.study(taken.study, taken.set).run()
        window = {"after": taken.after, "before": taken.before, "at": taken.at}
        return reading(solution, taken.quantity, taken.measure, change=taken.change, **window)

    def vehicle(self, name: str) -> str | None:
        """The parameter set that a study runs with."""
        return self.study(name).tables.parameter_set
