"""`qddot list`: what there is by name."""

from rich.console import Console

from qddot.runner.checks import unknown
from qddot.runner.load import available, load_as_it_stands
from qddot.runner.report.tables import method_table, metric_table
from qddot.runner.study.library import SHIPPED, STUDIES, entries

CATALOGUES = ("models", "studies", "library", "methods", "metrics")


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
