"""What a batch of runs gives back: arrays over runs, by name as on the solution of one run."""

import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from qddot.extras import needed
from qddot.runner import notebook
from qddot.runner.checks import unknown, whole
from qddot.runner.pictures.arrange import batch_picture
from qddot.runner.problem import Status
from qddot.runner.tables import Quantity
from qddot.words import counted

if TYPE_CHECKING:
    import xarray

    from qddot.runner.pictures.figures import Drawn

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Batch:
    """What a batch of runs gives; row r of every array is that of run r.

    final (runs, n_states): the state at the end of the span, or the last good one of a run that failed. samples
    (runs, n_times, n_quantities) at output_times (runs, n_times), NaN where a run did not get there; `batch["pitch"]`
    is a column (runs, n_times), `batch["t"]` the times; quantities: what stands in the columns. status (runs,): of
    `Status`, as integers. failed_at (runs,): time, NaN where nothing failed; failed_state (runs,): name of the state
    that left first, or empty. steps, failed_attempts, evaluations (runs,). wall_time in s, without compiling.
    not_started: why a run has no static state to start from, by its number.
    in_lanes: whether the runs went in SIMD lanes; otherwise `reason` says why each went alone. method: its name, and
    why it is this one where "auto" chose it.
    """

    final: Floats
    samples: Floats
    output_times: Floats
    quantities: tuple[Quantity, ...]
    status: NDArray[np.int64]
    failed_at: Floats
    failed_state: NDArray[np.str_]
    steps: NDArray[np.int64]
    failed_attempts: NDArray[np.int64]
    evaluations: NDArray[np.int64]
    wall_time: float
    in_lanes: bool
    reason: str = ""
    not_started: Mapping[int, str] = field(default_factory=dict)
    method: str = ""

    def __repr__(self) -> str:
        """How many runs, how many of them failed, and the names of the samples."""
        failed = int((~self.success).sum())
        samples = (
            f"{counted(self.samples.shape[1], 'sample')} of {', '.join(self.names)}" if self.names else "no samples"
        )
        return f"<Batch of {counted(len(self.status), 'run')}, {failed} failed: {samples}>"

    def _repr_html_(self) -> str:
        """What the samples are between, over all runs, in a notebook."""
        rows = []
        for quantity in self.quantities:
            values = self[quantity.name]
            known = values[np.isfinite(values)]
            ends = (f"{known.min():.4g}", f"{known.max():.4g}") if known.size else ("-", "-")
            rows.append((quantity.name, *ends, quantity.unit, quantity.meaning))
        return notebook.table(repr(self)[1:-1], ("quantity", "least", "greatest", "unit", "meaning"), rows)

    def _ipython_key_completions_(self) -> list[str]:
        return ["t", *self.names]

    def plot(self, *names: str, runs: Sequence[int] | None = None, title: str = "") -> "Drawn":
        """A matplotlib Figure, a panel for each of the samples' names, all by default.

        A curve for each run where they are few; the median and the middle nine tenths where they are many. runs: these
        alone, a curve each. Raises ValueError for names and runs that do not exist, ModuleNotFoundError where the extra
        `report` is missing.
        """
        with needed():
            from qddot.runner.pictures.figures import drawn  # noqa: PLC0415 - matplotlib is slow to import
        for name in names:
            if name not in self.names:
                raise ValueError(unknown("quantity", name, self.names))
        if not self.names:
            raise ValueError("this batch has no samples to draw; give simulate_batch names and output_times")
        chosen = range(len(self.status)) if runs is None else [whole("runs", run, least=0) for run in runs]
        if not len(chosen):
            raise ValueError("runs is empty; expected numbers of runs")
        for run in chosen:
            if run >= len(self.status):
                raise ValueError(f"runs: there is no run {run}; the runs are 0 to {len(self.status) - 1}")
        by_name = {quantity.name: quantity for quantity in self.quantities}
        samples = {by_name[name]: self[name][list(chosen)] for name in names or self.names}
        return drawn(batch_picture(self.output_times[list(chosen)], samples, title, chosen, apart=runs is not None))

    @property
    def success(self) -> NDArray[np.bool_]:
        """Which runs reached the end of their span, (runs,)."""
        return self.status == int(Status.FINISHED)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the columns of the samples."""
        return tuple(quantity.name for quantity in self.quantities)

    @property
    def sample_times(self) -> Floats:
        """The name of `output_times` until version 0.1."""
        warnings.warn("Batch.sample_times is Batch.output_times now; goes with version 0.3", DeprecationWarning, 2)
        return self.output_times

    def __getitem__(self, name: str) -> Floats:
        """The samples of this name (runs, n_times); KeyError with the nearest name where there are none."""
        if name in ("t", "time"):
            return self.output_times
        if name not in self.names:
            raise KeyError(unknown("quantity", name, self.names))
        return self.samples[:, :, self.names.index(name)]

    def __contains__(self, name: object) -> bool:
        """Whether there are samples of this name."""
        return name in self.names

    def __iter__(self) -> Iterator[str]:
        """The names."""
        return iter(self.names)

    def to_xarray(self) -> "xarray.Dataset":
        """The batch as a data set over `run` and, where all runs have the same times, `time`; otherwise `sample`.

        One variable for each quantity, with units and long_name; how each run ended in status, failed_at, ...
        """
        import xarray  # noqa: PLC0415 - slow to import, and most batches need none

        same = bool((self.output_times == self.output_times[:1]).all())
        along = "time" if same else "sample"
        seconds = {"units": "s", "long_name": "time"}
        times = ("time", self.output_times[0], seconds) if same else (("run", along), self.output_times, seconds)
        columns = {
            quantity.name: (
                ("run", along),
                self.samples[:, :, i],
                {"units": quantity.unit, "long_name": quantity.meaning},
            )
            for i, quantity in enumerate(self.quantities)
        }
        ended = ("status", "failed_at", "failed_state", "steps", "failed_attempts", "evaluations")
        how = {name: ("run", getattr(self, name)) for name in ended if name not in columns}
        return xarray.Dataset(columns | how, {"time": times, "run": np.arange(len(self.status))})
