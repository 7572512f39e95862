"""The commands: what each is called, what it takes, and the function in its room that does it.

To add one: a line here, and a function that gives the exit status.
"""

import argparse
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, nullcontext
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple

from qddot.extras import drawn

__all__ = ["COMMANDS", "Command"]


class Argument(NamedTuple):
    """What `argparse.ArgumentParser.add_argument` takes."""

    names: tuple[str, ...]
    settings: dict[str, Any]


class Command(NamedTuple):
    """A command: `function` does it and gives the exit status; its parameters are what the arguments are called."""

    function: Callable[..., int]
    help: str
    arguments: tuple[Argument, ...]


def _call(room: str, name: str, /, **given: Any) -> int:
    """Import a function, and call it."""
    status: int = getattr(import_module(room), name)(**given)
    return status


def _compute(room: str, name: str, /, **given: Any) -> int:
    """`_call` of what compiles and integrates, see `_working`."""
    with _working():
        return _call(room, name, **given)


@contextmanager
def _working() -> Iterator[None]:
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


def _run(study: Path, into: Path, figure: bool | None, settings: Sequence[str], row: int | None) -> int:
    from qddot.runner.report.background import Drawing

    with Drawing() if drawn(figure) else nullcontext() as drawing:  # imports matplotlib while we import numba
        given = {"path": study, "into": into, "drawing": drawing, "settings": settings, "row": row}
        return _compute("qddot.runner.commands.run", "run", **given)


def _batch(figure: bool | None, **given: Any) -> int:
    return _compute("qddot.runner.commands.batch", "batch", figure=drawn(figure), **given)


def _report(claims: Path, into: Path, pdf: bool) -> int:
    from qddot.codegen.equations.command import equations_page
    from qddot.paper.command import write_report

    with _working():
        write_report(claims, equations_page("m113"), into, pdf)
    return 0


def _argument(*names: str, **settings: Any) -> Argument:
    return Argument(names, settings)


def _flag(name: str, help: str, **settings: Any) -> Argument:
    return _argument(name, action="store_true", help=help, **settings)


def _path(name: str, help: str, default: str | None = None, **settings: Any) -> Argument:
    written = f"{help}; {default} by default." if default else help
    chosen = Path(default) if default else None
    return _argument(name, metavar="PATH", type=Path, default=chosen, help=written, **settings)


def _several(name: str, metavar: str, help: str, **settings: Any) -> Argument:
    return _argument(name, metavar=metavar, action="append", default=[], help=help, **settings)


def _switch(name: str, help: str) -> Argument:
    return _argument(name, action=argparse.BooleanOptionalAction, default=True, help=help)


_MODELS = _argument("names", metavar="MODEL", nargs="*", help="Models, or files that define one; all by default.")
_STUDY = _argument("study", metavar="STUDY", type=Path, help="A study: a TOML file, see studies/.")
_STORE = _argument("store", metavar="STORE", type=Path, help="The Zarr store of a batch.")
_SET = _several("--set", "KEY=VALUE", "Change the study: parameters.m_6=11t, inputs.F.times=[1,2.85].", dest="settings")
_FIGURE = _argument(
    "--figure",
    action=argparse.BooleanOptionalAction,
    default=None,
    help="Draw the figure, or not; drawn if it can be.",
)
_JSON = _flag("--json", "Print JSON and draw nothing.", dest="as_json")

