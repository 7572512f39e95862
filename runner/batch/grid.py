"""A store as a data set with one dimension for each axis of its sweep."""

import warnings
from pathlib import Path
from typing import Any

import numpy as np

from qddot.runner.batch.outcome import NOT_RUN
from qddot.runner.batch.results import Results

#: What stands in place of a number of a run that is missing: NaN but for these, and for counts, which are 0.
_MISSING = {"status": NOT_RUN, "failed_state": -1}


def open_batch(path: str | Path) -> Any:
    """The store of a batch as an xarray.Dataset whose dimension `run` became those of the sweep.

    `open_batch(path)["hull"].sel(delay=1.85, method="nearest")`. Axes that advance together (zip, samples) share the
    dimension of the first of them. The values are loaded. A batch that is not finished has the attribute `partial`,
    which says how far it is, and nothing of the runs that are missing: their status is -1, their numbers are NaN.
    Runs of blocks that are damaged are missing; the attribute `damaged` and a warning name these blocks.
    `failed_state` is a name, as on a solution.
    Raises StoreError where there is no store, or where what stands beside its blocks is damaged.
    """
    data = _whole_blocks(Results(Path(path)))
    groups, shape = data.attrs["groups"], data.attrs["shape"]
    names = [names[0] for names in groups]
    if not names:
        return data
    variables: dict[str, Any] = {}
    for place, (group, size) in enumerate(zip(groups, shape, strict=True)):
        runs = np.ravel_multi_index([np.arange(size) if i == place else 0 for i in range(len(shape))], shape)
        variables |= {name: (names[place], data[name].to_numpy()[runs], data[name].attrs) for name in group}
    axes = list(variables)
    for name, each in data.variables.items():
        if each.dims[:1] != ("run",):
            variables[name] = each
        elif name not in axes:
            values = each.to_numpy().reshape(*shape, *each.shape[1:])
            variables[name] = ((*names, *each.dims[1:]), values, each.attrs)
    return type(data)(variables, attrs=data.attrs).set_coords(axes)


def _whole_blocks(results: Results) -> Any:
    """The store, without what was written of blocks that are not finished."""
    data = results.data.load()
    if results.partial:
        data.attrs["partial"] = results.partial
        if results.damaged:
            data.attrs["damaged"] = results.damaged
            warnings.warn(f"{results.path} is {results.damaged}", stacklevel=3)
        missing = results.status == NOT_RUN
        for name, each in data.data_vars.items():
            if each.dims[:1] == ("run",) and name not in results.axes:
                real = np.issubdtype(each.dtype, np.floating)
                each.values[missing] = np.nan if real else _MISSING.get(str(name), 0)
    left = np.array([*data["state"].to_numpy(), ""])[data["failed_state"].to_numpy()]
    said = {"long_name": "state that left first, or empty"}
    return data.assign(failed_state=("run", left, said))
