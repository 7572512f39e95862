"""What may stand in an identification: unknowns, scenarios, and what was observed in each."""

from typing import Any

from pydantic import Field, model_validator

from qddot.runner.metrics.reading import Reading
from qddot.runner.study.base import Real, Table, Whole
from qddot.runner.study.checked import StudyFile


class Unknown(Table):
    """A number to be found: the key or keys of a study that it sets, where the search starts, and its bounds.

    All numbers are in the unit that the key has in the study; `unit` and `meaning` are for people.
    """

    key: str | tuple[str, ...]
    start: Real
    lower: Real
    upper: Real
    unit: str = ""
    meaning: str = ""

    @model_validator(mode="after")
    def _ordered(self) -> "Unknown":
        if not self.lower < self.upper or not self.lower <= self.start <= self.upper:
            raise ValueError(f"expected lower <= start <= upper, found {self.lower}, {self.start}, {self.upper}")
        return self

    @property
    def keys(self) -> tuple[str, ...]:
        """The keys that it sets."""
        return (self.key,) if isinstance(self.key, str) else self.key


class Observation(Table):
    """What was seen of one quantity: a number (value), or a curve (t and values, or a CSV file).

    file: a CSV file beside the identification; columns: its times and values, by heading or place from 0. Units in its
    heading are converted; columns without one are taken as s and as the quantity's unit.
    sigma: its standard error, in the quantity's unit. change: of the quantity minus its value at the start of the run.
    measure, after, before, at: of a number, what is taken of the run, and where in it, s. source: who says so.
    """

    quantity: str
    sigma: Real = Field(gt=0)
    change: bool = False
    source: str = ""
    value: Real | None = None
    measure: Reading = "greatest"
    after: Real | None = None
    before: Real | None = None
    at: Real | None = None
    t: tuple[Real, ...] | None = None
    values: tuple[Real, ...] | None = None
    file: str | None = None
    columns: tuple[str | Whole, str | Whole] = (0, 1)

    @model_validator(mode="after")
    def _one_kind(self) -> "Observation":
        given = [self.value is not None, self.t is not None and self.values is not None, self.file is not None]
        if sum(given) != 1:
            raise ValueError("expected either value, or t and values, or file")
        if self.t is not None and (len(self.t) != len(self.values or ()) or len(self.t) < 1):
            raise ValueError(f"t has {len(self.t)} numbers and values {len(self.values or ())}, expected as many")
        if self.value is not None and (self.measure == "at") != (self.at is not None):
            raise ValueError('`at` is a time, given with measure = "at" and with no other')
        if self.value is None and (idle := self.model_fields_set & {"measure", "after", "before", "at"}):
            raise ValueError(f"a curve is compared point by point and takes no {', '.join(sorted(idle))}")
        if self.file is None and "columns" in self.model_fields_set:
            raise ValueError("`columns` are those of a file, which is not given")
        return self


class Scenario(Table):
    """One run: the study with `set`, values by dotted key, in place of its own, and what was observed."""

    name: str
    set: dict[str, Any] = Field(default_factory=dict)
    study: StudyFile | None = None
    observations: tuple[Observation, ...] = Field(min_length=1)


class Identification(Table):
    """Unknowns to be fitted to the observations of one or several scenarios of a study.

    name: of the parameter set that is written. starts: the search starts at `start` and at this many points less one
    of a Latin hypercube within the bounds (seed), and the best end counts.
    """

    title: str
    name: str = Field(pattern=r"^[A-Za-z][A-Za-z0-9_]*$")
    study: StudyFile
    unknowns: dict[str, Unknown] = Field(min_length=1)
    scenarios: tuple[Scenario, ...] = Field(min_length=1)
    starts: Whole = Field(default=1, ge=1)
    seed: Whole = 0
