"""`qddot plot RUN.nc --scene T`: the model of a saved run at a moment, or on a page to be played."""

from pathlib import Path

import numpy as np

from qddot.runner.load import LoadError, Model, load
from qddot.runner.report.saved_run import SavedRun, read_run
from qddot.runner.scene.filmed import Filmed, on_lines
from qddot.words import from_here

_PAGE = ".html"


def plot_scene(path: Path, t: float, as_page: bool, into: Path | None) -> int:
    """Draw the moment t, s, of a run, or write the page of its animation, which stands there first."""
    if as_page and into is not None and into.suffix != _PAGE:
        raise ValueError(f"--into {into}: with --html expected a name that ends in {_PAGE}")
    if into is None:
        into = path.with_name(f"{path.stem}_scene{_PAGE if as_page else '.png'}")
    run = read_run(path)
    film = _filmed(path, run)
    if not film.start <= t <= film.end:
        raise ValueError(f"--scene {t:g}: {path} goes from {film.start:g} to {film.end:g} s")
    if into.suffix == _PAGE:
        film.animation(run.title, begin=t).save(into)
    else:
        from qddot.runner.pictures.figures import save  # noqa: PLC0415 - matplotlib is slow to import

        save(film.still(t, f"{run.title or path.stem}, t = {t:g} s"), into)
    print(f"wrote {from_here(into)}")
    return 0


def _filmed(path: Path, run: SavedRun) -> Filmed:
    """The run with its model, which must be one that comes with qddot: a file names no code."""
    model = _model(path, run)
    known = {parameter.name for parameter in model.tables.parameters}
    values = {name: run.parameters[name] for name in run.parameters if name in known}
    columns = [channel.name for channel in model.tables.inputs]
    lost = [name for name in (*model.state_names, *columns) if name not in run]
    if lost or values.keys() != known:
        missing = ", ".join([*lost, *sorted(known - values.keys())])
        raise ValueError(f"{path} has no {missing}: it was saved from another model {model.name}; run its study again")
    c = model.constants(model.parameter_values(values))
    states, channels = (
        np.array([run[name] for name in names]).reshape(len(names), -1).T for names in (model.state_names, columns)
    )
    span = float(run.t.min()), float(run.t.max())
    return Filmed(model, c, *span, on_lines(run.t, states), on_lines(run.t, channels))


def _model(path: Path, run: SavedRun) -> Model:
    try:
        return load(run.model)
    except LoadError as error:
        raise ValueError(
            f"{path} is a run of the model {run.model or '(unknown)'}, which does not come with qddot; `qddot report "
            "STUDY`, or solution.animate() in Python, shows its scene"
        ) from error
