"""Where models are found: the files of model/, and files of the user's own."""

import importlib
import importlib.util
import reprlib
from collections.abc import Mapping
from pathlib import Path

from qddot import model
from qddot.codegen.slips import explained
from qddot.model.system import ModelError, System
from qddot.words import nearest

_MODELS = Path(model.__file__).parent


def shipped_names() -> tuple[str, ...]:
    """Names of the models in model/: the files that define a function `system`, in alphabetical order."""
    return tuple(sorted(path.stem for path in _MODELS.glob("*.py") if "\ndef system(" in path.read_text("utf-8")))


def shipped(name: str) -> System:
    """The model of that name; raises ModelError with the nearest name where there is none."""
    names = shipped_names()
    if name not in names:
        hint = f"{nearest(name, names)} (models: {', '.join(names)}; or a file, path/to/model.py)"
        raise ModelError(f"there is no model {name!r}{hint}")
    with explained(_MODELS / f"{name}.py"):
        return _checked(importlib.import_module(f"qddot.model.{name}").system())


def from_file(path: Path) -> System:
    """The model that a file's function `system()` gives.

    The file is the user's own program and is run as such. Raises ModelError where it cannot be, in one line that names
    the file, the line and, for a name that does not exist, the nearest one.
    """
    if not path.is_file():
        raise ModelError(f"{path}: there is no such file")
    spec = importlib.util.spec_from_file_location(f"qddot_model_{path.stem}", path)
    if spec is None or spec.loader is None:
        raise ModelError(f"{path}: expected a Python file, path/to/model.py")
    module = importlib.util.module_from_spec(spec)
    with explained(path):
        spec.loader.exec_module(module)
        if not callable(getattr(module, "system", None)):
            raise ModelError("expected a function system() that gives a qddot.model.System")
        return _checked(module.system())


def find(names: tuple[str, ...]) -> Mapping[str, System]:
    """Systems by the source named in their header; every shipped model where no name is given.

    A name is a shipped model's, or the path of a file that defines one.
    """
    found: dict[str, System] = {}
    for name in names or shipped_names():
        own = name.endswith(".py") or "/" in name
        found[Path(name).name if own else f"model/{name}.py"] = from_file(Path(name)) if own else shipped(name)
    return found


def _checked(system: object) -> System:
    if not isinstance(system, System):
        raise ModelError(f"system() gives {reprlib.repr(system)}, expected a qddot.model.System")
    return system
