"""What a run gives back: time, states, outputs and inputs by name, with units, statistics and how it ended."""

import errno
import shutil
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field, fields
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from qddot.runner import notebook
from qddot.runner.checks import unknown
from qddot.runner.files import written_aside
from qddot.runner.problem import Statistics, Status
from qddot.runner.tables import Quantity
from qddot.words import counted

if TYPE_CHECKING:
    import pandas
    import xarray

    from qddot.runner.frame.events import EventLog

TIME = Quantity("time", "s", "time")


@dataclass(frozen=True, eq=False)
class Solution:
    """A run: t (n,) in s; values (n, n_quantities) float64, one column for each of `quantities`.

    quantities: n_states states, n_outputs outputs, and the inputs, in this order. `s["q_6"]` is a column (n,), s["t"]
    the time. metadata: model, method, step, parameter values, as text and numbers. failed_at (s), failed_state: where a
    run that failed left. headlines: kind (coordinates, outputs, inputs) -> names that a person looks at first.
    """

    t: NDArray[np.float64]
    values: NDArray[np.float64]
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

    def __post_init__(self) -> None:
        """Make the arrays read-only."""
        self.t.flags.writeable = self.values.flags.writeable = False

    def __reduce__(self) -> tuple[Any, ...]:
        """Unpickled arrays are read-only again."""
        return Solution, tuple(getattr(self, each.name) for each in fields(self))

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

    def _ends(self, name: str) -> tuple[str, str, str, str]:
        known = self[name][np.isfinite(self[name])]
        least, greatest = (f"{known.min():.4g}", f"{known.max():.4g}") if known.size else ("-", "-")
        return least, greatest, self.quantity(name).unit, self.quantity(name).meaning

    def _ipython_key_completions_(self) -> list[str]:
        return ["t", *self.names]

    @cached_property
    def _columns(self) -> dict[str, int]:
        return {quantity.name: i for i, quantity in enumerate(self.quantities)}

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the states, outputs and inputs."""
        return tuple(self._columns)

    @property
    def states(self) -> NDArray[np.float64]:
        """The states (n, n_states)."""
        return self.values[:, : self.n_states]

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
        if not self.extras or "events" not in self.extras:
            raise ValueError("this run watched for no events; give simulate some, events=[qddot.crossing(...)]")
        return self.extras["events"]

    @property
    def success(self) -> bool:
        """Whether the run reached its end or a terminal event."""
        return self.status in (Status.FINISHED, Status.TERMINATED)

    def __getitem__(self, name: str) -> NDArray[np.float64]:
        """The column (n,) of this name; KeyError with the nearest name where there is none."""
        if name in ("t", "time"):
            return self.t
        return self.values[:, self._place(name)]

    def __contains__(self, name: object) -> bool:
        """Whether a quantity has this name."""
        return name in self._columns

    def __iter__(self) -> Iterator[str]:
        """The names."""
        return iter(self._columns)

    def quantity(self, name: str) -> Quantity:
        """Name, unit and meaning; KeyError with the nearest name where there is none."""
        return self.quantities[self._place(name)]

    def _place(self, name: str) -> int:
        if name not in self._columns:
            raise KeyError(unknown("quantity", name, self._columns))
        return self._columns[name]

    @property
    def attributes(self) -> dict[str, str | float]:
        """Everything beside the columns, for files: metadata, how the run ended, statistics.

        A run that did not reach its end has also partial = "yes" and, where a state left, failed_at (s), failed_state.
        """
        counts = {name: float(value) for name, value in asdict(self.statistics).items()}
        ended: dict[str, str | float] = {"status": self.status.name, "message": self.message}
        if not self.success:
            ended["partial"] = "yes"
            ended |= {"failed_at": float(self.failed_at)} if np.isfinite(self.failed_at) else {}
            ended |= {"failed_state": self.failed_state} if self.failed_state else {}
        return {**self.metadata, **ended, **counts}

    def to_xarray(self) -> "xarray.Dataset":
        """The run as a data set: one variable (time,) for each quantity, with the attributes units and long_name."""
        import xarray  # noqa: PLC0415 - slow to import, and most runs need none

        columns = {
            quantity.name: ("time", self.values[:, i], _attributes(quantity))
            for i, quantity in enumerate(self.quantities)
        }
        return xarray.Dataset(columns, {"time": ("time", self.t, _attributes(TIME))}, self.attributes)

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
        writers = {".nc": self._write_netcdf, ".csv": self._write_csv, ".mat": self._write_mat}
        if path.suffix not in writers:
            raise ValueError(f"{path}: expected a file that ends in {', '.join(writers)}")
        writers[path.suffix](path)
        return path

    def _write_csv(self, path: Path) -> None:
        heading = ",".join(
            f"{each.name} [{each.unit}]" if each.unit else each.name for each in (TIME, *self.quantities)
        )
        with written_aside(path) as aside:
            np.savetxt(aside, np.column_stack([self.t, self.values]), "%.17g", ",", header=heading, comments="")

    def _write_mat(self, path: Path) -> None:
        from scipy.io import savemat  # noqa: PLC0415 - only a run that is saved needs it

        columns = {"time": self.t, **{name: self[name] for name in self.names}}
        with written_aside(path) as aside, aside.open("wb") as file:
            savemat(file, columns, long_field_names=True, oned_as="column", do_compression=True)

    def _write_netcdf(self, path: Path) -> None:
        from netCDF4 import Dataset  # noqa: PLC0415 - only a run that is saved needs it

        with written_aside(path) as aside, _told_by_netcdf(path), Dataset(aside, "w", format="NETCDF4") as file:
            file.setncatts(self.attributes)
            file.createDimension("time", len(self.t))
            columns = [(TIME, self.t), *zip(self.quantities, self.values.T, strict=True)]
            for quantity, values in columns:
                variable = file.createVariable(quantity.name, "f8", ("time",), fill_value=False)
                variable.setncatts(_attributes(quantity))
                variable[:] = values


@contextmanager
def _told_by_netcdf(path: Path) -> Iterator[None]:
    """Raise an OSError naming `path` where the NetCDF library, which does not say why, could not write."""
    try:
        yield
    except RuntimeError as error:
        free = shutil.disk_usage(path.parent).free / 1e6
        raise OSError(errno.EIO, f"could not be written ({error}); {free:.3g} MB are free there", str(path)) from error


def _attributes(quantity: Quantity) -> dict[str, str]:
    return {"units": quantity.unit, "long_name": quantity.meaning}
