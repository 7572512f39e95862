"""Tables for the terminal."""

from collections.abc import Iterator, Mapping
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from rich.table import Table

from qddot.runner.load import Model
from qddot.runner.methods import METHODS
from qddot.runner.metrics.table import METRICS
from qddot.runner.modes import Mode, described, taking_part
from qddot.runner.pictures.arrange import REACTION, undetermined
from qddot.runner.report.plain_table import PlainTable
from qddot.runner.solution import ROUNDING, Solution
from qddot.words import counted


def plain_table(title: str, *columns: str, numbers: int = 0) -> Table:
    """A table whose last `numbers` columns are aligned to the right."""
    table = PlainTable(title=title, title_justify="left", box=None, header_style="bold", pad_edge=False)
    for index, column in enumerate(columns):
        justify: Literal["left", "right"] = "right" if index >= len(columns) - numbers else "left"
        table.add_column(column, justify=justify, overflow="fold", no_wrap=index == 0 or justify == "right")
    return table


def headlines(solution: Solution) -> dict[str, tuple[str, ...]]:
    """Coordinates, outputs and inputs by kind, without the inputs that are 0 throughout."""
    shown = {kind: [name for name in names if name in solution] for kind, names in solution.headlines.items()}
    return {
        kind: tuple(name for name in names if kind != "inputs" or solution[name].any()) for kind, names in shown.items()
    }


def summary(solution: Solution) -> Table:
    """Extremes of every coordinate, output and moving input, and when they occur; without values that are no number."""
    table = plain_table("", "quantity", "unit", "start", "least", "at s", "greatest", "at s", numbers=5)
    for row in summary_rows(solution):
        table.add_row(*row)
    return table


def summary_rows(solution: Solution) -> Iterator[tuple[str, ...]]:
    """Name, unit, value at the start, least value and when, greatest and when, of each that a summary shows."""
    for name in (name for names in headlines(solution).values() for name in names):
        found = solution.extremes(name)
        start, largest = solution[name][0], max(abs(found.least), abs(found.greatest))
        start = 0.0 if abs(start) < ROUNDING * largest else start
        numbers = (start, found.least, found.least_at, found.greatest, found.greatest_at)
        texts = [f"{number + 0.0:.4g}" for number in numbers]  # + 0.0: no "-0"
        if name in solution.undetermined:
            texts = ["undetermined" if np.isnan(start) else texts[0], *(t.replace("nan", "") for t in texts[1:])]
        yield name, solution.quantity(name).unit, *texts


def not_finite(solution: Solution) -> list[str]:
    """A line for each quantity that is no finite number somewhere: how often, and where first.

    Of multipliers that redundant constraints leave undetermined one line for all that are so at the same points.
    """
    found = undetermined(solution, solution.headlines)
    lines = _undetermined(solution, found)
    for name in solution.names:
        bad = np.flatnonzero(~np.isfinite(solution[name]) & ~found.get(name, np.False_))
        if bad.size:
            value, t = solution[name][bad[0]], solution.t[bad[0]]
            lines.append(
                f"{name} is no finite number at {bad.size} of {len(solution.t)} points, first {value} at {t:g} s"
            )
    return lines


def _undetermined(solution: Solution, found: Mapping[str, NDArray[np.bool_]]) -> list[str]:
    alike: dict[bytes, list[str]] = {}
    for name, there in found.items():
        alike.setdefault(there.tobytes(), []).append(name)
    reactions = [name for name in solution.names if name.startswith(REACTION)]
    whole = ", ".join([*reactions[:3], *(["..."] if len(reactions) > 3 else [])])
    lines = []
    for names in alike.values():
        points = np.flatnonzero(found[names[0]])
        lines.append(
            f"{', '.join(names)} {'are' if len(names) > 1 else 'is'} undetermined at {points.size} of "
            f"{counted(len(solution.t), 'point')}, first at {solution.t[points[0]]:g} s: constraints are redundant "
            f"there; what they do together is known ({whole}), what each carries is not: leave out those that follow "
            "from others, or model what gives way"
        )
    return lines


def happened(solution: Solution) -> list[str]:
    """A line for each event that was watched for: how often it happened, first and last."""
    lines = []
    for name in solution.event_names:
        times = solution.events.times(name)
        when = [f"at {times[0]:.6g} s"] if times.size == 1 else []
        when = [f"first at {times[0]:.6g} s", f"last at {times[-1]:.6g} s"] if times.size > 1 else when
        lines.append(", ".join([f"event {name}: {counted(times.size, 'time')}", *when]))
    return lines


def statistics(solution: Solution, compiled_for: float = 0.0) -> str:
    """One line: method, points, steps, evaluations, time; and the seconds that were spent compiling before."""
    counts = solution.statistics
    parts = [f"{solution.metadata.get('method', '')}: {counted(counts.steps, 'step')}"]
    parts += [counted(counts.failed_attempts, "attempt failed")] if counts.failed_attempts else []
    parts += [
        counted(counts.evaluations, "evaluation"),
        counted(len(solution.t), "point"),
        f"{counts.wall_time * 1e3:.1f} ms",
    ]
    return ", ".join(parts) + (f"; compiled once in {compiled_for:.1f} s" if compiled_for else "")


def method_table() -> Table:
    """Every integration method."""
    table = plain_table("", "method", "order", "stages", "step", "stiff", "source")
    for method in METHODS.values():
        step, stiff = "variable" if method.adaptive else "fixed", "yes" if method.stiff else "no"
        if method.family == "exact":
            step, stiff = "any", "yes"
        table.add_row(method.name, str(method.order or "-"), str(method.stages or "-"), step, stiff, method.citation)
    return table


def metric_table() -> Table:
    """Every metric of a batch."""
    table = plain_table("", "metric", "takes", "meaning")
    for name, kind in METRICS.items():
        table.add_row(name, ", ".join(kind.takes), kind.meaning)
    return table


def model_tables(model: Model) -> list[Table]:
    """Coordinates and velocities, inputs, outputs and parameters of a model."""
    states = plain_table("State", "name", "unit", "meaning")
    for quantity in model.tables.states:
        states.add_row(quantity.name, quantity.unit, quantity.meaning)
    inputs = plain_table("Inputs", "name", "unit", "meaning")
    for channel in model.tables.courses:
        inputs.add_row(channel.name, channel.unit, channel.meaning)
    outputs = plain_table("Outputs", "name", "unit", "meaning")
    for quantity in model.tables.outputs:
        outputs.add_row(quantity.name, quantity.unit, quantity.meaning)
    sets = model.tables.parameter_sets
    parameters = plain_table("Parameters", "name", "unit", "meaning", "default", *sets, numbers=1 + len(sets))
    for each in model.tables.parameters:
        changed = (f"{values[each.name]:g}" if each.name in values else "" for values in sets.values())
        parameters.add_row(each.name, each.unit, each.meaning, f"{each.default:g}", *changed)
    return [table for table in (states, inputs, outputs, parameters) if table.row_count]


def modal_table(title: str, modes: tuple[Mode, ...]) -> Table:
    """Frequencies, damping and the coordinates that take part most."""
    table = plain_table(title, "damped period s", "frequency Hz", "damping ratio", "coordinates that take part")
    for mode in modes:
        table.add_row(*described(mode), taking_part(mode))
    return table
