"""Where models are found: the files of model/, and files of the user's own."""

import importlib
import importlib.util
from collections.abc import Mapping
from difflib import get_close_matches
from pathlib import Path

import model
from model.system import ModelError, System

_MODELS = Path(model.__file__).parent


def shipped_names() -> tuple[str, ...]:
    """Names of the models in model/: the files that define a function `system`, in alphabetical order."""
    return tuple(sorted(path.stem for path in _MODELS.glob("*.py") if "\ndef system(" in path.read_text("utf-8")))


def shipped(name: str) -> System:
    """The model of that name; raises ModelError with the nearest name where there is none."""
    names = shipped_names()
    if name not in names:
        close = get_close_matches(name, names, n=1)
        hint = f"; did you mean {close[0]}?" if close else ""
        raise ModelError(f"there is no model {name!r}{hint} (models: {', '.join(names)}; or a file, path/to/model.py)")
    return _checked(importlib.import_module(f"model.{name}").system(), f"model/{name}.py")


def from_file(path: Path) -> System:
    """The model that a file's function `system()` gives.

    The file is the user's own program and is run as such. Raises ModelError where it cannot be.
    """
    if not path.is_file():
        raise ModelError(f"{path}: there is no such file")
    spec = importlib.util.spec_from_file_location(f"qddot_model_{path.stem}", path)
    if spec is None or spec.loader is None:
        raise ModelError(f"{path}: expected a Python file, path/to/model.py")
    module = importlib.util.module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
    except ModelError:
        raise
    except Exception as error:
        raise ModelError(f"{path}: {type(error).__name__}: {error}{_line(error, path)}") from error
    if not callable(getattr(module, "system", None)):
        raise ModelError(f"{path}: expected a function system() that gives a model.system.System")
    try:
        return _checked(module.system(), str(path))
    except ModelError as error:
        raise ModelError(f"{path}: {error}") from error
    except Exception as error:
        raise ModelError(f"{path}: system(): {type(error).__name__}: {error}{_line(error, path)}") from error


def find(names: tuple[str, ...]) -> Mapping[str, System]:
    """Systems by the source named in their header; every shipped model where no name is given.

    A name is a shipped model's, or the path of a file that defines one.
    """
    found: dict[str, System] = {}
    for name in names or shipped_names():
        own = name.endswith(".py") or "/" in name
        found[Path(name).name if own else f"model/{name}.py"] = from_file(Path(name)) if own else shipped(name)
    return found


def _checked(system: object, source: str) -> System:
    if not isinstance(system, System):
        raise ModelError(f"{source}: system() gives a {type(system).__name__}, expected a model.system.System")
    return system


def _line(error: Exception, path: Path) -> str:
    """Where in the user's file it went wrong."""
    trace, line = error.__traceback__, 0
    while trace is not None:
        if Path(trace.tb_frame.f_code.co_filename) == path:
            line = trace.tb_lineno
        trace = trace.tb_next
    return f" (line {line})" if line else ""
