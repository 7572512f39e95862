"""Columns of a run as a file, NetCDF, CSV or MATLAB's, which appears whole or not at all."""

import errno
import shutil
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from qddot.runner.files import written_aside
from qddot.runner.tables import Quantity

TIME = Quantity("time", "s", "time")

#: A quantity with its values (n,) at the saved points.
Column = tuple[Quantity, NDArray[np.float64]]
Writer = Callable[[Path, Sequence[Column], Mapping[str, Any]], None]


def writer_for(path: Path) -> Writer:
    """What writes columns, of the time first, and attributes to a file of this name; ValueError for another suffix."""
    if path.suffix not in _WRITERS:
        raise ValueError(f"{path}: expected a file that ends in {', '.join(_WRITERS)}")
    return _WRITERS[path.suffix]


def heads(quantity: Quantity) -> dict[str, str]:
    """What a data set says of one of its variables."""
    return {"units": quantity.unit, "long_name": quantity.meaning}


def _write_csv(path: Path, columns: Sequence[Column], _: Mapping[str, Any]) -> None:
    heading = ",".join(f"{each.name} [{each.unit}]" if each.unit else each.name for each, _ in columns)
    rows = np.column_stack([values for _, values in columns])
    with written_aside(path) as aside:
        np.savetxt(aside, rows, "%.17g", ",", header=heading, comments="")


def _write_mat(path: Path, columns: Sequence[Column], _: Mapping[str, Any]) -> None:
    from scipy.io import savemat  # noqa: PLC0415 - only a run that is saved needs it

    vectors = {each.name: values for each, values in columns}
    with written_aside(path) as aside, aside.open("wb") as file:
        savemat(file, vectors, long_field_names=True, oned_as="column", do_compression=True)


def _write_netcdf(path: Path, columns: Sequence[Column], attributes: Mapping[str, Any]) -> None:
    from netCDF4 import Dataset  # noqa: PLC0415 - only a run that is saved needs it

    with written_aside(path) as aside, _told_by_netcdf(path), Dataset(aside, "w", format="NETCDF4") as file:
        file.setncatts(attributes)
        file.createDimension("time", len(columns[0][1]))
        variables = []
        for quantity, _ in columns:
            variable = file.createVariable(quantity.name, "f8", ("time",), fill_value=False)
            variable.setncatts(heads(quantity))
            variables.append(variable)
        for variable, (_, values) in zip(variables, columns, strict=True):  # now that the heads are written, once
            variable[:] = values


@contextmanager
def _told_by_netcdf(path: Path) -> Iterator[None]:
    """Raise an OSError naming `path` where the NetCDF library, which does not say why, could not write."""
    try:
        yield
    except RuntimeError as error:
        free = shutil.disk_usage(path.parent).free / 1e6
        raise OSError(errno.EIO, f"could not be written ({error}); {free:.3g} MB are free there", str(path)) from error


_WRITERS: dict[str, Writer] = {".nc": _write_netcdf, ".csv": _write_csv, ".mat": _write_mat}
