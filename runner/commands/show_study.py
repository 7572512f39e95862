"""`qddot show STUDY`: what a study drives its model by, before it is run: a table and a figure."""

from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from qddot.runner.inputs.iso8608 import SHORTEST, road_class
from qddot.runner.inputs.signal import START, Signal
from qddot.runner.pictures.panel import Line, panel_of
from qddot.runner.pictures.picture import Picture
from qddot.runner.pictures.points import points
from qddot.runner.report.input_curves import Spectrum, integral, over_distance, over_time, spectrum
from qddot.runner.report.tables import plain_table
from qddot.runner.study.amounts import Amounts
from qddot.runner.study.arguments import study_parameters
from qddot.runner.study.integration import integration_arguments, told
from qddot.runner.study.read import StudyError, read_tree
from qddot.runner.study.ready import ready
from qddot.runner.study.road import random_road_roughness, road_positions, road_profile, road_reach, road_speed
from qddot.runner.study.signals import study_signals


def show_study(path: Path, into: Path) -> int:
    """Print how the study integrates and its inputs; draw these: over time, the road over distance, its spectrum."""
    given, console = ready(path, *read_tree(path)), Console()
    study, model, amounts = given.tables, given.model, Amounts(path)
    try:
        p = model.parameter_values(study_parameters(study, model, amounts))
    except StudyError:
        raise
    except ValueError as error:
        raise StudyError(f"{path}: {error}") from error
    signals = study_signals(study, model, p, path)
    if not signals:
        raise StudyError(f"{path}: the study has no inputs to show")
    span = (amounts("span", study.span[0], "s"), amounts("span", study.span[1], "s"))
    if not span[0] < span[1]:
        raise amounts.wrong("span", f"({span[0]}, {span[1]}), expected a start before the end")
    channels = {channel.name: channel for channel in model.tables.inputs}
    integration_arguments(study.integration, amounts)  # refused here as by `qddot run`
    console.print(f"[bold]{study.title or path.stem}[/bold]")
    for line in told(study.integration):
        console.print(line, highlight=False, markup=False, soft_wrap=True)
    console.print(_table(signals, {name: channels[name].unit for name in signals}, span))
    pictures, found = [over_time(signals, channels, span)], None
    if study.road is not None:
        places = road_positions(study.road, model, p, amounts)
        road = road_profile(study.road, amounts)
        reach = road_reach(study.road, places, span, amounts)
        console.print(_described(study.road, reach, amounts), highlight=False, soft_wrap=True)
        pictures += _road_pictures(study.road, road, reach, span, amounts)
        found = _road_spectrum(study.road, road, amounts)
    from qddot.runner.report.input_figures import draw_inputs  # noqa: PLC0415 - matplotlib is slow to import

    picture = draw_inputs(study.title or path.stem, pictures, found, into / f"{path.stem}_inputs.png")
    console.print(f"wrote {picture}", highlight=False, soft_wrap=True)
    return 0


def _table(signals: dict[str, Signal], units: dict[str, str], span: tuple[float, float]) -> Table:
    table = plain_table("", "input", "unit", "least", "greatest", "at start", "integral", "breakpoints", numbers=5)
    for name, signal in signals.items():
        t, values = points(signal, signal.breakpoint_times(), span)
        breaks = signal.breakpoint_times()
        inside = int(((breaks >= span[0]) & (breaks <= span[1])).sum())
        numbers = (f"{number:.4g}" for number in (values.min(), values.max(), values[0], integral(signal, t)))
        table.add_row(name, units[name], *numbers, str(inside))
    return table


def _described(spec: Any, reach: tuple[float, float], amounts: Amounts) -> str:
    said = f"road: {spec.kind}, read from {reach[0]:.4g} m to {reach[1]:.4g} m"
    if spec.kind != "iso8608":
        return said
    value = random_road_roughness(spec, amounts)
    return f"{said}; Gd(n0) = {value:.4g} m^3, class {road_class(value)}"


def _road_pictures(
    spec: Any, road: Signal, reach: tuple[float, float], span: tuple[float, float], amounts: Amounts
) -> list[Picture]:
    """A speed that varies, and the road over distance."""
    speed, found = road_speed(spec, amounts), []
    if isinstance(speed, Signal):
        found.append(Picture("", (panel_of([Line(*points(speed, speed.breakpoints, span), "speed", "m/s")]),)))
    return [*found, over_distance(road, reach)] if reach[0] < reach[1] else found


def _road_spectrum(spec: Any, road: Signal, amounts: Amounts) -> Spectrum | None:
    """The spectrum of a random or a measured road."""
    if spec.kind == "iso8608":
        sizes = {"shortest": SHORTEST} | amounts.given("road", spec, {"fade": "m", "length": "m", "shortest": "m"})
        return spectrum(road, (sizes["fade"], sizes["length"]), 1 / sizes["shortest"])
    if spec.kind == "profile":
        return spectrum(road, (road.pieces[1, START], road.pieces[-1, START]), 1 / SHORTEST)
    return None
