"""The report of any study: what was given, the run, its modes and its energy, as sections of one page."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from html import escape
from pathlib import Path
from typing import Any

from qddot.runner.equilibrium import EquilibriumError, equilibrium
from qddot.runner.modes import ModesError, described, modes, taking_part
from qddot.runner.options import TABLE
from qddot.runner.pictures.arrange import run_picture
from qddot.runner.pictures.picture import Picture
from qddot.runner.pictures.scales import legible
from qddot.runner.report import energy
from qddot.runner.report.input_curves import over_time
from qddot.runner.report.interactive import section
from qddot.runner.report.page import Section, table, write_page
from qddot.runner.report.scene_section import modes_in_motion, scene_section
from qddot.runner.report.tables import not_finite, statistics, summary_rows
from qddot.runner.solution import Solution
from qddot.runner.study.ready import Study

#: Parameters beyond which a table is folded away.
_MANY = 40
#: A balance of energy that holds, relative to the largest part of it.
_HOLDS = 1e-3


@dataclass
class Page:
    """Sections and plots of a page, in their order."""

    sections: list[Section] = field(default_factory=list)
    plots: list[dict[str, Any]] = field(default_factory=list)

    def show(self, title: str, picture: Picture, before: str = "", after: str = "") -> None:
        """Add a section with the picture's plots."""
        part, plots = section(title, picture, len(self.plots), before)
        self.sections.append(Section(title, part.content + after))
        self.plots += plots


def study_page(study: Study, solution: Solution, equations: str, row: int | None) -> Page:
    """The sections of a study's run, those that do not apply left out; equations: HTML, none where there are none."""
    page = Page()
    page.sections.append(Section("The run", _about(study, solution, row)))
    if (moving := scene_section(study, solution, "In motion")) is not None:
        page.sections.append(moving)
    if study.model.tables.parameters:
        page.sections.append(Section("Parameters", _parameters(study)))
    if study.inputs and len(solution.t) > 1:
        channels = {channel.name: channel for channel in study.model.tables.inputs}
        page.show("Inputs", over_time(study.inputs, channels, (float(solution.t.min()), float(solution.t.max()))))
    figure = study.tables.figure
    shown = run_picture(solution.closely, _without_inputs(study, solution), "", figure.panels, figure.from_start)
    page.show("Results", shown, after=_extremes(solution))
    _add_modes(page, study)
    _add_energy(page, study, solution)
    if equations:
        page.sections.append(Section("Equations", equations))
    return page


def _paragraphs(*texts: str, kind: str = "") -> str:
    return "".join(f'<p class="{kind}">{escape(text)}</p>\n' for text in texts if text)


def introduction(text: str) -> str:
    """What a study says of itself: the comment at its top, as one paragraph."""
    lines = []
    for line in text.splitlines():
        if not line.startswith("#"):
            break
        lines.append(line.lstrip("# ").rstrip())
    return " ".join(lines)


def _about(study: Study, solution: Solution, row: int | None) -> str:
    model, span = study.model, study.span
    kind = "linear" if model.tables.linear else "nonlinear"
    n = model.tables.coordinates
    rows = [
        ("model", f"{model.tables.title} ({model.name}; {kind}, {n} coordinate{'s' if n > 1 else ''})"),
        ("study", f"{study.path}" + ("" if row is None else f", run {row} of its sweep")),
        ("time", f"{span[0]:g} s to {span[1]:g} s"),
        ("method", statistics(solution)),
    ]
    options = [f"{name} = {value}" for name, value in solution.metadata.items() if name in TABLE]
    rows += [("options", ", ".join(options))] if options else []
    failed = "" if solution.success else solution.message
    return (
        _paragraphs(introduction(study.text))
        + _paragraphs(failed, kind="differs")
        + table(("", ""), rows)
        + _paragraphs(*not_finite(solution), kind="note")
    )


def _parameters(study: Study) -> str:
    parameters = study.model.tables.parameters
    values = study.model.parameter_values(study.arguments["parameters"])
    pairs = list(zip(parameters, values, strict=True))
    changed = any(value != each.default for each, value in pairs)
    rows = []
    for each, value in pairs:
        row = (each.name, each.meaning, f"{value:g}", _unit(each.unit))
        default = "" if value == each.default else f"{each.default:g}"
        rows.append((*row, default) if changed else row)
    heads = ("name", "meaning", "value", "unit", *(("default",) if changed else ()))
    made = table(heads, rows, (2, 4))
    return made if len(rows) <= _MANY else f"<details><summary>{len(rows)} parameters</summary>{made}</details>"


def _unit(unit: str) -> str:
    """A unit that is not broken across lines."""
    return legible(unit).replace(" ", "\u202f")


def _without_inputs(study: Study, solution: Solution) -> Mapping[str, Sequence[str]]:
    """What a person looks at first; the inputs stand in a section of their own."""
    return {kind: names for kind, names in solution.headlines.items() if kind != "inputs"}


def _extremes(solution: Solution) -> str:
    heads = ("quantity", "meaning", "unit", "start", "least", "at s", "greatest", "at s")
    rows = [
        (name, solution.quantity(name).meaning, _unit(unit), *numbers)
        for name, unit, *numbers in summary_rows(solution)
    ]
    return f"<h3>Extremes</h3>\n{table(heads, rows, (3, 4, 5, 6, 7))}"


def _add_modes(page: Page, study: Study) -> None:
    given = {"parameters": study.arguments["parameters"], "inputs": study.inputs, "t0": study.span[0]}
    try:
        state = equilibrium(study.model, **given, guess=study.arguments.get("guess"))
        found = modes(study.model, state=state, **given)
    except (EquilibriumError, ModesError):
        return
    names = study.model.coordinate_names
    at = ", ".join(f"{name} = {value:.4g}" for name, value in zip(names, state, strict=False))
    words = _paragraphs(f"About the static equilibrium with the inputs at {study.span[0]:g} s: {at}.")
    heads = ("damped period, s", "frequency, Hz", "damping ratio", "coordinates that take part")
    rows = [(*described(mode), taking_part(mode)) for mode in found]
    moving = modes_in_motion(found) if any(section.script for section in page.sections) else ""
    page.sections.append(Section("Modes", words + table(heads, rows, (0, 1, 2)) + moving))


def _add_energy(page: Page, study: Study, solution: Solution) -> None:
    found = energy.balance(solution, study.model, study.arguments["parameters"], study.inputs)
    if found is None or not found.size:
        return
    holds = found.error <= _HOLDS * found.size
    words = (
        f"Kinetic and potential energy change by what inputs put in less what is dissipated, to {found.error:.2g} J of "
        f"{found.size:.3g} J."
        if holds
        else f"The balance is open by {found.error:.3g} J of {found.size:.3g} J: the run is not exact enough, or "
        "something works that is neither an input nor a damper (a constraint that moves, an event)."
    )
    page.show("Energy", energy.picture(found), _paragraphs(words))


def write(study: Study, solution: Solution, equations: str, row: int | None, into: Path) -> Path:
    """Write the page. Raises OSError where it cannot be."""
    page = study_page(study, solution, equations, row)
    title = (study.tables.title or study.path.stem) + ("" if row is None else f" (run {row})")
    if not solution.success:
        title += f" (partial: up to t = {solution.t[-1]:.6g} s)"
    source = f"Computed by qddot from {study.path.name}; the data of every plot can be downloaded."
    return write_page(into, title, source, page.sections, page.plots)
