"""A study file as a checked `StudyTable`, or an error that says where in the file and what is valid there."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from qddot.runner.checks import unknown
from qddot.runner.study.explain import explained
from qddot.runner.study.identified import with_identified
from qddot.runner.study.library import Entry, completed
from qddot.runner.study.overrides import Tree, changed
from qddot.runner.study.places import place
from qddot.runner.study.schema import StudyTable
from qddot.runner.study.toml import tables_of, text_of

__all__ = ["StudyError", "check", "naming_file", "naming_keys", "place", "read", "read_tree"]

#: What is expected of a person who gives another file.
EXPECTED = "expected a study, a TOML file; `qddot list studies` names some"
#: What files hold that are taken for studies, by the ending.
_OTHERS = {
    ".py": "is Python; `qddot generate FILE --into FOLDER` makes kernels of a model, and a study names them by `model`",
    ".nc": "holds the results of a run; xarray.open_dataset opens it",
    ".zarr": "is the store of a batch; `qddot summary`, `plot` and `export` read it",
    ".csv": "is a table; a study names it in an input, `file = ...`",
    ".txt": "is a text; `qddot compare` reads equations",
    ".ipynb": "is a notebook",
}


class StudyError(ValueError):
    """A study that cannot be run; the message names the file, the line and the key."""


def read(path: Path, changes: Mapping[str, Any] | None = None) -> StudyTable:
    """Read and check a study file, with these values by dotted key in place of the file's.

    Raises StudyError listing everything that is wrong with its keys and types.
    """
    text, tree = read_tree(path, changes)
    return check(path, text, tree)


def read_tree(path: Path, changes: Mapping[str, Any] | None = None) -> tuple[str, Tree]:
    """The text of a study file and its tables, changed but not checked. Raises StudyError where it is no TOML."""
    if found := what_it_holds(path):
        raise StudyError(f"{path} {found}; {EXPECTED}")
    try:
        text = text_of(path)
        tree = tables_of(text)
    except FileNotFoundError:
        raise StudyError(f"{path}: there is no such file{_nearest_file(path)}") from None
    except IsADirectoryError:
        raise StudyError(f"{path} is a folder; {EXPECTED}") from None
    except (OSError, ValueError) as error:
        raise StudyError(f"{path}: {error}") from None
    try:
        tree = with_identified(tree, path)
    except ValueError as error:
        raise StudyError(f"{place(path, 'identified', text)}: {error}") from None
    try:
        return text, changed(tree, changes or {})
    except ValueError as error:
        raise StudyError(f"{path}: --set {error}") from None


def check(path: Path, text: str, tree: Tree, library: Callable[[], Mapping[str, Entry]] | None = None) -> StudyTable:
    """The study in these tables, what it takes from the library filled in; `path` and its `text` are for messages.

    library: gives its entries where the caller has read them already.
    """
    try:
        return StudyTable.model_validate(completed(tree, path, library))
    except KeyError as error:
        key, message = error.args
        raise StudyError(f"{place(path, key, text)}: {message}") from None
    except ValidationError as error:
        raise StudyError(explained(path, text, error, StudyTable)) from None


@contextmanager
def naming_file(path: Path) -> Iterator[None]:
    """Lets a ValueError inside name the study's file: a StudyError."""
    try:
        yield
    except StudyError:
        raise
    except ValueError as error:
        text = str(error)
        raise StudyError(text if text.startswith(str(path)) else f"{path}: {text}") from error


@contextmanager
def naming_keys(path: Path, text: str) -> Iterator[None]:
    """Lets a ValueError inside that begins with a key of the study name the file and the line, too: a StudyError."""
    try:
        yield
    except StudyError:
        raise
    except ValueError as error:
        key, colon, rest = str(error).partition(": ")
        known = colon and key.split(".")[0] in StudyTable.model_fields
        raise StudyError(f"{place(path, key, text)}: {rest}" if known else f"{path}: {error}") from error


def what_it_holds(path: Path) -> str:
    """What a file that cannot be a study is, by its ending: "is Python; ..."; empty for any other."""
    return _OTHERS.get(path.suffix.lower(), "")


def _nearest_file(path: Path) -> str:
    if not path.parent.is_dir():
        return f", and no folder {path.parent}"
    others = sorted(each.name for each in path.parent.glob("*.toml"))
    return f"; {unknown('study', path.name, others)}" if others else ""
