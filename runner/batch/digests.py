"""Digests of what a store holds: of values and of what JSON says, not of bytes, which a copy may pack otherwise."""

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

#: Bytes of a digest: by chance, no damage leaves it as it was.
SIZE = 16
#: The key of a file's own digest in it.
SEAL = "digest"


class DamagedError(ValueError):
    """A file that is not as it was written."""


def of_values(values: NDArray[Any]) -> str:
    """The digest of an array: its type, shape and values. All NaN are one: a chunk of nothing else is not stored."""
    if values.dtype.kind in "OTU":  # texts
        kind, data = "text", json.dumps([str(value) for value in values.ravel()]).encode()
    else:
        kind = f"{values.dtype.kind}{values.dtype.itemsize}"
        same = np.where(np.isnan(values), values.dtype.type(np.nan), values) if values.dtype.kind == "f" else values
        data = np.ascontiguousarray(same, dtype=same.dtype.newbyteorder("<")).tobytes()
    return _digest(f"{kind} {values.shape} ".encode() + data)


def sealed(content: Mapping[str, Any]) -> dict[str, Any]:
    """What is to be written as JSON, with its digest in it."""
    return {**content, SEAL: _of_json(content)}


def unsealed(path: Path) -> dict[str, Any]:
    """What a file of JSON says that was written with its digest in it. Raises DamagedError where it does not fit."""
    content = json_of(path)
    if content.pop(SEAL, None) != _of_json(content):
        raise DamagedError(f"{path} is not as it was written")
    return content


def json_of(path: Path) -> dict[str, Any]:
    """The table in a file of JSON. Raises DamagedError where there is none."""
    try:
        content = json.loads(path.read_bytes())
    except (OSError, ValueError, RecursionError):
        content = None
    if not isinstance(content, dict):
        raise DamagedError(f"{path} holds no table of JSON")
    return content


def _of_json(content: Mapping[str, Any]) -> str:
    return _digest(json.dumps(content, sort_keys=True).encode())


def _digest(data: bytes) -> str:
    return hashlib.blake2b(data, digest_size=SIZE).hexdigest()
