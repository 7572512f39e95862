"""What generated kernels were made from: digests in a module's header, written by `codegen`, read by who loads it.

A line for each file, `# SHA-256 of "../duffing.py": 0123...`: the model's own first, then what it imports from beside
it and the files of its tables. A model of the user's own is named as seen from the folder of the generated module, one
that comes with qddot by its Python name.
"""

import ast
import hashlib
import json
import os
from collections.abc import Iterator, Mapping
from contextlib import suppress
from functools import cache
from importlib.util import find_spec
from pathlib import Path

_MARK, _SHIPPED = b"# SHA-256 of ", "qddot.model"


def digest(file: Path) -> str:
    """SHA-256 of a text file, the same however its lines end. Raises OSError where it cannot be read."""
    return hashlib.sha256(file.read_bytes().replace(b"\r\n", b"\n")).hexdigest()


def sources(file: Path) -> dict[Path, str]:
    """The model in `file` and the files that it imports from beside it, each with its digest now.

    They are found in the syntax tree; nothing is run. Of `qddot.model` other models count, not what models are written
    with: that belongs to the generator. Raises OSError where the model itself cannot be read.
    """
    found = {file.resolve(): digest(file)}
    todo = list(found)
    while todo:
        for each in _imported(todo.pop(), file.resolve().parent):
            if each not in found:
                found[each] = digest(each)
                todo.append(each)
    return found


def origin(files: Mapping[Path, str], folder: Path) -> dict[str, str]:
    """The digests of these files by what a module in `folder` calls them."""
    return {_name(file, folder.resolve()): known for file, known in files.items()}


def line(name: str, known: str) -> str:
    """The line of the header for a file."""
    return f"{_MARK.decode()}{json.dumps(name)}: {known}"


def read(module: Path) -> dict[Path, str]:
    """The digests that a generated module's header holds, by file; nothing where it has none.

    Raises OSError where the module cannot be read.
    """
    found = {}
    for text in _header(module.read_bytes()):
        if text.startswith(_MARK):
            name, _, known = text.removeprefix(_MARK).rpartition(b": ")
            with suppress(ValueError):  # of a line that somebody else wrote
                found[_file(json.loads(name), module.resolve().parent)] = known.decode()
    return found


def changed(module: Path) -> list[Path]:
    """The files whose text is no longer the one that a module was generated from.

    None where its model's source is not there, or cannot be read: then there is nothing to make other kernels of.
    """
    known = read(module)
    if not all(os.access(own, os.R_OK) for own in [*known][:1]):
        return []
    return [file for file, before in known.items() if os.access(file, os.R_OK) and digest(file) != before]


def body(module: bytes) -> bytes:
    """A generated module's text without its header: what its kernels are, wherever they were generated from."""
    return module[sum(len(text) + 1 for text in _header(module)) :]


def shipped(file: Path) -> str | None:
    """The name of the model that comes with qddot in this file; None for any other."""
    return file.stem if file.parent == _models() and is_model(file) else None


def model_file(name: str) -> Path | None:
    """The file of the model of this name that comes with qddot; None where there is none."""
    file = _models() / f"{name}.py"
    return file if name.isidentifier() and is_model(file) else None


def shipped_files() -> tuple[Path, ...]:
    """The models that come with qddot, in alphabetical order."""
    return tuple(file for file in sorted(_models().glob("*.py")) if is_model(file))


@cache
def generator() -> str:
    """The digest of all that makes a module of a model: the generator and what models are written with."""
    rooms = [room("qddot.codegen"), _models()]
    texts = (file for room in rooms for file in sorted(room.rglob("*.*")) if file.suffix in (".py", ".jinja"))
    return hashlib.sha256("".join(digest(file) for file in texts if shipped(file) is None).encode()).hexdigest()


def _header(module: bytes) -> Iterator[bytes]:
    start = 0
    while module.startswith(b"#", start) and (end := module.find(b"\n", start)) >= 0:
        yield module[start:end]
        start = end + 1


@cache
def _models() -> Path:
    """The folder of the models that come with qddot."""
    return room(_SHIPPED)


def room(name: str) -> Path:
    """The folder of a package, which is not imported."""
    spec = find_spec(name)
    places = (spec.submodule_search_locations if spec is not None else None) or [""]
    return Path(places[0]).resolve()


def _name(file: Path, folder: Path) -> str:
    name = shipped(file)
    return Path(os.path.relpath(file, folder)).as_posix() if name is None else f"{_SHIPPED}.{name}"


def _file(name: str, folder: Path) -> Path:
    if not name.startswith(f"{_SHIPPED}."):
        return Path(os.path.normpath(folder / name))
    return _models() / f"{name.removeprefix(f'{_SHIPPED}.')}.py"


def _imported(file: Path, beside: Path) -> Iterator[Path]:
    """Files in the folder `beside` and models of qddot's that a file imports; none where it is no Python."""
    try:
        tree = ast.parse(file.read_bytes())
    except (SyntaxError, ValueError, RecursionError):
        return
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and not node.level:
            names = [f"{node.module}.{alias.name}" for alias in node.names]
        else:
            continue
        for name in names:
            yield from _files(name.split("."), beside)


def _files(parts: list[str], beside: Path) -> Iterator[Path]:
    """The files that importing a dotted name reads: packages on the way, and the module."""
    if ".".join(parts[:2]) == _SHIPPED:
        file = _models() / f"{'.'.join(parts[2:3])}.py"
        if is_model(file):
            yield file
        return
    for end in range(1, len(parts) + 1):
        place = beside.joinpath(*parts[:end])
        yield from (file for file in (place.with_suffix(".py"), place / "__init__.py") if file.is_file())


def is_model(file: Path) -> bool:
    """Whether a file defines a model, by its text: nothing is run."""
    return file.is_file() and b"\ndef system(" in file.read_bytes()
