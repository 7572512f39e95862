"""A store as a data set with one dimension for each axis of its sweep."""

from pathlib import Path
from typing import Any

import numpy as np

from runner.batch.store import dataset


def open_batch(path: str | Path) -> Any:
    """The store of a batch as an xarray.Dataset whose dimension `run` became those of the sweep.

    `open_batch(path)["hull"].sel(delay=1.85, method="nearest")`. Axes that advance together (zip, samples) share the
    dimension of the first of them. The values are loaded. Raises StoreError where there is no store.
    """
    data = dataset(Path(path)).load()
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
