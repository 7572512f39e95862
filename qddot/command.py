"""What a command is, and what those in `qddot.commands` are written with."""

import argparse
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple


class Argument(NamedTuple):
    """What `argparse.ArgumentParser.add_argument` takes."""

    names: tuple[str, ...]
    settings: dict[str, Any]


class Command(NamedTuple):
    """A command: `function` does it and gives the exit status; its parameters are what the arguments are called."""

    function: Callable[..., int]
    help: str
    arguments: tuple[Argument, ...]


def call(room: str, name: str, /, **given: Any) -> int:
    """Import a function, and call it."""
    status: int = getattr(import_module(room), name)(**given)
    return status


def compute(room: str, name: str, /, **given: Any) -> int:
    """`call` of what compiles and integrates, see `working`."""
    with working():
        return call(room, name, **given)


@contextmanager
def working() -> Iterator[None]:
    """Within the block, kernels are those that models give now, and who waits for numba is told."""
    from qddot.runner.report.progress import compilation_told
    from qddot.runner.stale import anew, choosing

    with (
        compilation_told(),
        choosing(anew(_generate, lambda line: print(f"note: {line}", file=sys.stderr, flush=True))),
    ):
        yield


def _generate(model: str, into: Path) -> None:
    from qddot.codegen.generate import apply, changes
    from qddot.codegen.sources import find

    apply(changes(find((model,)), into, whole=False))


def argument(*names: str, **settings: Any) -> Argument:
    """An argument, see `argparse.ArgumentParser.add_argument`."""
    return Argument(names, settings)


def flag(name: str, help: str, **settings: Any) -> Argument:
    """An option that is given or not."""
    return argument(name, action="store_true", help=help, **settings)


def path(name: str, help: str, default: str | None = None, **settings: Any) -> Argument:
    """An option that takes a path."""
    written = f"{help}; {default} by default." if default else help
    chosen = Path(default) if default else None
    return argument(name, metavar="PATH", type=Path, default=chosen, help=written, **settings)


def several(name: str, metavar: str, help: str, **settings: Any) -> Argument:
    """An option that may be repeated."""
    return argument(name, metavar=metavar, action="append", default=[], help=help, **settings)


def switch(name: str, help: str) -> Argument:
    """An option with a counterpart, --pdf and --no-pdf; on by default."""
    return argument(name, action=argparse.BooleanOptionalAction, default=True, help=help)


MODELS = argument("names", metavar="MODEL", nargs="*", help="Models, or files that define one; all by default.")
STUDY = argument("study", metavar="STUDY", type=Path, help="A study: a TOML file, see studies/.")
STORE = argument("store", metavar="STORE", type=Path, help="The Zarr store of a batch.")
SET = several("--set", "KEY=VALUE", "Change the study: parameters.m_6=11t, inputs.F.times=[1,2.85].", dest="settings")
FIGURE = argument(
    "--figure",
    action=argparse.BooleanOptionalAction,
    default=None,
    help="Draw the figure, or not; drawn if it can be.",
)
JSON = flag("--json", "Print JSON and draw nothing.", dest="as_json")
