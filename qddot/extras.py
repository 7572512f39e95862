"""Libraries that come with an extra of the package, and what to say where one is missing."""

import importlib.util
from collections.abc import Iterator
from contextlib import contextmanager

#: Library -> the extra that brings it.
EXTRAS = {
    "matplotlib": "report",
    "latex2mathml": "report",
    "zarr": "batch",
    "dask": "cluster",
    "distributed": "cluster",
    "pyarrow": "parquet",
}


def of_an_extra(error: ModuleNotFoundError) -> bool:
    """Whether what is missing is a library of an extra."""
    return _library(error) in EXTRAS


def missing(error: ModuleNotFoundError) -> ModuleNotFoundError:
    """The error with the command that brings the library, where that is one of an extra's; else as it is."""
    if not of_an_extra(error):
        return error
    library = _library(error)
    text = f"this needs {library}, which is not installed: pip install 'qddot[{EXTRAS[library]}]'"
    return ModuleNotFoundError(text, name=error.name)


@contextmanager
def needed() -> Iterator[None]:
    """Within the block, the error of a library that is not there has the command that brings it."""
    try:
        yield
    except ModuleNotFoundError as error:
        raise missing(error) from None


def drawn(figure: bool | None) -> bool:
    """Whether a figure is drawn: as was said, and where nothing was said if the library for it is there.

    Where that is missing, a line says so; ModuleNotFoundError where a figure was asked for.
    """
    if figure is False or _is_there("matplotlib"):
        return figure is not False
    error = missing(ModuleNotFoundError(name="matplotlib"))
    if figure:
        raise error
    print(f"no figure: {error}")
    return False


def _library(error: ModuleNotFoundError) -> str:
    return (error.name or "").partition(".")[0]


def _is_there(library: str) -> bool:
    try:
        return importlib.util.find_spec(library) is not None
    except ModuleNotFoundError:
        return False