COMMANDS = {
    "new": Command(
        partial(_call, "qddot.codegen.new", "new"),
        "Write a commented model of your own and a study of it, to begin with.",
        (
            _argument("name", metavar="NAME", help="What the model is called: NAME.py and NAME.toml."),
            _path("--into", "Folder to write to", "."),
        ),
    ),
    "generate": Command(
        partial(_call, "qddot.codegen.command", "generate"),
        "Derive models and write their kernels and equations.",
        (
            _MODELS,
            _path("--into", "Folder to write to; for shipped models generated/, where you stand."),
            _flag("--check", "Write nothing; say which files differ, and exit with 1 where one does."),
            _flag("--diff", "With --check: print how they differ."),
        ),
    ),
    "equations": Command(
        partial(_call, "qddot.codegen.equations.command", "equations"),
        "Show the derived equations, and write them as HTML and, where LaTeX is installed, as PDF.",
        (
            _MODELS,
            _path("--into", "Folder for the HTML pages and PDFs", "results/equations"),
            _flag("--quiet", "Print no equations, only what was written."),
        ),
    ),
    "compare": Command(
        partial(_call, "qddot.codegen.compare.command", "run"),
        "Compare hand-written equations of motion with those derived, term by term; exits with 1 where they differ.",
        (
            _argument("path", metavar="EQUATIONS", type=Path, help="A text file of equations, see studies/paper/."),
            _argument("--model", dest="name", metavar="NAME", help="The model, where the file names none."),
            _argument("--latex", dest="form", action="store_const", const="latex", default="text", help="Print LaTeX."),
            _argument("--json", dest="form", action="store_const", const="json", help="Print JSON."),
        ),
    ),
    "run": Command(
        _run,
        "Run a study once: a NetCDF file, a figure and a summary.",
        (
            _STUDY,
            _path("--into", "Folder for the results", "results"),
            _FIGURE,
            _SET,
            _argument("--row", type=int, help="Run this run of the study's sweep, counted from 0."),
        ),
    ),
    "identify": Command(
        partial(_compute, "qddot.runner.commands.identify", "identify"),
        "Fit unknowns of studies to observations, and say how sure each is.",
        (
            _argument("path", metavar="STUDY", type=Path, help="A TOML file, see studies/paper/identify_*.toml."),
            _path("--into", "Folder for the parameter set and the figure", "results/identified"),
            _JSON,
        ),
    ),
    "batch": Command(
        _batch,
        "Run all runs of a study's sweep, or go on with a batch that was stopped.",
        (
            _STUDY,
            _path("--out", "The Zarr store; results/STUDY.zarr by default."),
            _SET,
            _argument("--workers", type=int, help="Compute in so many Dask worker processes."),
            _argument("--scheduler", metavar="TCP://...", help="Compute on a Dask scheduler's workers."),
            _flag("--fresh", "Remove a store that is there, and compute all again."),
            _flag(
                "--keep-kernels",
                "Keep to the kernels that the store was begun with, though the model changed.",
            ),
            _FIGURE,
        ),
    ),
    "summary": Command(
        partial(_call, "qddot.runner.commands.summary", "summary"),
        "Sum a batch up: best, worst, quantiles, failures.",
        (_STORE,),
    ),
    "plot": Command(
        partial(_call, "qddot.runner.commands.plot", "plot"),
        "Draw a batch: metrics over one axis, a map over two, trajectories of chosen runs.",
        (
            _STORE,
            _several("--metric", "METRIC", "A metric to draw; all by default. Repeat for more.", dest="metrics"),
            _several("--over", "AXIS", "An axis of the sweep; twice for a map."),
            _argument("--runs", help="Trajectories of these runs: 0,5,17, or best, or worst."),
            _path("--into", "The picture: PNG, SVG or PDF."),
        ),
    ),
    "export": Command(
        partial(_call, "qddot.runner.commands.export", "export"),
        "Export a batch as a table, one line a run.",
        (_STORE, _argument("--to", metavar="FILE", type=Path, required=True, help="FILE.csv or FILE.parquet.")),
    ),
    "schema": Command(
        partial(_call, "qddot.runner.commands.schema", "schema"),
        "Give the JSON Schema of studies, for editors.",
        (_argument("--into", dest="path", metavar="PATH", type=Path, help="Write it here; printed by default."),),
    ),
    "list": Command(
        partial(_call, "qddot.runner.commands.catalogue", "catalogue"),
        "List models, studies, the library's guns and roads, integration methods and metrics.",
        (
            _argument(
                "what",
                metavar="WHAT",
                nargs="?",
                default="all",
                help="models, studies, library, methods or metrics; all by default.",
            ),
        ),
    ),
    "show": Command(
        partial(_compute, "qddot.runner.commands.show", "show"),
        "Show a model: its tables, static equilibrium and modes; or a study: what drives it, as a table and a figure.",
        (
            _argument("name", metavar="NAME", help="A model's name, a generated module, or a study (.toml)."),
            _argument("--parameters", metavar="SET", help="Parameter set for the modes; all sets by default."),
            _path("--into", "Folder for the figure of a study's inputs", "results"),
        ),
    ),
    "verify": Command(
        partial(_compute, "qddot.paper.command", "verification"),
        "Verify section 3.1 of the M113 paper: six schemes against the analytic solution.",
        (_path("--into", "Folder for the figures", "results/verification"), _JSON),
    ),
    "paper": Command(
        partial(_compute, "qddot.paper.command", "paper"),
        "Compute the M113 paper again and judge its claims; exits with 1 where one is no longer met.",
        (
            _path("--claims", "Settings and claims; the paper's by default.", dest="path"),
            _argument("--parameters", metavar="SET", help="Parameter set of the M113 in place of the paper's."),
            _path("--into", "Folder for the figures and the claims", "results/paper"),
            _JSON,
        ),
    ),
    "report": Command(
        _report,
        "Write the report of the M113 paper: one HTML page with equations, claims, plots and an animation; and as PDF.",
        (
            _path("--claims", "What `qddot paper` wrote", "results/paper/claims.json"),
            _path("--into", "The page to write", "results/paper/report.html"),
            _switch("--pdf", "Print it as PDF, too, where a browser is installed, or not."),
        ),
    ),
}
