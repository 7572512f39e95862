"""The section of a report in which the model moves, under the page's common time, and its modes."""

from html import escape

from qddot.runner.inputs.bind import bind
from qddot.runner.modes import Modes
from qddot.runner.report.page import Section
from qddot.runner.scene.animation import script, style
from qddot.runner.scene.filmed import Course, filmed, on_lines
from qddot.runner.scene.frames import SceneError
from qddot.runner.solution import Solution
from qddot.runner.study.ready import Study
from qddot.runner.switching import sides


def scene_section(study: Study, solution: Solution, title: str, before: str = "", after: str = "") -> Section | None:
    """A run as the model's scene, with HTML before and after it; None where the model has none, or nothing moves."""
    model, start, end = study.model, float(solution.t.min()), float(solution.t.max())
    if not model.tables.scene or not start < end:
        return None
    c = model.constants(model.parameter_values(study.arguments["parameters"]))
    table = bind(model.tables, study.inputs, sides(model, c, start, end))
    try:
        figure = filmed(model, c, table, (start, end), _states(solution)).animation(linked=True).figure
    except SceneError as error:
        figure = f'<p class="note">{escape(str(error))}</p>\n'
    return Section(title, before + figure + after, style(), script())


def _states(solution: Solution) -> Course:
    """The states at times, by the run's dense output, or on lines between its saved points."""
    if solution.between is not None and len(solution.t) > 1:
        return lambda times: solution.at(times).values[:, : solution.n_states]
    return on_lines(solution.t, solution.states)


def modes_in_motion(found: Modes) -> str:
    """The modes of a model that has a scene, to choose from, as HTML; "" where they cannot be drawn.

    The style and script are those of `scene_section`.
    """
    try:
        return found.animate().figure if found else ""
    except SceneError:
        return ""
