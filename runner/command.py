"""What the commands of the runner print and write; each gives the exit status."""

import contextlib
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from rich.console import Console
from rich.markup import escape

from qddot.runner.checks import unknown
from qddot.runner.equilibrium import EquilibriumError, equilibrium, still
from qddot.runner.files import named, ready
from qddot.runner.load import Model, available, load, load_as_it_stands
from qddot.runner.machine.compiling import compiled_for
from qddot.runner.modes import ModesError, modes
from qddot.runner.report.background import Drawing
from qddot.runner.report.curves import Curves, curves
from qddot.runner.report.progress import progress_bar
from qddot.runner.report.tables import (
    method_table,
    metric_table,
    modal_table,
    model_tables,
    not_finite,
    statistics,
    summary,
)
from qddot.runner.solution import Solution
from qddot.runner.study.library import SHIPPED, entries
from qddot.runner.study.overrides import parsed
from qddot.runner.study.read import StudyError, what_it_holds
from qddot.runner.study.ready import read_study
from qddot.runner.study.rows import row_of
from qddot.runner.study.schema import Study
from qddot.runner.study.show import show_inputs

STUDIES = Path(__file__).parent.parent / "studies"
CATALOGUES = ("models", "studies", "library", "methods", "metrics")


def run_and_write(path: Path, into: Path, drawing: Drawing | None, settings: Sequence[str], row: int | None) -> int:
    """Run a study; write and print what came of it. 1 where the run failed on its way: what there is is kept.

    settings: "key=value" in place of the file's; row: the run of the study's sweep. Both stand in the files' names.
    """
    ready_study = read_study(path, parsed(settings)) if row is None else row_of(path, parsed(settings), row)
    study = ready_study.tables
    which = [row] if row is not None else ["base"] if study.sweep.axes else []
    data = into / f"{named(path.stem, row=which, set=settings)}.nc"
    for each in (data, data.with_name(f"{data.stem}.png")):
        ready(each)  # before anything is computed that could not be written
    if which == ["base"]:
        _note("note:", "the study's own values, without its sweep: --row N runs one of its runs, `qddot batch` all")
    with progress_bar(path.stem) as bar:
        solution = ready_study.run(progress=bar, on_failure="return")
    origin = {"study": str(path.resolve()), "settings": " ".join(settings), "row": "" if row is None else str(row)}
    title = (study.title or path.stem) + ("" if row is None else f" (run {row})")
    return _write(study, replace(solution, metadata={**solution.metadata, **origin}), path, data, title, drawing)


def _write(study: Study, solution: Solution, path: Path, data: Path, title: str, drawing: Drawing | None) -> int:
    console = Console(emoji=False, markup=False)
    if not solution.success:
        _note("[red]error:[/red]", solution.message)
        title = f"{title} (partial: up to t = {solution.t[-1]:.6g} s)"
    if other := _other_study(data, path):
        _note("note:", f"{data} held a run of {other}")
    picture = data.with_name(f"{data.stem}.png")
    if drawing is not None:
        drawing.begin(_curves(study, solution, path, title), picture)
    solution.save(data)
    console.print(title, style="bold", highlight=False)
    console.print(statistics(solution, compiled_for()), highlight=False, soft_wrap=True)
    console.print(summary(solution))
    for line in not_finite(solution):
        console.print(f"note: {line}", highlight=False, soft_wrap=True)
    console.print(f"wrote {data}", highlight=False, soft_wrap=True)
    if drawing is not None:
        drawing.finish()
        console.print(f"wrote {picture}", highlight=False, soft_wrap=True)
    return 0 if solution.success else 1


def _note(kind: str, text: str) -> None:
    Console(stderr=True, emoji=False).print(f"{kind} {escape(text)}", highlight=False, soft_wrap=True)


def _other_study(data: Path, path: Path) -> str:
    """The other study whose run a file holds that will be replaced; nothing where it is this one, or not known."""
    from netCDF4 import Dataset  # noqa: PLC0415 - only a run that is saved needs it

    if not data.exists():
        return ""
    with contextlib.suppress(OSError, RuntimeError), Dataset(data) as file:
        study = str(getattr(file, "study", path.resolve()))
        return "" if study == str(path.resolve()) else study
    return ""


def _curves(study: Study, solution: Solution, path: Path, title: str) -> Curves:
    try:
        return curves(solution, title, study.figure.panels, study.figure.from_start)
    except ValueError as error:
        raise StudyError(f"{path}: {error}") from error


def catalogue(what: str) -> int:
    """List models, studies, the library's guns and roads, methods, metrics, or all of them."""
    if what not in ("all", *CATALOGUES):
        raise ValueError(unknown("list", what, CATALOGUES))
    console = Console()
    if what in ("all", "models"):
        console.print("[bold]Models[/bold]")
        for name in available():
            console.print(f"  {name:18}{load_as_it_stands(name).tables.title}", highlight=False)
    if what in ("all", "studies"):
        console.print("[bold]Studies[/bold]")
        for path in sorted(STUDIES.glob("*.toml")):
            console.print(f"  studies/{path.name}", highlight=False)
    if what in ("all", "library"):
        console.print("[bold]Library[/bold]")
        for name, entry in sorted(entries(SHIPPED).items()):
            console.print(f"  {name:18}{entry['title']}", highlight=False)
    if what in ("all", "methods"):
        console.print("[bold]Methods[/bold]", method_table())
    if what in ("all", "metrics"):
        console.print("[bold]Metrics[/bold]", metric_table())
    return 0


def show(name: str, parameters: str | None, into: Path) -> int:
    """Show a study's inputs; or a model's tables and, with one or each of its parameter sets, equilibrium and modes."""
    if Path(name).suffix == ".toml":
        return show_inputs(Path(name), into)
    if found := what_it_holds(Path(name)) if Path(name).suffix != ".py" else "":
        raise ValueError(f"{name} {found}; expected the name of a model, a generated module, or a study")
    if (STUDIES / f"{name}.toml").is_file():
        raise ValueError(f"{name} is no model but a study: qddot show studies/{name}.toml")
    console = Console()
    model = load(name)
    kind = "linear" if model.tables.linear else "nonlinear"
    console.print(f"[bold]{model.tables.title}[/bold] ({kind}, {model.tables.mass_matrix} mass matrix)\n")
    for table in model_tables(model):
        console.print(table, "")
    chosen_sets: list[str | None] = [parameters] if parameters else [*model.tables.parameter_sets]
    for chosen in chosen_sets or [None]:
        _show_modes(console, model, chosen)
    return 0


def _show_modes(console: Console, model: Model, chosen: str | None) -> None:
    title = f"with {chosen}" if chosen else "with default parameters"
    try:
        state = equilibrium(model, chosen)
        found = modes(model, chosen, state)
    except (EquilibriumError, ModesError) as error:
        console.print(f"No modes {title}: {error}\n", highlight=False, soft_wrap=True)
        return
    names, (free, _) = model.state_names, still(model)
    at_rest = ", ".join(f"{names[i]} = {state[i]:.4g}" for i in free)
    console.print(modal_table(f"Modes {title}", found))
    console.print(f"about the equilibrium {at_rest}\n", highlight=False)
