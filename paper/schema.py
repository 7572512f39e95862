"""What may stand in `studies/paper/paper.toml`: the settings of the sections, and the claims."""

from typing import Any, Literal

from pydantic import Field, model_validator

from qddot.toml import Reading, Real, StudyFile, Table, Whole

Verdict = Literal["holds", "rests on an assumption", "differs"]


class MethodSettings(Table):
    """A method with the settings of the paper, options of `simulate`."""

    method: str
    options: dict[str, Any]


class CostSettings(Table):
    """Section 3.2: the cost of an error below `limit` (a part of the displacement of `quantity`) at the times, s.

    paper: the paper's cases by its names of the methods. repeats: runs of which the quickest is timed.
    """

    study: StudyFile
    quantity: str
    times: tuple[Real, ...]
    limit: Real
    repeats: Whole = 5
    paper: dict[str, MethodSettings]


class FiringSettings(Table):
    """When to fire: shots at equal intervals (s), and the schedule of a burst.

    series: numbers of shots. quantities: what swings, by its largest change after the last shot, over `after` seconds;
    vibration_dose stands for the crew's comfort, see `paper.firing`. paper_interval: the paper's worst,
    paper_comfortable: its best. burst: the shots of the schedule that is optimized, burst_shortest and burst_longest
    the intervals allowed in it.
    """

    study: StudyFile
    first: Real
    shortest: Real
    longest: Real
    points: Whole
    series: tuple[Whole, ...]
    quantities: tuple[str, ...]
    after: Real
    paper_interval: Real
    paper_comfortable: Real
    burst: Whole
    burst_shortest: Real
    burst_longest: Real
    seed: Whole = 0


class DrivingSettings(Table):
    """Section 4: `roads` random roads, seeds from 0, over a distance (m), at speeds in km/h, with numbers of shots.

    first, interval: of the shots, s. more_speeds: tried for the permissible speed alone. quantity, road: the names of
    the hull's and the road's displacement. points: saved along the distance. shown: the seed that is drawn.
    """

    study: StudyFile
    quantity: str
    road: str
    speeds: tuple[Real, ...]
    more_speeds: tuple[Real, ...] = ()
    shots: tuple[Whole, ...]
    first: Real
    interval: Real
    distance: Real
    points: Whole = 801
    roads: Whole = Field(ge=1)
    shown: Whole = 0


class PhaseSettings(Table):
    """Two shots on rough ground: first and intervals are ranges, s, tried at `every` samples of `step`, s.

    The swing of the quantity is its largest change within `after` seconds from the second shot.
    """

    study: StudyFile
    set: dict[str, Any] = Field(default_factory=dict)
    quantity: str
    first: tuple[Real, Real]
    intervals: tuple[Real, Real]
    after: Real
    step: Real = 0.01
    every: Whole = 5


class Taken(Table):
    """What is taken of a run of a study, as in an identification."""

    study: StudyFile
    set: dict[str, Any] = Field(default_factory=dict)
    quantity: str
    change: bool = False
    measure: Reading = "greatest"
    after: Real | None = None
    before: Real | None = None
    at: Real | None = None


class Claim(Table):
    """Something the paper says that can be measured.

    where, says: figure or section, and its words. Either `number`, the name of a number that a section computes, or
    `run`. value: the paper's, in `unit`, times `scale` in the unit of the number; compared by `tolerance`, a part of
    it; or `least`, `most` where it names a bound. rests_on: the assumptions without which the number could not be
    computed. expected: the verdict of the last look, which a later change must not worsen unnoticed.
    """

    where: str
    says: str
    number: str | None = None
    run: Taken | None = None
    value: Real | None = None
    least: Real | None = None
    most: Real | None = None
    unit: str = ""
    scale: Real = 1.0
    tolerance: Real = 0.0
    rests_on: tuple[str, ...] = ()
    expected: Verdict
    remark: str = ""

    @model_validator(mode="after")
    def _complete(self) -> "Claim":
        if (self.number is None) == (self.run is None):
            raise ValueError("expected either number or run")
        if (self.value is None) == (self.least is None and self.most is None):
            raise ValueError("expected either value, or least, most or both")
        return self


class Paper(Table):
    """The reproduction of paper 2116: settings, assumptions by name with their words, claims by name."""

    title: str
    cost: CostSettings
    firing: FiringSettings
    drive: DrivingSettings
    phase: PhaseSettings
    assumptions: dict[str, str]
    claims: dict[str, Claim]

    @model_validator(mode="after")
    def _assumptions_named(self) -> "Paper":
        for name, claim in self.claims.items():
            for assumption in claim.rests_on:
                if assumption not in self.assumptions:
                    raise ValueError(f"claim {name} rests on {assumption!r}, which [assumptions] does not name")
        return self
