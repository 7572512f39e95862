"""All sections of paper 2116 computed, and the claims judged by them."""

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from qddot import load, modes
from qddot.paper.claims import Judged, judge, read
from qddot.paper.cost import Cost, cost
from qddot.paper.driving import Driving, driving
from qddot.paper.firing import Firing, firing
from qddot.paper.phase import Phase, phase
from qddot.paper.schema import Paper
from qddot.paper.studies import Studies
from qddot.paper.verification import BEST, Verification, verify

#: Makes what shows the progress of a section of this name.
Bar = Callable[[str], AbstractContextManager[Callable[[float], None]]]


@dataclass(frozen=True, eq=False)
class Reproduction:
    """What was computed, section by section, and the claims."""

    paper: Paper
    studies: Studies
    verification: Verification
    cost: Cost
    firing: Firing
    driving: Driving
    phase: Phase
    numbers: dict[str, float]
    claims: tuple[Judged, ...]


def reproduce(path: Path, bar: Bar, parameter_set: str | None = None) -> Reproduction:
    """Compute everything that `path`, a paper.toml, asks for; parameter_set: in place of that of all its studies."""
    paper, studies = read(path), Studies(path.parent, parameter_set)
    studies.study(paper.cost.study)  # refuses an unknown parameter set before anything is computed
    verification = verify()
    with bar("3.2 cost") as progress:
        costs = cost(paper.cost, studies, progress)
    with bar("3.2 firing") as progress:
        fired = firing(paper.firing, studies, progress)
    with bar("4 driving") as progress:
        driven = driving(paper.drive, studies, progress)
    rough = phase(paper.phase, studies)
    numbers = dict(_verified(verification)) | dict(_periods(studies.vehicle(paper.firing.study)))
    for section in (costs, fired, driven, rough):
        numbers |= section.numbers()
    claims = judge(paper, studies, numbers)
    return Reproduction(paper, studies, verification, costs, fired, driven, rough, numbers, claims)


def _verified(verification: Verification) -> Iterator[tuple[str, float]]:
    for row in verification.rows:
        yield f"verification.points.{row.scheme}", float(row.points)
        yield f"verification.largest_error.{row.scheme}", row.largest_error
    errors = {row.scheme: row.largest_error for row in verification.rows}
    yield "verification.ode15s_over_best", errors["ODE15S"] / max(errors[name] for name in BEST)
    yield "verification.ode23_over_ode15s", errors["ODE23"] / errors["ODE15S"]
    peaks = verification.peaks("Euler")
    yield "verification.euler_growth", float((peaks[1:] / peaks[:-1]).min())


def _periods(vehicle: str | None) -> Iterator[tuple[str, float]]:
    """Periods, s, of all parameter sets by name, and once more of that which the studies run with."""
    model = load("m113")
    for name, chosen in [*((name, name) for name in model.tables.parameter_sets), ("vehicle", vehicle)]:
        periods = [mode.damped_period for mode in modes(model, chosen) if np.isfinite(mode.damped_period)]
        for k, period in enumerate(sorted(periods, reverse=True), start=1):
            yield f"modes.{name}.period_{k}", period
            yield f"modes.{name}.half_period_{k}", 0.5 * period
