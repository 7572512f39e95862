"""The front door of qddot: the command line, and the names that Python programs use.

    import qddot
    model = qddot.load("m113")
    solution = qddot.simulate(model, (0, 10), method="rk4", step=1e-4, parameters="as_run_unloaded",
                              inputs={"F": qddot.pulse_train(times=[1.0], duration=0.1, impulse=605.0)})
    solution["q_6"], solution.t, solution.statistics

Everything is imported when it is first used, so that `qddot --help` costs nothing.
"""

import atexit
import gc
import os
from contextlib import nullcontext
from importlib import import_module
from pathlib import Path
from typing import Annotated, Any

import typer

_PUBLIC = {
    "EquilibriumError": "runner.equilibrium",
    "Event": "runner.events.kinds",
    "IntegrationError": "runner.simulate",
    "LoadError": "runner.load",
    "ModelError": "model.system",
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
        raise AttributeError(f"module 'qddot' has no attribute {name!r}")
    return getattr(import_module(_PUBLIC[name]), name)


app = typer.Typer(
    name="qddot",
    help="Lagrange's equations from T, Π and Φ to compiled simulations.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)

Models = Annotated[list[str] | None, typer.Argument(help="Names of models, or files that define one; all by default.")]


@app.command("generate")
def _generate(
    names: Models = None,
    into: Annotated[Path | None, typer.Option(help="Folder to write to; generated/ for the shipped models.")] = None,
    check: Annotated[bool, typer.Option("--check", help="Write nothing; print what differs, and exit with 1.")] = False,
) -> None:
    """Derive models and write their kernels and equations."""
    from codegen.command import generate

    raise typer.Exit(generate(tuple(names or ()), into, check))


@app.command("equations")
def _equations(
    names: Models = None,
    into: Annotated[Path, typer.Option(help="Folder for the HTML pages and PDFs.")] = Path("results/equations"),
    quiet: Annotated[bool, typer.Option("--quiet", help="Print no equations, only what was written.")] = False,
) -> None:
    """Show the derived equations, and write them as HTML and, where LaTeX is installed, as PDF."""
    from codegen.equations.command import equations

    raise typer.Exit(equations(tuple(names or ()), into, quiet))


@app.command("compare")
def _compare(
    equations: Annotated[Path, typer.Argument(help="Hand-written equations: a text file, see studies/paper/.")],
    model: Annotated[str | None, typer.Option(help="The model, where the file names none.")] = None,
    latex: Annotated[bool, typer.Option("--latex", help="Print a LaTeX document.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> None:
    """Compare hand-written equations of motion with those derived, term by term; exits with 1 where they differ."""
    from codegen.compare.command import run

    raise typer.Exit(run(equations, model, "json" if as_json else "latex" if latex else "text"))


StudyFile = Annotated[Path, typer.Argument(help="A study: a TOML file, see studies/.")]
Store = Annotated[Path, typer.Argument(help="The Zarr store of a batch.")]
Settings = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="KEY=VALUE", help="Change the study: parameters.m_6=11t, inputs.F.times=[1,2.85]."),
]


@app.command("run")
def _run(
    study: StudyFile,
    into: Annotated[Path, typer.Option(help="Folder for the results.")] = Path("results"),
    figure: Annotated[bool, typer.Option(help="Draw the figure.")] = True,
    settings: Settings = None,
    row: Annotated[int | None, typer.Option(help="Run this run of the study's sweep, counted from 0.")] = None,
) -> None:
    """Run a study once: a NetCDF file, a figure and a summary."""
    from runner.report.background import Drawing

    with Drawing() if figure else nullcontext() as drawing:  # imports matplotlib while this process imports numba
        from runner.command import run_and_write

        status = run_and_write(study, into, drawing, settings or (), row)
    raise typer.Exit(status)


@app.command("identify")
def _identify(
    study: Annotated[Path, typer.Argument(help="An identification: a TOML file, see studies/paper/identify_*.toml.")],
    into: Annotated[Path, typer.Option(help="Folder for the parameter set and the figure.")] = Path(
        "results/identified"
    ),
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON and draw nothing.")] = False,
) -> None:
    """Fit unknowns of studies to observations, and say how sure each is."""
    from runner.identify.command import identify

    raise typer.Exit(identify(study, into, as_json))


@app.command("batch")
def _batch(
    study: StudyFile,
    out: Annotated[Path | None, typer.Option(help="The Zarr store; results/STUDY.zarr by default.")] = None,
    settings: Settings = None,
    workers: Annotated[int | None, typer.Option(help="Compute in so many Dask worker processes.")] = None,
    scheduler: Annotated[str | None, typer.Option(help="Compute on a Dask scheduler's workers, tcp://...")] = None,
    fresh: Annotated[
        bool, typer.Option("--fresh", help="Remove a store that is there, and compute all again.")
    ] = False,
    figure: Annotated[bool, typer.Option(help="Draw the figure.")] = True,
) -> None:
    """Run all runs of a study's sweep, or go on with a batch that was stopped."""
    from runner.batch.command import batch

    raise typer.Exit(batch(study, out, settings or (), workers, scheduler, fresh, figure))


@app.command("summary")
def _summary(store: Store) -> None:
    """Sum a batch up: best, worst, quantiles, failures."""
    from runner.batch.command import summary

    raise typer.Exit(summary(store))


@app.command("plot")
def _plot(
    store: Store,
    metric: Annotated[list[str] | None, typer.Option(help="A metric to draw; all by default. Repeat for more.")] = None,
    over: Annotated[list[str] | None, typer.Option(help="An axis of the sweep; twice for a map.")] = None,
    runs: Annotated[str | None, typer.Option(help="Trajectories of these runs: 0,5,17, or best, or worst.")] = None,
    into: Annotated[Path | None, typer.Option(help="The picture: PNG, SVG or PDF.")] = None,
) -> None:
    """Draw a batch: metrics over one axis, a map over two, trajectories of chosen runs."""
    from runner.batch.command import plot

    raise typer.Exit(plot(store, metric or (), over or (), runs, into))


@app.command("export")
def _export(store: Store, to: Annotated[Path, typer.Option(help="FILE.csv or FILE.parquet.")]) -> None:
    """Export a batch as a table, one line a run."""
    from runner.batch.command import write_export

    raise typer.Exit(write_export(store, to))


@app.command("schema")
def _schema(
    into: Annotated[Path | None, typer.Option(help="Write it to this file; printed by default.")] = None,
) -> None:
    """Give the JSON Schema of studies, for editors."""
    from runner.study.json_schema import write_schema

    raise typer.Exit(write_schema(into))


@app.command("list")
def _list(
    what: Annotated[str, typer.Argument(help="models, studies, library, methods or metrics; all by default.")] = "all",
) -> None:
    """List models, studies, the library's guns and roads, integration methods and metrics."""
    from runner.command import catalogue

    raise typer.Exit(catalogue(what))


@app.command("show")
def _show(
    name: Annotated[str, typer.Argument(help="A model's name, a generated module, or a study (.toml).")],
    parameters: Annotated[str | None, typer.Option(help="Parameter set for the modes; all sets by default.")] = None,
    into: Annotated[Path, typer.Option(help="Folder for the figure of a study's inputs.")] = Path("results"),
) -> None:
    """Show a model: its tables, static equilibrium and modes; or a study: what drives it, as a table and a figure."""
    from runner.command import show

    raise typer.Exit(show(name, parameters, into))


@app.command("verify")
def _verify(
    into: Annotated[Path, typer.Option(help="Folder for the figures.")] = Path("results/verification"),
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON and draw nothing.")] = False,
) -> None:
    """Verify section 3.1 of the M113 paper: six schemes against the analytic solution."""
    from runner.paper.command import verification

    raise typer.Exit(verification(into, as_json))


@app.command("paper")
def _paper(
    claims: Annotated[
        Path | None, typer.Option(help="Settings and claims; studies/paper/paper.toml by default.")
    ] = None,
    into: Annotated[Path, typer.Option(help="Folder for the figures and the claims.")] = Path("results/paper"),
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON and draw nothing.")] = False,
) -> None:
    """Compute the M113 paper again and judge its claims; exits with 1 where one is no longer met."""
    from runner.command import STUDIES
    from runner.paper.command import paper

    raise typer.Exit(paper(claims or STUDIES / "paper" / "paper.toml", into, as_json))


@app.command("report")
def _report(
    claims: Annotated[Path, typer.Option(help="What `qddot paper` wrote.")] = Path("results/paper/claims.json"),
    into: Annotated[Path, typer.Option(help="The page to write.")] = Path("results/paper/report.html"),
    pdf: Annotated[bool, typer.Option(help="Print it as PDF, too, where a browser is installed.")] = True,
) -> None:
    """Write the report of the M113 paper: one HTML page with equations, claims, plots and an animation; and as PDF."""
    from codegen.equations.command import equations_page
    from runner.paper.command import write_report

    write_report(claims, equations_page("m113"), into, pdf)


def _start_quickly() -> None:
    """Spare a command looking for garbage among its imports and at its end, and starting threads of a BLAS."""
    gc.set_threshold(200_000)
    atexit.register(gc.freeze)
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")


def main() -> None:
    """Run the command line; what a person gave wrongly ends in one message, never in a traceback."""
    _start_quickly()
    try:
        app()
    except (ValueError, OSError) as error:
        typer.secho(f"error: {error}", fg="red", err=True)
        raise SystemExit(2) from None
    except KeyboardInterrupt:
        typer.secho("interrupted", fg="red", err=True)
        raise SystemExit(130) from None


if __name__ == "__main__":
    main()
