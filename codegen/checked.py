"""What was seen to be as the models give it: where nothing changed that goes into it, nobody derives it again.

A digest of all that decides what the shipped models give and what stands in the folder is kept beside the files, in
`.qddot/`. Models of the user's own are always derived: what their programs read, nobody knows.
"""

import hashlib
import sys
from collections.abc import Iterator
from contextlib import suppress
from importlib.metadata import version
from pathlib import Path

from qddot import origin

#: Where what is known is kept, in the folder of the files.
_OWN = ".qddot"
#: Libraries that have a say in what is generated.
_LIBRARIES = ("sympy", "symengine", "jinja2", "ruff")


def seal(names: tuple[str, ...], folder: Path, whole: bool) -> str | None:
    """The digest of shipped models, all where no name is given, of what generates them, and of the files in a folder.

    whole: orphans in the folder count, too. None where one of the names is not a shipped model's. Raises OSError where
    a file cannot be read.
    """
    models = tuple(map(origin.model_file, names)) if names else origin.shipped_files()
    if None in models:
        return None
    parts = [sys.version, str(whole), origin.generator(), *(f"{name} {version(name)}" for name in _LIBRARIES)]
    parts += [f"{file.name} {known}" for model in models if model for file, known in origin.sources(model).items()]
    parts += _texts(folder)
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()


def is_known(names: tuple[str, ...], folder: Path, sealed: str) -> bool:
    """Whether the files were seen to be what the models give when all had this digest."""
    place = _place(names, folder)
    return place.is_file() and place.read_text("utf-8") == sealed


def remember(names: tuple[str, ...], folder: Path, sealed: str) -> None:
    """Note that they are. Where it cannot be written, they are derived the next time, too."""
    from qddot.codegen.generate import write_atomically  # noqa: PLC0415 - SymPy, which has derived them by now

    place = _place(names, folder)
    with suppress(OSError):
        write_atomically(place, sealed)
        write_atomically(folder / _OWN / ".gitignore", "*\n")


def _texts(folder: Path) -> Iterator[str]:
    """A line for each file that was, or could have been generated, and for each that those were generated from."""
    for file in sorted((*folder.glob("*.py"), *folder.glob("*.tex"))):
        yield f"{file.name} {hashlib.sha256(file.read_bytes()).hexdigest()}"
        for source in origin.read(file):
            yield f"{source} {origin.digest(source) if source.is_file() else ''}"


def _place(names: tuple[str, ...], folder: Path) -> Path:
    return folder / _OWN / "checked" / ("+".join(sorted({*names})) or "all")
