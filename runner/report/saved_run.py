"""A run read back from the NetCDF file that it was saved to."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from qddot.runner.columns import Columns
from qddot.runner.tables import Quantity

_HEADLINE, _PARAMETER = "headline ", "parameter "


@dataclass(frozen=True, eq=False)
class SavedRun(Columns):
    """A run of a file: t (n,) in s, values (n, n_quantities), its title, and what a person looks at first, by kind.

    model: its name; parameters: their values.
    """

    t: NDArray[np.float64]
    values: NDArray[np.float64]
    quantities: tuple[Quantity, ...]
    title: str
    headlines: Mapping[str, tuple[str, ...]]
    model: str = ""
    parameters: Mapping[str, float] = field(default_factory=dict)


def read_run(path: Path) -> SavedRun:
    """The run that `Solution.save` or `qddot run` wrote to a .nc file.

    Raises OSError where the file cannot be read, ValueError where it holds no run.
    """
    from netCDF4 import Dataset  # noqa: PLC0415 - slow to import

    if not path.is_file():
        raise ValueError(f"{path}: there is no such file; expected a run, a .nc file of `qddot run`")
    try:
        file = Dataset(path)
    except OSError as error:
        raise ValueError(f"{path} is no NetCDF file ({error.strerror}); expected a run that qddot saved") from error
    with file:
        file.set_auto_mask(False)
        columns = {
            str(name): each for name, each in file.variables.items() if each.dimensions == ("time",) and name != "time"
        }
        if "time" not in file.variables or not columns or not len(file.variables["time"]):
            raise ValueError(f"{path} holds no run: it has no quantities over `time`; expected one that qddot saved")
        t = np.array(file.variables["time"][:], dtype=np.float64)
        values = np.array([each[:] for each in columns.values()], dtype=np.float64).T
        quantities = tuple(
            Quantity(name, str(getattr(each, "units", "")), str(getattr(each, "long_name", "")))
            for name, each in columns.items()
        )
        said = {name: getattr(file, name) for name in file.ncattrs()}
    headlines = {
        name.removeprefix(_HEADLINE): tuple(each for each in str(text).split() if each in columns)
        for name, text in said.items()
        if name.startswith(_HEADLINE)
    }
    parameters = {
        name.removeprefix(_PARAMETER): float(value) for name, value in said.items() if name.startswith(_PARAMETER)
    }
    looked_at = headlines or {"quantities": tuple(columns)}
    return SavedRun(
        t, values, quantities, str(said.get("title", "")), looked_at, str(said.get("model", "")), parameters
    )
