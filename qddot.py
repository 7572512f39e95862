"""The front door of qddot: the command line, and the names that Python programs use.

    import qddot
    model = qddot.load("m113")
    solution = qddot.simulate(model, (0, 10), method="rk4", step=1e-4, parameters="as_run_unloaded",
                              inputs={"F": qddot.pulse_train(times=[1.0], duration=0.1, impulse=605.0)})
    solution["q_6"], solution.t, solution.statistics

Everything is imported when it is first used, so that `qddot --help` costs nothing.
"""

import argparse
import atexit
import gc
import os
import signal
import sys
from collections.abc import Callable, Sequence
from contextlib import nullcontext
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple, NoReturn

from words import nearest

_PUBLIC = {
    "EquilibriumError": "runner.equilibrium",
    "Event": "runner.events.kinds",
    "IntegrationError": "runner.simulate",
    "LoadError": "runner.load",
    "ModelError": "model.system",
    "ModesError": "runner.modes",
    "Signal": "runner.inputs.signal",
    "Solution": "runner.solution",
    "StoreError": "runner.batch.store",
    "StudyError": "runner.study.read",
    "constant": "runner.inputs.shapes",
    "cosine_bump": "runner.inputs.roads",
    "crossing": "runner.simulate",
    "drive": "runner.inputs.drive",
    "equilibrium": "runner.equilibrium",
    "generate": "codegen.generate",
    "load": "runner.load",
    "measured_pulse_train": "runner.inputs.recoil",
    "modes": "runner.modes",
    "open_batch": "runner.batch.grid",
    "per_run": "runner.lanes.signals",
    "pothole": "runner.inputs.roads",
    "prepare": "runner.simulate",
    "pulse_train": "runner.inputs.shapes",
    "ramp": "runner.inputs.roads",
    "random_road": "runner.inputs.iso8608",
    "recoil_impulse": "runner.inputs.recoil",
    "run_batch": "runner.batch.run",
    "run_study": "runner.study.run",
    "sampled": "runner.inputs.sampled",
    "shot_times": "runner.inputs.recoil",
    "simulate": "runner.simulate",
    "simulate_batch": "runner.lanes.batch",
    "sine": "runner.inputs.shapes",
    "solve": "runner.simulate",
    "step": "runner.inputs.roads",
    "table": "runner.inputs.tables",
    "table_from_csv": "runner.inputs.csv_table",
    "wave": "runner.inputs.roads",
}

__all__ = sorted(_PUBLIC)  # noqa: PLE0605 - the sorted keys are a list of names


def __getattr__(name: str) -> Any:
    """A public name, imported from the room it lives in."""
    if name not in _PUBLIC:
        hint = "" if name.startswith("_") else nearest(name, _PUBLIC)
        raise AttributeError(f"module 'qddot' has no attribute {name!r}{hint}")
    return getattr(import_module(_PUBLIC[name]), name)


_ABOUT = "Lagrange's equations from T, Π and Φ to compiled simulations."


class _Argument(NamedTuple):
    """What `argparse.ArgumentParser.add_argument` takes."""

    names: tuple[str, ...]
    settings: dict[str, Any]


class _Command(NamedTuple):
    """A command: `function` does it and gives the exit status; its parameters are what the arguments are called."""

    function: Callable[..., int]
    help: str
    arguments: tuple[_Argument, ...]


def _call(room: str, name: str, /, **given: Any) -> int:
    """Import a function, and call it."""
    status: int = getattr(import_module(room), name)(**given)
    return status


def _compute(room: str, name: str, /, **given: Any) -> int:
    """`_call` of what compiles and integrates: who waits for numba is told."""
    from runner.report.progress import compilation_told

    with compilation_told():
        return _call(room, name, **given)


def _run(study: Path, into: Path, figure: bool, settings: Sequence[str], row: int | None) -> int:
    from runner.report.background import Drawing

    with Drawing() if figure else nullcontext() as drawing:  # imports matplotlib while this process imports numba
        given = {"path": study, "into": into, "drawing": drawing, "settings": settings, "row": row}
        return _compute("runner.command", "run_and_write", **given)


def _report(claims: Path, into: Path, pdf: bool) -> int:
    from codegen.equations.command import equations_page
    from runner.paper.command import write_report
    from runner.report.progress import compilation_told

    with compilation_told():
        write_report(claims, equations_page("m113"), into, pdf)
    return 0


def _argument(*names: str, **settings: Any) -> _Argument:
    return _Argument(names, settings)


def _flag(name: str, help: str, **settings: Any) -> _Argument:
    return _argument(name, action="store_true", help=help, **settings)


def _path(name: str, help: str, default: str | None = None) -> _Argument:
    written = f"{help}; {default} by default." if default else help
    return _argument(name, metavar="PATH", type=Path, default=Path(default) if default else None, help=written)


