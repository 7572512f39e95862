"""What the command `new` writes: a commented model and a study of it, to begin with."""

from pathlib import Path

from qddot.codegen.environment import environment
from qddot.codegen.generate import Change, apply
from qddot.codegen.skeleton import reserved
from qddot.model.naming import name_problem
from qddot.model.system import ModelError


def new(name: str, into: Path) -> int:
    """Write NAME.py and NAME.toml into a folder, and say what to type next.

    Raises ModelError for a name that no model can have, and for files that are there; nothing is replaced.
    """
    why = name_problem(name) or ("is a name of the generated code's own" if name in reserved() else None)
    if why:
        raise ModelError(f"{name!r} {why}; choose another name for the model")
    texts = {into / f"{name}{suffix}": _text(f"new_{kind}{suffix}", name) for suffix, kind in _FILES.items()}
    for path in texts:
        if path.exists():
            raise ModelError(f"{path} is there, and is not replaced: move it, or choose another name")
    apply([Change(path, None, text) for path, text in texts.items()])
    model, study = texts
    print(f"wrote {model}\nwrote {study}")
    print(f"next: qddot equations {model}\n      qddot run {study}")
    return 0


#: Suffix -> what the file is.
_FILES = {".py": "model", ".toml": "study"}


def _text(template: str, name: str) -> str:
    return environment("python").get_template(f"{template}.jinja").render(name=name)
