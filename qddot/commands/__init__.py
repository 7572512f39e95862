"""The commands, one a file, called by its name: COMMAND says what it takes and the function that does it."""

import pkgutil
from collections.abc import Iterator, Mapping
from functools import cache
from importlib import import_module

from qddot.command import Command

__all__ = ["COMMANDS"]


class _Commands(Mapping[str, Command]):
    """Name -> command, read-only; a file is imported when its command is asked for."""

    def __getitem__(self, name: str) -> Command:
        if name not in _names():
            raise KeyError(name)
        found: Command = import_module(f"{__name__}.{name}").COMMAND
        return found

    def __iter__(self) -> Iterator[str]:
        return iter(_names())

    def __len__(self) -> int:
        return len(_names())


COMMANDS: Mapping[str, Command] = _Commands()


@cache
def _names() -> tuple[str, ...]:
    return tuple(sorted(file.name for file in pkgutil.iter_modules(__path__)))
