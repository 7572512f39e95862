"""From runs to a picture: which quantities stand in which panel, nothing drawn twice, nothing left out unsaid."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from qddot.runner.checks import unknown
from qddot.runner.pictures.panel import Line, panel_of
from qddot.runner.pictures.picture import Panel, Picture
from qddot.runner.tables import Quantity
from qddot.words import counted

#: The most curves of a panel and the most panels where nobody chose them.
CROWD, TALL = 6, 12
#: How close two quantities are throughout that are one, relative to the largest value.
_SAME = 1e-12
#: Inputs run over each other: a road under five axles.
INPUTS = "inputs"
#: How the names of reactions begin.
REACTION = "reaction_"
#: What single constraints carry, which is not determined where these are redundant: see `undetermined`.
MULTIPLIERS = "multipliers"


class Shown(Protocol):
    """What a picture shows of a run, its quantities by name; some of them are 0 throughout, and some are others."""

    @property
    def t(self) -> NDArray[np.float64]:
        """Times (n,), s."""

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the quantities."""

    def quantity(self, name: str) -> Quantity:
        """Name, unit and meaning."""

    def __getitem__(self, name: str) -> NDArray[np.float64]:
        """Values (n,)."""


Choice = Sequence[str | Sequence[str]]
Headlines = Mapping[str, Sequence[str]]


def run_picture(
    run: Shown, headlines: Headlines, title: str = "", panels: Choice = (), from_start: Sequence[str] = ()
) -> Picture:
    """The picture of a run: these panels, each a name or several, or else coordinates, outputs and inputs by unit.

    headlines: kind -> names that a person looks at first. from_start: those that are shown as change since the start;
    where none are, a panel shows it whose offsets would flatten the rest.
    Raises ValueError with the nearest name for one that the run does not have.
    """
    refuse_unknown([*flat(panels), *from_start], run.names)
    inputs = set(headlines.get(INPUTS, ()))
    groups, notes = (
        ([[each] if isinstance(each, str) else list(each) for each in panels], [])
        if panels
        else default(run, headlines)
    )
    notes += _gaps(run, headlines, [name for group in groups for name in group])
    twins = {} if panels else duplicates(run, headlines)
    since = from_start or None

    def line(name: str) -> Line:
        quantity = run.quantity(name)
        called = " = ".join([*twins.get(name, ()), name])
        return Line(run.t, run[name], called, quantity.unit, quantity.meaning)

    made = [panel_of([line(name) for name in group], since, inputs.issuperset(group)) for group in groups]
    return Picture(title, tuple(made), notes=tuple(notes))


def default(run: Shown, headlines: Headlines) -> tuple[list[list[str]], list[str]]:
    """Groups of names, by kind and unit, and what is said of those that are in none."""
    twins = {twin for names in duplicates(run, headlines).values() for twin in names}
    groups: dict[tuple[str, str], list[str]] = {}
    still, nowhere = [], [name for name, there in undetermined(run, headlines).items() if there.all()]
    for kind, names in headlines.items():
        for name in (name for name in names if name in run.names and name not in (*twins, *nowhere)):
            if kind == INPUTS and not run[name].any():
                still.append(name)
            else:
                groups.setdefault((kind, run.quantity(name).unit), []).append(name)
    notes = [f"0 throughout, not drawn: {', '.join(still)}"] if still else []
    notes += [f"undetermined throughout, not drawn: {', '.join(nowhere)}"] if nowhere else []
    found = [list(part) for names in groups.values() for part in _parts(names)]
    return found[:TALL], notes + _left_out(name for group in found[TALL:] for name in group)


def undetermined(run: Shown, headlines: Headlines) -> dict[str, NDArray[np.bool_]]:
    """Multiplier -> at which points (n,) it is not determined, of those that are not determined somewhere.

    There the constraints are redundant: what they do together, the reactions, is known, and what each does is not.
    """
    reactions = [name for name in run.names if name.startswith(REACTION)]
    known = np.all([np.isfinite(run[name]) for name in reactions], axis=0) if reactions else True
    found = {name: np.isnan(run[name]) & known for name in headlines.get(MULTIPLIERS, ()) if name in run.names}
    return {name: there for name, there in found.items() if there.any()}


def _gaps(run: Shown, headlines: Headlines, drawn: Sequence[str]) -> list[str]:
    """What is said of multipliers that are drawn with gaps, or not at all though somebody chose them."""
    found = [name for name in undetermined(run, headlines) if name in drawn]
    return [f"undetermined where there is no line: {', '.join(found)}"] if found else []


def duplicates(run: Shown, headlines: Headlines) -> dict[str, list[str]]:
    """Name -> names of later kinds of quantities that are the same throughout: q_6 -> [heave]."""
    found: dict[str, list[str]] = {}
    seen: list[tuple[str, str]] = []
    for kind, names in headlines.items():
        for name in (name for name in names if name in run.names):
            first = next((old for other, old in seen if other != kind and _same(run, old, name)), None)
            if first is not None:
                found.setdefault(first, []).append(name)
            else:
                seen.append((kind, name))
    return found


