"""What a store says, read back: rows by name, failures with their reasons, the grid of its axes."""

from collections import Counter
from collections.abc import Collection
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from qddot.runner.batch.damage import ADVICE, Damage, damage_of
from qddot.runner.batch.outcome import NOT_RUN, REFUSED
from qddot.runner.batch.store import Store, read_array
from qddot.runner.checks import unknown
from qddot.runner.problem import Status
from qddot.runner.result import WHAT


def _readable(store: Store, name: str, unreadable: Collection[int]) -> NDArray[Any]:
    """The values of a result, those of blocks that cannot be read NaN or 0."""
    array, size = store.array(name), store.block
    values = np.full(array.shape, np.nan if array.dtype.kind == "f" else 0, dtype=array.dtype)
    for index in set(range(-(-len(values) // size))) - set(unreadable):
        values[index * size : (index + 1) * size] = read_array(array, index * size, (index + 1) * size)
    return values


@dataclass(frozen=True, eq=False)
class Results:
    """The results of a batch in the store at `path`, finished or not."""

    path: Path

    @cached_property
    def store(self) -> Store:
        """The store; StoreError where there is none."""
        return Store(self.path)

    @cached_property
    def damage(self) -> Damage:
        """What of the blocks is not as it was written; StoreError where something beside them is not."""
        return damage_of(self.store)

    @cached_property
    def data(self) -> Any:
        """The xarray.Dataset, whose values are read when they are asked for; what cannot be read is NaN, or 0."""
        import xarray  # noqa: PLC0415 - slow to import, and computing needs none

        unreadable = self.damage.unreadable
        data = xarray.open_zarr(self.path, consolidated=True, chunks=None)
        for name, blocks in unreadable.items():
            data[name] = data[name].copy(data=_readable(self.store, name, blocks))
        return data

    @cached_property
    def status(self) -> NDArray[np.int8]:
        """How each run ended (n_runs,): a Status, REFUSED or NOT_RUN.

        A run of a block that is not finished is NOT_RUN, whatever a process that was killed wrote of it, and so is one
        of a block that is damaged.
        """
        status = np.array(self.data["status"])
        sound = np.zeros(-(-len(status) // self.store.block), dtype=np.bool_)
        sound[sorted(self.store.finished() - self.damage.blocks.keys())] = True
        status[~np.repeat(sound, self.store.block)[: len(status)]] = NOT_RUN
        return status

    @property
    def damaged(self) -> str:
        """`damaged: block 3 (runs 12 to 15): travel; ...`, what of it and what to do; nothing where nothing is."""
        lines = self.damage.told(self.store.block, len(self.status))
        return f"damaged: {'; '.join(lines)}; {ADVICE}" if lines else ""

    @cached_property
    def partial(self) -> str:
        """`partial: 3712 of 10000 runs`; nothing where all runs are there."""
        done = int(np.count_nonzero(self.status != NOT_RUN))
        return f"partial: {done} of {len(self.status)} runs" if done < len(self.status) else ""

    @property
    def heading(self) -> str:
        """The title, and how far a batch is that is not finished."""
        return f"{self.title} ({self.partial})" if self.partial else self.title

    @property
    def title(self) -> str:
        """Title of the study."""
        return str(self.data.attrs["title"])

    @property
    def axes(self) -> tuple[str, ...]:
        """Names of the axes of the sweep."""
        return tuple(self.data.attrs["axes"])

    @property
    def metrics(self) -> tuple[str, ...]:
        """Names of the metrics, in the order of the study."""
        return tuple(self.data.attrs["metrics"])

    @property
    def kept(self) -> tuple[str, ...]:
        """Names of the trajectories that were kept."""
        return tuple(str(name) for name, each in self.data.items() if each.dims == ("run", "time"))

    @property
    def finished(self) -> NDArray[np.int64]:
        """The runs that reached their end."""
        return np.flatnonzero(self.status == Status.FINISHED)

    def failures(self) -> list[tuple[int, str, int]]:
        """(count, reason, first run) of the runs that did not reach their end, the most frequent reason first."""
        refused = {int(run): reason for note in self.store.notes() for run, reason in note["reasons"].items()}
        states, left = self.data["state"].to_numpy(), self.data["failed_state"].to_numpy()
        reasons: dict[int, str] = {}
        for run in np.flatnonzero((self.status != Status.FINISHED) & (self.status != NOT_RUN)):
            if self.status[run] == REFUSED:
                reasons[int(run)] = f"refused: {refused.get(int(run), 'no reason was written down')}"
            else:
                state = f", {states[left[run]]} first" if left[run] >= 0 else ""
                reasons[int(run)] = f"{WHAT[Status(self.status[run])]}{state}"
        counts = Counter(reasons.values())
        firsts = {reason: run for run, reason in reversed(reasons.items())}
        return [(count, reason, firsts[reason]) for reason, count in counts.most_common()]

    def column(self, name: str) -> NDArray[Any]:
        """A metric, NaN for runs without it, or an axis (n_runs,). Raises ValueError naming the nearest for others."""
        if name not in (*self.metrics, *self.axes):
            raise ValueError(f"{self.path}: {unknown('metric or axis', name, (*self.metrics, *self.axes))}")
        if name in self.axes:
            return self.data[name].to_numpy()
        return np.where(self.status == NOT_RUN, np.nan, self.data[name])

    def unit(self, name: str) -> str:
        """The unit of a column."""
        return str(self.data[name].attrs.get("units", ""))

    def best_first(self, name: str) -> NDArray[np.int64]:
        """The finished runs, from the best value of a metric to the worst; ties in the order of the runs."""
        values = self.column(name)[self.finished]
        sign = -1.0 if self.data[name].attrs.get("better") == "more" else 1.0
        known = np.isfinite(values)
        return self.finished[known][np.argsort(sign * values[known], kind="stable")]

    def setting(self, run: int) -> str:
        """The values of the axes in a run, `delay = 1.85 s, k_6 = 65000 N/m`; the run's number where they are many."""
        if not self.axes or len(self.axes) > 3:
            return f"run {run}"
        return ", ".join(f"{axis} = {self.text(axis, run)}" for axis in self.axes)

    def text(self, axis: str, run: int) -> str:
        """The value of an axis in a run, with its unit."""
        value = self.data[axis].to_numpy()[run]
        number = f"{value:.5g}" if isinstance(value, float | np.floating) else str(value)
        return f"{number} {self.unit(axis)}".rstrip()
