"""Kernels whose model changed since they were generated: who loads them is warned, commands have them generated anew.

What is loaded in place of a generated module is a `Choice`. Commands make one for as long as they work, see `choosing`;
everywhere else, in workers too, modules are loaded as they stand. Kernels that a command has generated are kept beside
the study, in a folder named by the digest of all they are made of; the folder `generated/` is never written to. A study
may name a model's own file: it stands for a module that commands generate in the same way.
"""

import hashlib
import os
import secrets
import shutil
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from glob import escape
from pathlib import Path

from qddot import origin
from qddot.runner.files import alone, folder_ready, keep_newest, written_aside
from qddot.words import from_here

#: Where kernels are kept, below the study's folder, and for how many texts of models.
_OWN, _KERNELS, _KEPT = ".qddot", "kernels", 8

#: From a generated module, the files that changed since, and the study's folder to the module that is loaded. A model's
#: own file stands for a module of which that file has changed.
Choice = Callable[[Path, Sequence[Path], Path], Path]
#: From a model, a name or a file, and a folder to the files generated there.
Generate = Callable[[str, Path], None]


class StaleKernels(UserWarning):
    """Kernels that were generated from another text of their model than the one that is there."""


def fitting(module: Path, beside: Path) -> Path:
    """The module to load for this one; beside: the folder of the study that asks for it."""
    changed = [module] if origin.is_model(module) else origin.changed(module)
    return _choices[-1](module, changed, beside)


@contextmanager
def choosing(choice: Choice) -> Iterator[None]:
    """Let modules be chosen so within the block."""
    _choices.append(choice)
    try:
        yield
    finally:
        _choices.pop()


def warned(module: Path, changed: Sequence[Path], beside: Path) -> Path:
    """The module as it stands; a warning says where it is not what its model gives."""
    if changed and not origin.is_model(module):
        said = f"{_changed(module, changed)}: {_command(module)} brings its kernels up to date"
        warnings.warn(said, StaleKernels, stacklevel=5)  # where `load` is called
    return module


def as_it_stands(module: Path, changed: Sequence[Path], beside: Path) -> Path:
    """The module as it stands, without a word."""
    return module


def anew(generate: Generate, say: Callable[[str], None]) -> Choice:
    """A module that is what the model gives now: generated where there is none, which is said in one line."""
    known: dict[Path, Path] = {}

    def choose(module: Path, changed: Sequence[Path], beside: Path) -> Path:
        if not changed:
            return module
        if module not in known:
            entry = _entry(module, beside)
            if not origin.is_model(module):
                where = f"using kernels of its present text, in {from_here(entry)}"
                say(f"{_changed(module, changed)}: {where}; {_command(module)} writes them for good")
            elif _module_in(entry) is None:
                say(f"generating kernels of {from_here(module)} into {from_here(entry)}")
            known[module] = _made(module, changed, entry, generate)
        return known[module]

    return choose


def begun_with(digest: str, why: str) -> Choice:
    """The module whose kernels have this digest, of those that are there; generates none.

    Raises ValueError with `why` where the model changed and these are not the kernels of its present text.
    """

    def choose(module: Path, changed: Sequence[Path], beside: Path) -> Path:
        if not changed:
            return module
        present = _module_in(_entry(module, beside))
        if present is None or kernel_digest(present) != digest:
            raise ValueError(f"{_changed(module, changed)}{why}")
        return present

    return choose


def kept(digest: str) -> Choice:
    """The module whose kernels have this digest, of whatever text of the model; the module as it stands if none has."""

    def choose(module: Path, changed: Sequence[Path], beside: Path) -> Path:
        entries = sorted(_folder(beside).glob(f"{escape(module.stem)}-*"))
        others = (found for found in map(_module_in, entries) if found is not None)
        return next((each for each in (module, *others) if kernel_digest(each) == digest), module)

    return choose


def kernel_digest(module: Path) -> str:
    """SHA-256 of a generated module's text but for its header: of its kernels, wherever they were generated."""
    return hashlib.sha256(origin.body(module.read_bytes())).hexdigest()


_choices: list[Choice] = [warned]


def _source(module: Path) -> Path:
    """The model's own file."""
    return module.resolve() if origin.is_model(module) else next(iter(origin.read(module)))


def _changed(module: Path, changed: Sequence[Path]) -> str:
    if origin.is_model(module):
        return f"{from_here(module)} is not the text that the kernels were generated from"
    return f"{', '.join(map(from_here, changed))} changed since {from_here(module)} was generated"


def _command(module: Path) -> str:
    """What a person types to generate the module again."""
    name, folder = origin.shipped(_source(module)), from_here(module.parent)
    if name is not None and folder == "generated":
        return f"`qddot generate {name}`"
    return f"`qddot generate {name or from_here(_source(module))} --into {folder}`"


def _folder(beside: Path) -> Path:
    return beside.resolve() / _OWN / _KERNELS


def _entry(module: Path, beside: Path) -> Path:
    """The folder of the kernels that the model gives now: of its text, what it imports, and what generates them."""
    parts = [origin.generator(), *(f"{file.name} {known}" for file, known in origin.sources(_source(module)).items())]
    return _folder(beside) / f"{module.stem}-{hashlib.sha256(' '.join(parts).encode()).hexdigest()[:16]}"


def _module_in(entry: Path) -> Path | None:
    return next(iter(sorted(entry.glob("*.py"))), None)


def _made(module: Path, changed: Sequence[Path], entry: Path, generate: Generate) -> Path:
    """The module in a folder of the cache; one process at a time makes it, beside its place, and renames it.

    Raises ValueError where nothing can be written there, and what `generate` raises.
    """
    try:
        folder_ready(entry.parent)
        if not (ignored := entry.parent.parent / ".gitignore").exists():
            with written_aside(ignored) as aside:
                aside.write_text("*\n", "utf-8")
    except OSError as error:
        no_place = f"there is no place for new kernels: {entry.parent}: {error.strerror}"
        raise ValueError(f"{_changed(module, changed)}, and {no_place}; use {_command(module)}") from error
    with alone(entry.parent):
        if _module_in(entry) is None:
            _make(entry, origin.shipped(_source(module)) or str(_source(module)), generate)
        os.utime(entry)
    made = _module_in(entry)
    assert made is not None
    keep_newest(entry.parent, f"*-{16 * '[0-9a-f]'}", _KEPT)
    return made


def _make(entry: Path, model: str, generate: Generate) -> None:
    for left in entry.parent.glob(f".*.{8 * '[0-9a-f]'}"):  # by a process that was killed
        shutil.rmtree(left, ignore_errors=True)
    aside = entry.with_name(f".{entry.name}.{secrets.token_hex(4)}")
    try:
        generate(model, aside)
        os.rename(aside, entry)
    finally:
        shutil.rmtree(aside, ignore_errors=True)
