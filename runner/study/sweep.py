"""The runs of a sweep: run i is computed from i, so that a hundred thousand cost nothing before they are run."""

import math
import re
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from qddot.runner.study.axes import Axis, axis_of
from qddot.runner.study.batch_schema import AxisTable, SweepTable

#: What no axis may change: it would make runs of different states, lengths or measures.
FIXED = ("model", "span", "title", "figure", "sweep", "metrics", "outputs")
#: The most runs of a batch.
MOST_RUNS = 100_000_000


@dataclass(frozen=True, eq=False)
class Sweep:
    """Axes in their order, and the groups that advance together: (places of axes, number of values)."""

    axes: tuple[Axis, ...]
    groups: tuple[tuple[tuple[int, ...], int], ...]

    def __len__(self) -> int:
        """How many runs there are: 1 without axes."""
        return math.prod(size for _, size in self.groups)

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of values of each group; the last group advances fastest."""
        return tuple(size for _, size in self.groups)

    def indices(self, runs: NDArray[np.int64]) -> list[NDArray[np.int64]]:
        """For each axis the places (n,) of its values in these runs (n,)."""
        places: list[Any] = [None] * len(self.axes)
        for (members, _), digits in zip(self.groups, np.unravel_index(runs, self.shape or (1,)), strict=False):
            for member in members:
                places[member] = digits
        return places

    def changes(self, run: int) -> dict[str, Any]:
        """What stands in the study of this run, by dotted key. Raises IndexError where there is no such run."""
        if not 0 <= run < len(self):
            raise IndexError(f"run {run}: the runs are 0 to {len(self) - 1}")
        places = self.indices(np.array([run]))
        chosen = ((axis, axis.setting(int(place[0]))) for axis, place in zip(self.axes, places, strict=True))
        return {key: setting for axis, setting in chosen for key in axis.keys}

    def coordinate(self, axis: int) -> NDArray[Any]:
        """Values (n_runs,) of an axis in all runs: numbers in its unit, or labels."""
        return self.axes[axis].values[self.indices(np.arange(len(self)))[axis]]


def sweep_of(table: SweepTable) -> Sweep:
    """The sweep in this table. Raises ValueError that begins with the key it is about, "sweep.axes.0.linspace: "."""
    axes: list[Axis] = []
    for i, (each, name) in enumerate(zip(table.axes, _names(table.axes), strict=True)):
        try:
            axes.append(axis_of(each, name))
        except ValueError as error:
            raise ValueError(f"sweep.axes.{i}.{error}") from None
    _check_keys(axes)
    axes = _drawn(axes, table)
    members: dict[Any, list[int]] = {}
    for i, axis in enumerate(axes):
        members.setdefault(axis.group if axis.group is not None else i, []).append(i)
    groups = tuple((tuple(places), len(axes[places[0]].values)) for places in members.values())
    for places, size in groups:
        for place in places:
            if len(axes[place].values) != size:
                raise ValueError(
                    f"sweep.axes.{place}.zip: {axes[place].name} has {len(axes[place].values)} values, but "
                    f"{axes[places[0]].name}, which advances with it, has {size}"
                )
    sweep = Sweep(tuple(axes), groups)
    if len(sweep) > MOST_RUNS:
        raise ValueError(f"sweep: {len(sweep)} runs; at most {MOST_RUNS} work")
    return sweep


def described(sweep: Sweep, run: int) -> str:
    """` (run 3 of the sweep: m_6 = 9000 kg)`; nothing where there is no sweep."""
    if not sweep.axes:
        return ""
    settings_of_it = ", ".join(f"{key} = {value}" for key, value in sweep.changes(run).items())
    return f" (run {run} of the sweep: {settings_of_it})"


def _names(axes: Sequence[AxisTable]) -> list[str]:
    """The given names; else the end of the first key, or all of it where two ends are alike."""
    keys = [(table.key if isinstance(table.key, str) else "+".join(table.key[:1])) for table in axes]
    ends = [key.split(".", 1)[-1] for key in keys]
    return [
        table.name or (end if ends.count(end) == 1 else key) for table, end, key in zip(axes, ends, keys, strict=True)
    ]


def _check_keys(axes: Sequence[Axis]) -> None:
    seen: dict[str, int] = {}
    names: set[str] = set()
    for i, axis in enumerate(axes):
        if axis.name in names or axis.name in RESERVED or not re.fullmatch(r"[^\s/]+", axis.name):
            why = "has another meaning in the results" if axis.name in RESERVED else "has blanks or slashes in it"
            why = "stands twice" if axis.name in names else why
            raise ValueError(f"sweep.axes.{i}.name: {axis.name!r} {why}; choose another")
        names.add(axis.name)
        for key in axis.keys:
            if key.split(".")[0] in FIXED or not all(key.split(".")):
                raise ValueError(
                    f"sweep.axes.{i}.key: {key!r} cannot be varied; {', '.join(FIXED)} are the batch's own"
                )
            for other, place in seen.items():
                if key == other or key.startswith(f"{other}.") or other.startswith(f"{key}."):
                    raise ValueError(f"sweep.axes.{i}.key: {key!r} is set by axis {place} already ({other!r})")
            seen[key] = i


#: Names of the results beside axes and metrics.
RESERVED = (
    "run", "block", "time", "status", "failed_at", "failed_state", "steps", "evaluations", "final_state", "state"
)  # fmt: skip


def _drawn(axes: Sequence[Axis], table: SweepTable) -> list[Axis]:
    """The axes with the values of the sampled ones."""
    sampled = [i for i, axis in enumerate(axes) if axis.distribution is not None]
    if bool(sampled) != (table.samples is not None):
        raise ValueError(
            "sweep.samples: missing; how many points the sampled axes take"
            if sampled
            else "sweep.samples: no axis is sampled; give one uniform, loguniform, normal or integers"
        )
    if not sampled:
        for key in ("sampling", "seed"):
            if key in table.model_fields_set:
                raise ValueError(f"sweep.{key}: no axis is sampled; leave it out")
        return list(axes)
    count = table.samples or 0
    if not 1 <= count <= MOST_RUNS:
        raise ValueError(f"sweep.samples: {count}; expected a number from 1 to {MOST_RUNS}")
    points = _points(table.sampling, count, len(sampled), table.seed)
    drawn = list(axes)
    for column, i in enumerate(sampled):
        drawn[i] = replace(axes[i], values=_spread(points[:, column], axes[i].distribution))
    return drawn


def _points(sampling: str, count: int, dimensions: int, seed: int) -> NDArray[np.float64]:
    """Points (count, dimensions) of the unit cube."""
    from scipy.stats import qmc  # noqa: PLC0415 - slow to import, and most sweeps need none

    if seed < 0:
        raise ValueError(f"sweep.seed: {seed}; expected 0 or more")
    if sampling == "random":
        return np.random.default_rng(seed).random((count, dimensions))
    engines = {"latin_hypercube": qmc.LatinHypercube, "sobol": qmc.Sobol, "halton": qmc.Halton}
    with warnings.catch_warnings():  # a count that is no power of 2 is the user's choice
        warnings.simplefilter("ignore")
        return engines[sampling](dimensions, rng=np.random.default_rng(seed)).random(count)


def _spread(points: NDArray[np.float64], distribution: Any) -> NDArray[Any]:
    """Values of the distribution (name, a, b) at these probabilities (n,)."""
    name, a, b = distribution
    if name == "uniform":
        return a + (b - a) * points
    if name == "loguniform":
        return np.exp(np.log(a) + (np.log(b) - np.log(a)) * points)
    if name == "integers":
        return np.minimum(np.floor(a + (b - a) * points), b - 1).astype(np.int64)
    from scipy.special import ndtri  # noqa: PLC0415 - slow to import, and most sweeps need none

    return a + b * ndtri(np.clip(points, 1e-300, 1 - 1e-16))
