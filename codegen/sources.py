"""Where models are found: the files of model/, and files of the user's own."""

import reprlib
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from importlib.machinery import ModuleSpec, SourceFileLoader
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import CodeType

from qddot import model, origin
from qddot.codegen.slips import explained
from qddot.model.system import ModelError, System
from qddot.words import nearest

_MODELS = Path(model.__file__).parent


@dataclass(frozen=True)
class Source:
    """Where a model comes from: what headers say of it, and its file with what that imports from beside it, if any.

    files: their digests. own: whether it is a model of the user's own.
    """

    said: str
    file: Path | None = None
    own: bool = False
    files: Mapping[Path, str] = field(default_factory=dict, compare=False)

    def __str__(self) -> str:
        return self.said if self.said.isprintable() else ascii(self.said)


def shipped_names() -> tuple[str, ...]:
    """Names of the models in model/: the files that define a function `system`, in alphabetical order."""
    return tuple(file.stem for file in origin.shipped_files())


def shipped(name: str) -> System:
    """The model of that name; raises ModelError with the nearest name where there is none."""
    names = shipped_names()
    if name not in names:
        hint = f"{nearest(name, names)} (models: {', '.join(names)}; or a file, path/to/model.py)"
        raise ModelError(f"there is no model {name!r}{hint}")
    return from_file(_MODELS / f"{name}.py")


def from_file(path: Path) -> System:
    """The model that a file's function `system()` gives.

    The file is the user's own program and is run as such; it may import what lies beside it. Raises ModelError where it
    cannot be, in one line that names the file, the line and, for a name that does not exist, the nearest one.
    """
    if not path.is_file():
        raise ModelError(f"{path}: there is no such file")
    if path.suffix != ".py":
        raise ModelError(f"{path}: expected a Python file, path/to/model.py")
    name = f"qddot_model_{path.stem}"
    loader = _Text(name, str(path))
    module = module_from_spec(ModuleSpec(name, loader, origin=str(path)))
    with explained(path), _beside(path):
        loader.exec_module(module)
        if not callable(getattr(module, "system", None)):
            raise ModelError("expected a function system() that gives a qddot.model.System")
        return _checked(module.system())


def find(names: tuple[str, ...]) -> Mapping[Source, System]:
    """Systems by where they come from; every shipped model where no name is given.

    A name is a shipped model's, or the path of a file that defines one. Files are read before they are run: what is
    edited meanwhile is seen to be another text.
    """
    found: dict[Source, System] = {}
    for name in names or shipped_names():
        own = name.endswith(".py") or "/" in name
        file = Path(name) if own else _MODELS / f"{name}.py"
        files = origin.sources(file) if file.is_file() else {}
        source = Source(file.name if own else f"model/{name}.py", file, own, files)
        found[source] = from_file(file) if own else shipped(name)
    return found


class _Text(SourceFileLoader):
    """Python as it stands in its file now: a compiled copy beside it may be of another text of the same second."""

    def get_code(self, fullname: str) -> CodeType:
        """The code of the module."""
        path = self.get_filename(fullname)
        code: CodeType = self.source_to_code(self.get_data(path), path)
        return code


class _Finder:
    """Finds modules by name in the files that lie beside a model."""

    def __init__(self, files: Mapping[str, Path]) -> None:
        self._files = files

    def find_spec(self, name: str, path: Sequence[str] | None = None, target: object = None) -> ModuleSpec | None:
        """The module of this name, None where it is no file beside the model."""
        file = self._files.get(name)
        return spec_from_file_location(name, file, loader=_Text(name, str(file))) if file is not None else None


@contextmanager
def _beside(path: Path) -> Iterator[None]:
    """Within the block a model can import what lies beside it; forgotten afterwards: another model may have others."""
    folder = path.resolve().parent
    others = [file for file in origin.sources(path) if file.is_relative_to(folder) and file != path.resolve()]
    parts = {file: file.relative_to(folder).with_suffix("").parts for file in others if origin.shipped(file) is None}
    names = {".".join(each[:-1] if each[-1] == "__init__" else each): file for file, each in parts.items()}
    before = {name: module for name, module in sys.modules.items() if name in names}
    finder = _Finder(names)
    sys.meta_path.insert(0, finder)
    for name in before:
        del sys.modules[name]
    try:
        yield
    finally:
        sys.meta_path.remove(finder)
        for name in names:
            sys.modules.pop(name, None)
        sys.modules.update(before)


def _checked(system: object) -> System:
    if not isinstance(system, System):
        raise ModelError(f"system() gives {reprlib.repr(system)}, expected a qddot.model.System")
    return system