def _same(run: Shown, one: str, other: str) -> bool:
    if run.quantity(one).unit != run.quantity(other).unit:
        return False
    a, b = run[one], run[other]
    with np.errstate(invalid="ignore"):
        largest = np.abs(a[np.isfinite(a)]).max(initial=0.0)
        return bool(largest > 0 and np.allclose(a, b, rtol=0.0, atol=_SAME * largest, equal_nan=True))


def _parts(names: Sequence[str]) -> Iterable[Sequence[str]]:
    """Names in panels of nearly one size, none of more than a crowd."""
    count = -(-len(names) // CROWD)
    ends = [round(k * len(names) / count) for k in range(count + 1)]
    return [names[start:end] for start, end in pairwise(ends)]


def _left_out(names: Iterable[str]) -> list[str]:
    left = list(names)
    if not left:
        return []
    shown = ", ".join(left[:8]) + (", …" if len(left) > 8 else "")
    return [f"not drawn: {counted(len(left), 'quantity')} more, {shown}; name those that should be"]


def flat(panels: Choice) -> list[str]:
    """The names of all panels."""
    return [name for each in panels for name in ([each] if isinstance(each, str) else each)]


def refuse_unknown(names: Iterable[str], known: Sequence[str]) -> None:
    """Raise ValueError, with the nearest name, for one that is not known."""
    for name in names:
        if name not in known:
            raise ValueError(unknown("quantity", name, known))


def runs_picture(runs: Mapping[str, tuple[Shown, Headlines]], title: str, names: Sequence[str] = ()) -> Picture:
    """Runs over each other, by what they are called: a panel for each quantity, one curve for each run that has it.

    Raises ValueError with the nearest name for one that no run has.
    """
    known = list(dict.fromkeys(name for run, _ in runs.values() for name in run.names))
    refuse_unknown(names, known)
    looked_at = list(dict.fromkeys(name for run, head in runs.values() for name in _looked_at(run, head)))
    chosen = list(names) or looked_at[:TALL]
    notes = [] if names else _left_out(looked_at[TALL:])
    panels = [replace(_of_runs(runs, name), legend=not k) for k, name in enumerate(chosen)]
    for name in chosen:
        having = [called for called, (run, _) in runs.items() if name in run.names]
        notes += [f"{name}: of {', '.join(having)} alone"] if len(having) < len(runs) else []
    return Picture(title, tuple(panels), notes=tuple(notes))


def _looked_at(run: Shown, headlines: Headlines) -> list[str]:
    twins = {twin for names in duplicates(run, headlines).values() for twin in names}
    named = [name for names in headlines.values() for name in names if name in run.names and name not in twins]
    return [name for name in named if run[name].any()] or list(run.names)


def _of_runs(runs: Mapping[str, tuple[Shown, Headlines]], name: str) -> Panel:
    lines: list[Line] = []
    for k, (called, (run, headlines)) in enumerate(runs.items()):
        if name in run.names:
            quantity, twins = run.quantity(name), duplicates(run, headlines).get(name, ())
            both = " = ".join([*twins, name]) if not lines else lines[0].name
            lines.append(
                Line(run.t, run[name], both, quantity.unit, quantity.meaning, called, colour=k, dashed=k % 2 == 1)
            )
    return panel_of(lines, None)


def batch_picture(
    t: NDArray[np.float64],
    samples: Mapping[Quantity, NDArray[np.float64]],
    title: str,
    numbers: Sequence[int],
    apart: bool = False,
) -> Picture:
    """Samples (runs, n) of each quantity at t (runs, n): a curve for each run, or the median and a band over many.

    numbers: of the runs. apart: a curve for each, however many.
    """
    many = len(t) > CROWD and not apart and bool((t == t[:1]).all())
    shown = range(len(t) if apart or many else min(len(t), CROWD))

    def lines(quantity: Quantity, values: NDArray[np.float64]) -> list[Line]:
        name, unit, meaning = quantity.name, quantity.unit, quantity.meaning
        if many:
            low, middle, high = _quantiles(values)
            return [Line(t[0], middle, name, unit, meaning, f"median and 90 % of {len(t)} runs", 0, (low, high))]
        return [Line(t[k], values[k], name, unit, meaning, f"run {numbers[k]}", k) for k in shown]

    panels = tuple(panel_of(lines(quantity, values), None) for quantity, values in samples.items())
    left = f"not drawn: {counted(len(t) - len(shown), 'run')} more, at other times; choose runs to see them"
    return Picture(title, panels, notes=(left,) if len(shown) < len(t) else ())


def _quantiles(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """The 5 %, 50 % and 95 % quantile (3, n) of values (runs, n); NaN where no run got to."""
    found = np.full((3, values.shape[1]), np.nan)
    there = ~np.isnan(values).all(axis=0)
    found[:, there] = np.nanquantile(values[:, there], [0.05, 0.5, 0.95], axis=0)
    return found