def _several(name: str, metavar: str, help: str, **settings: Any) -> _Argument:
    return _argument(name, metavar=metavar, action="append", default=[], help=help, **settings)


def _switch(name: str, help: str) -> _Argument:
    return _argument(name, action=argparse.BooleanOptionalAction, default=True, help=help)


_MODELS = _argument("names", metavar="MODEL", nargs="*", help="Models, or files that define one; all by default.")
_STUDY = _argument("study", metavar="STUDY", type=Path, help="A study: a TOML file, see studies/.")
_STORE = _argument("store", metavar="STORE", type=Path, help="The Zarr store of a batch.")
_SET = _several("--set", "KEY=VALUE", "Change the study: parameters.m_6=11t, inputs.F.times=[1,2.85].", dest="settings")
_FIGURE = _switch("--figure", "Draw the figure, or not.")
_PAPER = Path(__file__).parent / "studies" / "paper" / "paper.toml"
_JSON = _flag("--json", "Print JSON and draw nothing.", dest="as_json")

_COMMANDS = {
    "generate": _Command(
        partial(_call, "codegen.command", "generate"),
        "Derive models and write their kernels and equations.",
        (
            _MODELS,
            _path("--into", "Folder to write to; generated/ for the shipped models."),
            _flag("--check", "Write nothing; say which files differ, and exit with 1 where one does."),
            _flag("--diff", "With --check: print how they differ."),
        ),
    ),
    "equations": _Command(
        partial(_call, "codegen.equations.command", "equations"),
        "Show the derived equations, and write them as HTML and, where LaTeX is installed, as PDF.",
        (
            _MODELS,
            _path("--into", "Folder for the HTML pages and PDFs", "results/equations"),
            _flag("--quiet", "Print no equations, only what was written."),
        ),
    ),
    "compare": _Command(
        partial(_call, "codegen.compare.command", "run"),
        "Compare hand-written equations of motion with those derived, term by term; exits with 1 where they differ.",
        (
            _argument("path", metavar="EQUATIONS", type=Path, help="A text file of equations, see studies/paper/."),
            _argument("--model", dest="name", metavar="NAME", help="The model, where the file names none."),
            _argument("--latex", dest="form", action="store_const", const="latex", default="text", help="Print LaTeX."),
            _argument("--json", dest="form", action="store_const", const="json", help="Print JSON."),
        ),
    ),
    "run": _Command(
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
    "identify": _Command(
        partial(_compute, "runner.identify.command", "identify"),
        "Fit unknowns of studies to observations, and say how sure each is.",
        (
            _argument("path", metavar="STUDY", type=Path, help="A TOML file, see studies/paper/identify_*.toml."),
            _path("--into", "Folder for the parameter set and the figure", "results/identified"),
            _JSON,
        ),
    ),
    "batch": _Command(
        partial(_compute, "runner.batch.command", "batch"),
        "Run all runs of a study's sweep, or go on with a batch that was stopped.",
        (
            _STUDY,
            _path("--out", "The Zarr store; results/STUDY.zarr by default."),
            _SET,
            _argument("--workers", type=int, help="Compute in so many Dask worker processes."),
            _argument("--scheduler", metavar="TCP://...", help="Compute on a Dask scheduler's workers."),
            _flag("--fresh", "Remove a store that is there, and compute all again."),
            _FIGURE,
        ),
    ),
    "summary": _Command(
        partial(_call, "runner.batch.command", "summary"),
        "Sum a batch up: best, worst, quantiles, failures.",
        (_STORE,),
    ),
    "plot": _Command(
        partial(_call, "runner.batch.command", "plot"),
        "Draw a batch: metrics over one axis, a map over two, trajectories of chosen runs.",
        (
            _STORE,
            _several("--metric", "METRIC", "A metric to draw; all by default. Repeat for more.", dest="metrics"),
            _several("--over", "AXIS", "An axis of the sweep; twice for a map."),
            _argument("--runs", help="Trajectories of these runs: 0,5,17, or best, or worst."),
            _path("--into", "The picture: PNG, SVG or PDF."),
        ),
    ),
    "export": _Command(
        partial(_call, "runner.batch.command", "write_export"),
        "Export a batch as a table, one line a run.",
        (_STORE, _argument("--to", metavar="FILE", type=Path, required=True, help="FILE.csv or FILE.parquet.")),
    ),
    "schema": _Command(
        partial(_call, "runner.study.json_schema", "write_schema"),
        "Give the JSON Schema of studies, for editors.",
        (_argument("--into", dest="path", metavar="PATH", type=Path, help="Write it here; printed by default."),),
    ),
    "list": _Command(
        partial(_call, "runner.command", "catalogue"),
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
    "show": _Command(
        partial(_compute, "runner.command", "show"),
        "Show a model: its tables, static equilibrium and modes; or a study: what drives it, as a table and a figure.",
        (
            _argument("name", metavar="NAME", help="A model's name, a generated module, or a study (.toml)."),
            _argument("--parameters", metavar="SET", help="Parameter set for the modes; all sets by default."),
            _path("--into", "Folder for the figure of a study's inputs", "results"),
        ),
    ),
    "verify": _Command(
        partial(_compute, "runner.paper.command", "verification"),
        "Verify section 3.1 of the M113 paper: six schemes against the analytic solution.",
        (_path("--into", "Folder for the figures", "results/verification"), _JSON),
    ),
    "paper": _Command(
        partial(_compute, "runner.paper.command", "paper"),
        "Compute the M113 paper again and judge its claims; exits with 1 where one is no longer met.",
        (
            _argument("--claims", dest="path", metavar="PATH", type=Path, default=_PAPER, help="Settings and claims."),
            _argument("--parameters", metavar="SET", help="Parameter set of the M113 in place of the paper's."),
            _path("--into", "Folder for the figures and the claims", "results/paper"),
            _JSON,
        ),
    ),
    "report": _Command(
        _report,
        "Write the report of the M113 paper: one HTML page with equations, claims, plots and an animation; and as PDF.",
        (
            _path("--claims", "What `qddot paper` wrote", "results/paper/claims.json"),
            _path("--into", "The page to write", "results/paper/report.html"),
            _switch("--pdf", "Print it as PDF, too, where a browser is installed, or not."),
        ),
    ),
}


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="qddot", description=_ABOUT, allow_abbrev=False)
    parser.add_argument(
        "--version", action=_Version, nargs=0, default=argparse.SUPPRESS, help="Print the version, and exit."
    )
    commands = parser.add_subparsers(dest="command", metavar="COMMAND", required=True)
    for name, command in _COMMANDS.items():
        own = commands.add_parser(name, help=command.help, description=command.help, allow_abbrev=False)
        for names, settings in command.arguments:
            own.add_argument(*names, **settings)
    return parser


class _Version(argparse.Action):
    """Prints the version, which is looked up when it is asked for."""

    def __call__(self, parser: argparse.ArgumentParser, *_: Any) -> NoReturn:
        from importlib.metadata import PackageNotFoundError, version

        try:
            print(f"qddot {version('qddot')}")
        except PackageNotFoundError:
            print("qddot, run from its folder: it is not installed, so it has no version")
        parser.exit()


def _arguments(words: Sequence[str]) -> dict[str, Any]:
    """What is given, by name; exits with 2 and one message, the nearest name in it, where there is no such thing."""
    parser = _parser()
    options = ("-h", "--help", "--version")
    if words[0] not in (*_COMMANDS, *options):
        kind, known = ("option", options) if words[0].startswith("-") else ("command", tuple(_COMMANDS))
        hint = nearest(words[0], known) or "; `qddot --help` lists them all"
        parser.error(f"there is no {kind} {words[0]!r}{hint}")
    given, rest = parser.parse_known_args(words)
    if rest:
        own = {name for each in _COMMANDS[given.command].arguments for name in each.names if name.startswith("-")}
        extra = next((word for word in rest if word.startswith("-")), None)
        if extra is None:
            parser.error(f"{given.command} takes no further {rest[0]!r}; see `qddot {given.command} --help`")
        option = extra.partition("=")[0]
        hint = nearest(option, own) or f"; see `qddot {given.command} --help`"
        parser.error(f"{given.command} has no option {option!r}{hint}")
    return vars(given)


def _start_quickly() -> None:
    """Spare a command what it does not need: looking for garbage, a BLAS's threads, and a search for plugins."""
    gc.set_threshold(200_000)
    atexit.register(gc.freeze)
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")


def _said(error: ValueError | OSError) -> str:
    """What an error says; of the operating system's the file, and what is the matter with it."""
    if isinstance(error, OSError) and error.filename and error.strerror:
        return f"{error.filename}: {error.strerror[0].lower()}{error.strerror[1:]}"
    return str(error)


def _terminated(number: int, frame: object) -> NoReturn:
    """End on SIGTERM as on Ctrl-C: what is half written is removed on the way out."""
    print("terminated", file=sys.stderr)
    raise SystemExit(128 + number)


def main() -> None:
    """Run the command line; what a person gave wrongly ends in one message, never in a traceback."""
    _start_quickly()
    given = _arguments(sys.argv[1:] or ["--help"])
    signal.signal(signal.SIGTERM, _terminated)
    try:
        status = _COMMANDS[given.pop("command")].function(**given)
        sys.stdout.flush()
    except BrokenPipeError:  # who read the output has gone, as `head` does
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        status = 1
    except (ValueError, OSError) as error:
        print(f"error: {_said(error)}", file=sys.stderr)
        status = 2
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        status = 130
    raise SystemExit(status)


if __name__ == "__main__":
    main()
