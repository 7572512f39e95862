"""`qddot plot`."""

from collections.abc import Sequence
from pathlib import Path

from qddot.command import Command, argument, call, flag, path, several


def plot(
    paths: Sequence[Path],
    quantities: Sequence[str],
    as_page: bool,
    scene: float | None,
    metrics: Sequence[str],
    over: Sequence[str],
    runs: str | None,
    into: Path | None,
) -> int:
    """Draw runs, each a file, or a batch, a folder."""
    if all(each.suffix == ".nc" and not each.is_dir() for each in paths):
        for option, given in (("--metric", metrics), ("--over", over), ("--runs", runs)):
            if given:
                raise ValueError(f"{option}: {paths[0]} is a run, and {option} is of a batch; --quantity chooses here")
        if scene is not None:
            return _scene(paths, quantities, scene, as_page, into)
        return call(
            "qddot.runner.commands.plot_runs",
            "plot_runs",
            paths=paths,
            quantities=quantities,
            as_page=as_page,
            into=into,
        )
    if len(paths) > 1:
        raise ValueError("expected one batch, or one or several runs (.nc)")
    asked_of_runs = (("--quantity", bool(quantities)), ("--html", as_page), ("--scene", scene is not None))
    for option, asked in asked_of_runs:
        if asked:
            raise ValueError(f"{option}: {paths[0]} is a batch, and {option} is of runs (.nc)")
    return call("qddot.runner.commands.plot", "plot", store=paths[0], metrics=metrics, over=over, runs=runs, into=into)


def _scene(paths: Sequence[Path], quantities: Sequence[str], t: float, as_page: bool, into: Path | None) -> int:
    if len(paths) > 1 or quantities:
        found = "--quantity chooses curves" if quantities else f"{len(paths)} runs are given"
        raise ValueError(f"--scene: it shows one run as its model looks, and {found}")
    return call("qddot.runner.commands.plot_scene", "plot_scene", path=paths[0], t=t, as_page=as_page, into=into)


COMMAND = Command(
    plot,
    "Draw a run, or runs over each other; or a batch: metrics over one axis, a map over two, trajectories of runs.",
    (
        argument(
            "paths", metavar="PATH", nargs="+", type=Path, help="Runs (.nc), drawn over each other; or a batch's store."
        ),
        several("--quantity", "NAME", "Of runs: a quantity to draw, a panel each. Repeat for more.", dest="quantities"),
        flag("--html", "Of runs: a page to point at and zoom into, which needs no network.", dest="as_page"),
        argument(
            "--scene", metavar="T", type=float, help="Of a run: how its model looks at T seconds; --html: to be played."
        ),
        several("--metric", "METRIC", "Of a batch: a metric, all by default. Repeat for more.", dest="metrics"),
        several("--over", "AXIS", "Of a batch: an axis of the sweep; twice for a map."),
        argument("--runs", help="Of a batch: trajectories of these runs, 0,5,17, or best, or worst."),
        path("--into", "The picture: PNG, SVG or PDF; of runs HTML, too."),
    ),
)
