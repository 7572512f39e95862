"""`qddot plot`: the figure of a batch."""

from collections.abc import Sequence
from pathlib import Path

from qddot.runner.batch.results import Results
from qddot.runner.batch.store import StoreError
from qddot.runner.checks import unknown
from qddot.runner.files import named
from qddot.runner.report.batch_tables import status_of, wrote


def picture_of(store: Path, **chosen: Sequence[object]) -> Path:
    """Where the figure of a store is drawn, beside it: another file for another choice."""
    return store.with_name(f"{named(store.name.removesuffix('.zarr'), **chosen)}.png")


def plot(store: Path, metrics: Sequence[str], over: Sequence[str], runs: str | None, into: Path | None) -> int:
    """Draw a figure of a store. 1 where it is damaged."""
    from qddot.runner.report.batch_figures import draw  # noqa: PLC0415 - matplotlib is slow to import

    results = Results(store)
    if runs is None:
        path = draw(results, into or picture_of(store, metric=metrics, over=over), metrics, over)
    elif over:
        raise ValueError("--over: trajectories of --runs are drawn over time; leave one of the two out")
    else:
        chosen = runs_of(results, runs, metrics)
        name = picture_of(store, runs=[runs] if runs in ENDS else chosen, metric=metrics)
        path = draw(results, into or name, runs=chosen)
    wrote(results, path)
    return status_of(results)


#: Runs by what they are.
ENDS = ("best", "worst")


def runs_of(results: Results, text: str, metrics: Sequence[str]) -> list[int]:
    """Runs from "0,5,17", "best" or "worst" (of the metric that is given, or else of the first)."""
    if text in ENDS:
        if len(metrics) > 1:
            raise ValueError(f"--runs {text}: of which metric? there are {len(metrics)}; give one")
        metric = metrics[0] if metrics else results.metrics[0] if results.metrics else None
        if metric is not None and metric not in results.metrics:
            raise ValueError(f"--metric: {unknown('metric', metric, results.metrics)}")
        order = results.best_first(metric) if metric is not None else ()
        if not len(order):
            raise StoreError(f"--runs {text}: there is no metric of a finished run")
        return [int(order[0 if text == "best" else -1])]
    parts = [part.strip() for part in text.split(",")]
    if not all(part.isdecimal() and len(part) < 19 for part in parts):
        raise StoreError(f"--runs {text!r}: expected numbers of runs such as 0,5,17, or best, or worst")
    if metrics:
        raise ValueError("--metric: trajectories of numbered --runs show no metric; leave one of the two out")
    return sorted({int(part) for part in parts})
