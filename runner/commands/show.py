"""`qddot show`: a model, its static equilibrium and modes; or what drives a study."""

from pathlib import Path

from rich.console import Console

from qddot.runner.commands.show_study import show_study
from qddot.runner.equilibrium import EquilibriumError, equilibrium, still
from qddot.runner.load import Model, load
from qddot.runner.modes import ModesError, modes
from qddot.runner.report.tables import modal_table, model_tables
from qddot.runner.study.library import STUDIES
from qddot.runner.study.read import what_it_holds


def show(name: str, parameters: str | None, into: Path) -> int:
    """Show a study's inputs; or a model's tables and, with one or each of its parameter sets, equilibrium and modes."""
    if Path(name).suffix == ".toml":
        return show_study(Path(name), into)
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
