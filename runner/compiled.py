"""`compiled`: numba's njit with a cache that any change of the runner's own code empties.

Numba notices a change of the file that holds a cached function, not of the files whose jitted functions it calls. So
the drivers' cache lives in a folder named after the digest of all of the runner's source.
"""

import contextlib
import hashlib
import os
import shutil
import tempfile
from collections.abc import Callable
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

import numba
from numba import config, njit
from numba.np import linalg

import generated

#: The arithmetic of everything compiled. Contraction to fused multiply-add and ignoring the sign of zero; never nnan or
#: ninf, which make isfinite lie. IEEE rules: a division by zero is an infinity or no number, never an exception.
ARITHMETIC: dict[str, Any] = {"fastmath": {"contract", "nsz"}, "error_model": "numpy"}


def _import_array_functions() -> None:
    """Import what numba imports before it loads its first function from a cache, without its probe for a BLAS.

    The probe imports scipy.linalg, a quarter of the time until a warm process has its first kernel. SciPy is a
    dependency of ours: the answer is known.
    """
    probe = linalg.ensure_blas
    linalg.ensure_blas = lambda: None
    try:
        import_module("numba.np.arraymath")
    finally:
        linalg.ensure_blas = probe


_import_array_functions()

#: Rooms without jitted functions: their changes empty no cache.
_NOTHING_COMPILED = ("report", "study", "paper", "batch", "identify")

#: Versions of the source whose compiled drivers are kept.
_KEPT = 8


@cache
def cache_directory() -> Path:
    """The folder of this very source's compiled drivers: beside it, or in the user's cache where that is read-only."""
    here = Path(__file__).parent
    digest = hashlib.sha256(numba.__version__.encode())
    for source in sorted(here.rglob("*.py")):
        if source.relative_to(here).parts[0] in _NOTHING_COMPILED:
            continue
        digest.update(source.relative_to(here).as_posix().encode())
        digest.update(source.read_bytes())
    digest.update((Path(generated.__file__).parent / "_elementary.py").read_bytes())  # lanes call what stands there
    name = f"qddot-{digest.hexdigest()[:16]}"
    beside = here / "__pycache__"
    if os.access(beside if beside.exists() else here, os.W_OK):
        return _tidy(beside) / name
    user_cache = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    return (user_cache if os.access(user_cache.parent, os.W_OK) else Path(tempfile.gettempdir())) / name


def _tidy(folder: Path) -> Path:
    """Remove the caches of all but the last few versions of the source."""
    ages: list[tuple[float, Path]] = []
    for path in folder.glob("qddot-*"):
        with contextlib.suppress(FileNotFoundError):  # another process may be tidying too
            ages.append((path.stat().st_mtime, path))
    for _, old in sorted(ages)[:-_KEPT]:
        shutil.rmtree(old, ignore_errors=True)
    return folder


def compiled(signature: Any = None, **options: Any) -> Callable[[Callable[..., Any]], Any]:
    """`njit(signature, cache=True, **ARITHMETIC, **options)` with the cache in `cache_directory`."""

    def decorate(function: Callable[..., Any]) -> Any:
        before = config.CACHE_DIR  # type: ignore[attr-defined]
        config.CACHE_DIR = str(cache_directory())  # type: ignore[attr-defined]
        try:
            return njit(signature, cache=True, **ARITHMETIC, **options)(function)
        finally:
            config.CACHE_DIR = before  # type: ignore[attr-defined]

    return decorate
