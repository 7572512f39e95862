"""What stands in the store of a batch: variables with dimensions and units, and what identifies the batch."""

import hashlib
import json
import platform
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from qddot.runner.batch.job import Job
from qddot.runner.batch.outcome import NOT_RUN, REFUSED
from qddot.runner.problem import Status
from qddot.runner.study.overrides import Tree

#: Version of the layout: a store of another one is not gone on with.
LAYOUT = 2
#: Libraries whose versions stand in the store.
LIBRARIES = ("numba", "numpy", "scipy", "xarray", "zarr")


@dataclass(frozen=True, eq=False)
class Variable:
    """One array of the store; `values` of coordinates, which are written with the store, not with its blocks."""

    name: str
    dimensions: tuple[str, ...]
    shape: tuple[int, ...]
    dtype: Any
    fill: Any
    attributes: dict[str, Any]
    values: NDArray[Any] | None = None


def variables(job: Job) -> Iterator[Variable]:
    """Coordinates and results of a batch."""
    runs, states = len(job.sweep), job.model.tables.states
    for i, axis in enumerate(job.sweep.axes):
        unit = axis.unit or _model_unit(job, axis.keys[0])
        said = {"units": unit, "long_name": ", ".join(axis.keys), "scale": "log" if axis.logarithmic else "linear"}
        yield _coordinate(axis.name, "run", job.sweep.coordinate(i), said)
    yield _coordinate("state", "state", np.array(job.model.state_names, dtype=object), {"long_name": "state"})
    if job.keep:
        times = job.sampling.times[:: job.every]
        yield _coordinate("time", "time", times, {"units": "s", "long_name": "time"})
    codes = [*Status, REFUSED, NOT_RUN]
    names = [*(status.name.lower() for status in Status), "refused", "not_run"]
    flags = {"flag_values": [int(code) for code in codes], "flag_meanings": " ".join(names)}  # as CF has them
    yield _result("status", runs, np.int8, NOT_RUN, {"long_name": "how the run ended", **flags})
    yield _result("failed_at", runs, np.float64, np.nan, {"units": "s", "long_name": "time at which the run failed"})
    yield _result("failed_state", runs, np.int64, -1, {"long_name": "place of the state that left first, or -1"})
    yield _result("steps", runs, np.int64, 0, {"long_name": "steps"})
    yield _result("evaluations", runs, np.int64, 0, {"long_name": "evaluations of the right-hand side"})
    units = {"long_name": "state at the end", "unit_of_state": [state.unit for state in states]}
    yield Variable("final_state", ("run", "state"), (runs, len(states)), np.float64, np.nan, units)
    better = {name: table.better for name, table in job.study.metrics.items()}
    for measure in job.measures:
        said = {
            "units": measure.unit,
            "long_name": measure.meaning,
            "metric": measure.kind,
            "better": better[measure.name],
        }
        yield _result(measure.name, runs, np.float64, np.nan, said)
    for place in job.keep:
        quantity = job.observer.quantities[place]
        said = {"units": quantity.unit, "long_name": quantity.meaning}
        shape = (runs, len(job.sampling.times[:: job.every]))
        yield Variable(quantity.name, ("run", "time"), shape, np.float64, np.nan, said)


def attributes(job: Job) -> dict[str, Any]:
    """What the store says about the batch as a whole; see `identity`."""
    return {
        "title": job.study.title or job.path.stem,
        "qddot_layout": LAYOUT,
        "coordinates": " ".join(axis.name for axis in job.sweep.axes),
        "axes": [axis.name for axis in job.sweep.axes],
        "study": job.text,
        "seed": job.study.sweep.seed,
        "block": job.block,
        "shape": list(job.sweep.shape),
        "metrics": [measure.name for measure in job.measures],
        "groups": [[job.sweep.axes[place].name for place in places] for places, _ in job.sweep.groups],
        "sampled": [axis.name for axis in job.sweep.axes if axis.distribution is not None],
        "versions": versions(),
        **identity(job),
    }


def identity(job: Job) -> dict[str, Any]:
    """What must be the same for results to be of the same batch: tables, kernels, files, sampled values."""
    own = job.study.model_dump(mode="json", include={"sweep", "metrics", "outputs"}, exclude_none=True)
    tree: Tree = {name: value for name, value in job.tree.items() if name != "title"} | own
    return {
        "model": job.model.name,
        "definition": json.dumps(tree, sort_keys=True, default=str),
        "kernel_digest": job.model.digest,
        "file_digests": {name: _digest(job.path.parent / name) for name in sorted(_files(tree))},
        "axes_digest": _axes_digest(job),
    }


def versions() -> dict[str, str]:
    """Versions of Python and of what computes and stores."""
    return {"python": platform.python_version()} | {name: _version(name) for name in LIBRARIES}


#: Of a library, which is looked up in files: once.
_version = cache(version)


def _coordinate(name: str, dimension: str, values: NDArray[Any], said: dict[str, Any]) -> Variable:
    text = values.dtype == object
    fill = "" if text else values.dtype.type(0)
    return Variable(name, (dimension,), values.shape, str if text else values.dtype, fill, said, values)


def _result(name: str, runs: int, dtype: Any, fill: Any, said: dict[str, Any]) -> Variable:
    return Variable(name, ("run",), (runs,), dtype, fill, said)


def _model_unit(job: Job, key: str) -> str:
    """The unit of plain numbers at this key, where it is a parameter's or a state's."""
    table, _, name = key.partition(".")
    known: dict[str, tuple[Any, ...]] = {"parameters": job.model.tables.parameters, "initial": job.model.tables.states}
    return next((each.unit for each in known.get(table, ()) if each.name == name), "")


def _files(node: Any) -> set[str]:
    """Names of the files that a study reads: what stands under a key `file`."""
    if isinstance(node, dict):
        own = {value for key, value in node.items() if key == "file" and isinstance(value, str)}
        return own.union(*map(_files, node.values()))
    return set().union(*map(_files, node)) if isinstance(node, list | tuple) else set()


def _digest(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest() if path.is_file() else "missing"


def _axes_digest(job: Job) -> str:
    digest = hashlib.sha256()
    for axis in job.sweep.axes:
        text = axis.values.dtype == object
        digest.update(json.dumps(list(axis.values)).encode() if text else np.ascontiguousarray(axis.values).tobytes())
    return digest.hexdigest()
