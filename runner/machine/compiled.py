"""`compiled`: numba's njit with a cache that any change of the runner's own code empties.

Numba notices a change of the file that holds a cached function, not of the files whose jitted functions it calls. So
the drivers' cache lives in a folder named after the digest of all of the runner's source.
"""

import contextlib
import hashlib
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from types import FunctionType
from typing import Any

import numba
from numba import config, njit
from numba.core import dispatcher
from numba.core.caching import NullCache

from qddot.runner.files import keep_newest
from qddot.runner.machine.inner import INNER, OUTER
from qddot.runner.machine.kept import Cache
from qddot.runner.machine.places import code_folder

#: The arithmetic of everything compiled. Contraction to fused multiply-add and ignoring the sign of zero; never nnan or
#: ninf, which make isfinite lie. IEEE rules: a division by zero is an infinity or no number, never an exception.
ARITHMETIC: dict[str, Any] = {"fastmath": {"contract", "nsz"}, "error_model": "numpy"}


#: Rooms and files without jitted functions: their changes empty no cache.
_NOTHING_COMPILED = (
    "pictures",
    "scene",
    "report",
    "study",
    "batch",
    "identify",
    "commands",
    "files.py",
    "frame/acting.py",
    "frame/contact.py",
    "frame/stretches.py",
    "notebook.py",
    "stale.py",
    "machine/places.py",
    "assembly.py",
    "auto.py",
    "columns.py",
    "diagnosis.py",
    "equilibrium.py",
    "inertia.py",
    "inputs/smoothing.py",
    "keywords.py",
    "manifold.py",
    "modes.py",
    "read_tables.py",
    "saving.py",
    "simulate.py",
    "solution.py",
    "solve.py",
    "sparse.py",
    "switching.py",
    "takers.py",
)

#: Versions of the source whose compiled drivers are kept.
_KEPT = 8


@cache
def cache_directory() -> Path | None:
    """The folder of this very source's compiled drivers, beside it where that can be written; see `code_folder`."""
    folder = code_folder(Path(__file__).parent.parent / "__pycache__")
    return _of_this_source(folder) if folder is not None else None


def _of_this_source(folder: Path) -> Path:
    """The folder within of what this very source of the runner compiles to; of older ones a few are kept."""
    keep_newest(folder, f"qddot-{16 * '[0-9a-f]'}", _KEPT)
    return folder / f"qddot-{_source_digest()}"


@cache
def _source_digest() -> str:
    here = Path(__file__).parent.parent
    digest = hashlib.sha256(numba.__version__.encode())
    for source in sorted(here.rglob("*.py")):
        within = source.relative_to(here)
        if within.parts[0] in _NOTHING_COMPILED or within.as_posix() in _NOTHING_COMPILED:
            continue
        digest.update(within.as_posix().encode())
        digest.update(source.read_bytes())
    return digest.hexdigest()[:16]


def _uncached(function: Any) -> NullCache:
    """The cache of a function that is kept nowhere."""
    return NullCache()


@contextlib.contextmanager
def _keeping(folder: Path | None, name: str) -> Iterator[None]:
    """Within the block numba's `cache=True` means the folder of this name, or the one it finds, or none at all."""
    before = config.CACHE_DIR, dispatcher.FunctionCache  # type: ignore[attr-defined]
    config.CACHE_DIR = name  # type: ignore[attr-defined]
    dispatcher.FunctionCache = Cache if folder is not None else _uncached  # type: ignore[attr-defined]
    try:
        yield
    finally:
        config.CACHE_DIR, dispatcher.FunctionCache = before  # type: ignore[attr-defined]


def keeping_module(file: Path) -> contextlib.AbstractContextManager[None]:
    """Within the block, the jitted functions of this generated module are kept beside it or where `code_folder` says.

    Those of one that calls the runner's functions, which become part of them, in the folder of the runner's source.
    Numba alone raises "no locator available" where neither the module's folder nor the user's cache can be written.
    """
    if _calls_the_runner(file):
        return keeping_code(file)
    beside = file.absolute().parent / "__pycache__"
    folder = code_folder(beside)
    return _keeping(folder, "" if folder in (beside, None) else str(folder))


def keeping_code(file: Path) -> contextlib.AbstractContextManager[None]:
    """The same for functions that the runner makes of those of a module: what they are depends on its source, too."""
    folder = code_folder(file.absolute().parent / "__pycache__")
    return _keeping(folder, str(_of_this_source(folder)) if folder is not None else "")


def _calls_the_runner(file: Path) -> bool:
    with contextlib.suppress(OSError):
        return b"\nfrom qddot.runner" in file.read_bytes()
    return False


def compiled(
    signature: Any = None, calls: FunctionType | None = None, **options: Any
) -> Callable[[Callable[..., Any]], Any]:
    """`njit(signature, cache=True, **ARITHMETIC, **options)` with the cache in `cache_directory`.

    What has neither signature nor wrapper for Python, `LEAN` and its kin, is compiled within its callers, see `inner`.

    calls: a function that is none of the runner's own and becomes part of this one; each has a folder of its own, since
    numba would take what it compiled with another for the same.
    """

    def decorate(function: Callable[..., Any]) -> Any:
        if signature is None and options.get("no_cpython_wrapper") and "pipeline_class" not in options:
            return njit(pipeline_class=INNER, **ARITHMETIC, **options)(function)
        folder = cache_directory()
        if folder is not None and calls is not None:
            folder /= text_digest(calls)
        with _keeping(folder, str(folder or "")):
            return njit(signature, cache=True, **({"pipeline_class": OUTER} | ARITHMETIC | options))(function)

    return decorate


def text_digest(function: FunctionType) -> str:
    """The digest of what a function does and of its module, which numba's cached code asks for by name."""
    code = function.__code__
    parts = (function.__module__, code.co_code, code.co_consts, code.co_names, code.co_varnames)
    return hashlib.sha256(repr(parts).encode()).hexdigest()[:16]
