"""What a run gives back: time, states, outputs and inputs by name, with units, statistics and how it ended."""

import pickle
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from qddot.extras import needed
from qddot.runner import notebook
from qddot.runner.checks import finite, numbers
from qddot.runner.columns import Between, Columns, Extremes, Moments
from qddot.runner.pictures.arrange import run_picture, undetermined
from qddot.runner.problem import Statistics, Status
from qddot.runner.saving import TIME, heads, writer_for
from qddot.runner.tables import Quantity
from qddot.words import counted

if TYPE_CHECKING:
    import pandas
    import xarray

    from qddot.runner.frame.events import EventLog
    from qddot.runner.pictures.figures import Drawn
    from qddot.runner.scene.animation import Animation
    from qddot.runner.scene.filmed import Filmed

#: Points of a run that show how it goes on between them.
ENOUGH = 2001
#: Of a quantity's greatest magnitude: what is left of it in the last digits of a sum.
ROUNDING = 1e-13


@dataclass(frozen=True, eq=False)
class Solution(Columns):
    """A run: t (n,) in s; states (n, n_states); values (n, n_quantities), a column for each of `quantities`; float64.

    quantities: n_states states, n_outputs outputs, and the inputs, in this order. `s["q_6"]` is a column (n,), s["t"]
    the time. beside: the columns behind the states, or what gives them when they are first asked for. metadata: model,
    method, step, parameter values, as text and numbers. failed_at (s), failed_state: where a run that failed left.
    headlines: kind (coordinates, outputs, inputs) -> names that a person looks at first. between: gives what lies
    between its points when it is called, itself or pickled; None where that is not known.
    """

    t: NDArray[np.float64]
    states: NDArray[np.float64]
    beside: NDArray[np.float64] | Callable[[], NDArray[np.float64]]
    quantities: tuple[Quantity, ...]
    n_states: int
    n_outputs: int
    status: Status
    message: str
    statistics: Statistics
    metadata: Mapping[str, str | float]
    failed_at: float = np.nan
    failed_state: str = ""
    extras: Mapping[str, Any] | None = None
    headlines: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    between: Callable[[], Between] | bytes | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        """Make the arrays read-only."""
        self.t.setflags(write=False)
        self.states.setflags(write=False)

    def __reduce__(self) -> tuple[Any, ...]:
        """Unpickled arrays are read-only again; what lies between is looked for when it is needed."""
        values = {each.name: getattr(self, each.name) for each in fields(self)}
        given = {"beside": self.values[:, self.n_states :], "between": _packed(self.between)}
        return Solution, tuple((values | given).values())

    def __repr__(self) -> str:
        """Model, method, span, points, how it ended, and the first names."""
        shown = ", ".join(self.names[:4]) + (f", ... ({len(self.names)} quantities)" if len(self.names) > 4 else "")
        span = f"{self.t[0]:g} to {self.t[-1]:g} s, {counted(len(self.t), 'point')}" if len(self.t) else "no points"
        ended = self.status.name.lower() if self.success else self.message
        about = f"{self.metadata.get('model', '')} by {self.metadata.get('method', '')}"
        return f"<Solution of {about}: {span}, {ended}; {shown}>"

    def _repr_html_(self) -> str:
        """A row for each quantity worth looking at, with its curve, in a notebook."""
        names = [name for kind in self.headlines.values() for name in kind if name in self] or list(self.names)
        rows = [(name, notebook.curve(self.t, self[name]), *self._ends(name)) for name in names]
        title = f"{self.metadata.get('model', '')}, {self.t[0]:g} to {self.t[-1]:g} s" if len(self.t) else "no points"
        columns = ("quantity", "", "least", "greatest", "unit", "meaning")
        return notebook.table(title, columns, rows, below="" if self.success else self.message)

    def plot(self, *panels: str | Sequence[str], from_start: Sequence[str] = (), title: str | None = None) -> "Drawn":
        """A matplotlib Figure, a panel for each name, or for the names of a tuple; by default what `qddot run` draws.

        `s.plot("heave", ("q_1", "q_2")).savefig("ride.pdf")`; its `axes` are there to be changed. Curves are as smooth
        as `at`. from_start: names shown as change since the start; by default those panels show it whose offsets would
        flatten the rest.
        Raises ValueError with the nearest name for one that the run does not have, ModuleNotFoundError where the extra
        `report` is missing.
        """
        with needed():
            from qddot.runner.pictures.figures import drawn  # noqa: PLC0415 - matplotlib is slow to import
        if title is None:
            title = f"{self.metadata.get('model', '')} by {self.metadata.get('method', '')}"
        return drawn(run_picture(self.closely, self.headlines, title, panels, from_start))

    def animate(self) -> "Animation":
        """The run as the model's scene, to be played: shown in a notebook as it is, `.save("ride.html")` writes a page.

        Raises ValueError where the model has no scene, or the solution only its saved points.
        """
        return self._filmed.animation()

    def scene(self, t: float, title: str = "") -> "Drawn":
        """The model's scene at time t, s, as a matplotlib Figure.

        Raises ValueError for a time outside the run, where the model has no scene, or the solution only its saved
        points; ModuleNotFoundError where the extra `report` is missing.
        """
        with needed():
            return self._filmed.still(finite("t", t), title)

    @property
    def _filmed(self) -> "Filmed":
        from qddot.runner.scene.filmed import filmed  # noqa: PLC0415 - most runs are not drawn

        run = getattr(self._whence, "simulation", None)
        if run is None or run.model is None:
            raise ValueError("this solution knows no model whose scene could be drawn; simulate one")
        span = float(self.t.min()), float(self.t.max())
        states = lambda times: self.at(times).values[:, : self.n_states]  # noqa: E731
        return filmed(run.model, run.problem.constants, run.problem.inputs, span, states)

    def _ends(self, name: str) -> tuple[str, str, str, str]:
        known = self[name][np.isfinite(self[name])]
        none = "undetermined" if name in self.undetermined else "-"
        least, greatest = (f"{known.min():.4g}", f"{known.max():.4g}") if known.size else (none, none)
        return least, greatest, self.quantity(name).unit, self.quantity(name).meaning

    def _ipython_key_completions_(self) -> list[str]:
        return ["t", *self.names]

    @cached_property
    def values(self) -> NDArray[np.float64]:  # type: ignore[override]
        """States, outputs and inputs (n, n_quantities), read-only."""
        values = np.concatenate([self.states, self.beside() if callable(self.beside) else self.beside], axis=1)
        values.flags.writeable = False
        return values

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of the states."""
        return self.names[: self.n_states]

    @property
    def output_names(self) -> tuple[str, ...]:
        """Names of the outputs."""
        return self.names[self.n_states : self.n_states + self.n_outputs]

    @property
    def input_names(self) -> tuple[str, ...]:
        """Names of the inputs and of their rates where the model has them."""
        return self.names[self.n_states + self.n_outputs :]

    @property
    def events(self) -> "EventLog":
        """The events of the run, see `runner.frame.events.EventLog`; ValueError where none was watched for."""
        if not self.event_names:
            raise ValueError("this run watched for no events; give simulate some, events=[qddot.crossing(...)]")
        log: EventLog = (self.extras or {})["events"]
        return log

    @property
    def event_names(self) -> tuple[str, ...]:
        """Names of the events that were watched for."""
        return self.extras["events"].names if self.extras and "events" in self.extras else ()

    @property
    def undetermined(self) -> tuple[str, ...]:
        """Names of the multipliers that are not determined at some saved point, where constraints are redundant.

        They are NaN there; the reactions, what all constraints do together, are determined everywhere.
        """
        return tuple(undetermined(self, self.headlines))

    @property
    def success(self) -> bool:
        """Whether the run reached its end or a terminal event."""
        return self.status in (Status.FINISHED, Status.TERMINATED)

    def at(self, t: ArrayLike) -> Moments:
        """The run at times t, s, of any shape and order, between its saved points by the method's dense output.

        `s.at(1.5)["q_6"]` is a number, `s.at(times)["q_6"]` has the shape of the times. Where an input jumps, the limit
        from the right, as at saved points. The run is made again, by the same steps, when this is first asked.
        Raises ValueError for a time outside the run.
        """
        times = numbers("t", t, "a time or times of the run, in s")
        low, high = sorted((self.t[0], self.t[-1]))
        outside = times[~((times >= low) & (times <= high))]
        if outside.size:
            raise ValueError(f"t is {outside.flat[0]:g} s, but the run goes from {self.t[0]:g} to {self.t[-1]:g} s")
        flat = times.ravel()
        values = self._dense.values_at(flat) if len(self.t) > 1 else np.repeat(self.values, flat.size, axis=0)
        return Moments(times, values.reshape(*times.shape, values.shape[1]), self.quantities)

    @cached_property
    def closely(self) -> Columns:
        """The run at its saved points and at ENOUGH even times, as smooth as `at`; itself where it saved as many."""
        if self.between is None or not 1 < len(self.t) < ENOUGH:
            return self
        times = np.union1d(self.t, np.linspace(self.t[0], self.t[-1], ENOUGH))
        return self.at(times if self.t[0] < self.t[-1] else times[::-1])

    def extremes(self, name: str, after: float | None = None, before: float | None = None) -> Extremes:
        """The least and greatest value of a quantity in a window, s, the whole run by default, saved points or not.

        On the method's dense output, at a jump on both of its sides; not where the quantity is no finite number.
        Raises KeyError for a name that the run does not have, ValueError for a window with nothing of the run in it.
        """
        place = self._place(name)
        if after is None and before is None:
            return Extremes(*map(float, self._extremes[place]))
        low, high = sorted((self.t[0], self.t[-1]))
        start = low if after is None else max(low, finite("after", after))
        end = high if before is None else min(high, finite("before", before))
        if not start <= end:
            raise ValueError(f"the window from {after} to {before} s holds nothing of the run")
        return Extremes(*map(float, self._extremes_between(start, end)[place]))

    @cached_property
    def _extremes(self) -> NDArray[np.float64]:
        return self._extremes_between(float(self.t[0]), float(self.t[-1]))

    def _extremes_between(self, start: float, end: float) -> NDArray[np.float64]:
        """Least value and its time, greatest and its time (n_quantities, 4), of saved points and between them.

        What lies between counts where it is more than rounding beyond a saved point.
        """
        low, high = sorted((start, end))
        inside = (self.t >= low) & (self.t <= high)
        saved = extremes_of_points(self.t[inside], self.values[inside])
        if len(self.t) <= 1 or self.between is None:
            return saved
        found = saved.copy()
        self._dense.better(found, low, high)
        rounding = ROUNDING * np.abs(found[:, ::2]).max(axis=1, keepdims=True)
        same = np.repeat(np.abs(found[:, ::2] - saved[:, ::2]) <= rounding, 2, axis=1)
        return np.where(same, saved, found)

    @cached_property
    def _whence(self) -> Callable[[], Between]:
        if self.between is None:
            raise ValueError("this solution has its saved points alone: what lies between them is not known")
        whence: Callable[[], Between] = pickle.loads(self.between) if isinstance(self.between, bytes) else self.between
        return whence

    @cached_property
    def _dense(self) -> Between:
        return self._whence()

    @property
    def attributes(self) -> dict[str, Any]:
        """Everything beside the columns, for files: metadata, how the run ended, statistics.

        Which names a person looks at first stand in "headline coordinates", "headline outputs" and "headline inputs".
        "event NAME" are the times of an event that happened, s. A run that did not reach its end has also partial =
        "yes" and, where a state left, failed_at (s), failed_state.
        """
        counts = {name: float(value) for name, value in asdict(self.statistics).items()}
        ended: dict[str, str | float] = {"status": self.status.name, "message": self.message}
        if not self.success:
            ended["partial"] = "yes"
            ended |= {"failed_at": float(self.failed_at)} if np.isfinite(self.failed_at) else {}
            ended |= {"failed_state": self.failed_state} if self.failed_state else {}
        looked_at = {f"headline {kind}": " ".join(names) for kind, names in self.headlines.items()}
        happened = {f"event {name}": times for name in self.event_names if (times := self.events.times(name)).size}
        return {**self.metadata, **ended, **counts, **looked_at, **happened}

    def to_xarray(self) -> "xarray.Dataset":
        """The run as a data set: one variable (time,) for each quantity, with the attributes units and long_name."""
        import xarray  # noqa: PLC0415 - slow to import, and most runs need none

        columns = {
            quantity.name: ("time", self.values[:, i], heads(quantity)) for i, quantity in enumerate(self.quantities)
        }
        return xarray.Dataset(columns, {"time": ("time", self.t, heads(TIME))}, self.attributes)

    def to_dataframe(self) -> "pandas.DataFrame":
        """The run as a data frame: one row a point, the time in s as its index, a column for each quantity."""
        import pandas  # noqa: PLC0415 - slow to import, and most runs need none

        return pandas.DataFrame(self.values, pandas.Index(self.t, name="time"), list(self.names))

    def save(self, path: str | Path) -> Path:
        """Write the run to a file, which appears whole or not at all: .nc, .csv or .mat.

        NetCDF is read by xarray.open_dataset as `to_xarray` gives it. CSV has a heading of names with units. MATLAB
        loads a .mat as one column vector for each quantity, `time` among them. Raises ValueError for another suffix,
        OSError where it cannot be written.
        """
        path = Path(path)
        write = writer_for(path)
        write(path, [(TIME, self.t), *zip(self.quantities, self.values.T, strict=True)], self.attributes)
        return path


def extremes_of_points(t: NDArray[np.float64], values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Least value and its time, greatest and its time (n_quantities, 4), of finite points; NaN where there are none."""
    found = np.full((values.shape[1], 4), np.nan)
    for place, column in enumerate(values.T):
        known = np.flatnonzero(np.isfinite(column))
        if known.size:
            low, high = known[np.argmin(column[known])], known[np.argmax(column[known])]
            found[place] = column[low], t[low], column[high], t[high]
    return found


def _packed(between: Callable[[], Between] | bytes | None) -> bytes | None:
    """What lies between saved points as bytes; None where a function that it needs cannot be found by name."""
    if between is None or isinstance(between, bytes):
        return between
    try:
        return pickle.dumps(between)
    except (pickle.PicklingError, AttributeError, TypeError):
        return None
