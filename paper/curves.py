"""What figures and the page of the paper draw of its sections: fronts and distributions, once for both."""

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from qddot.drawing import COLOURS
from qddot.paper.cost import Cost
from qddot.paper.driving import QUANTILES, Driving
from qddot.paper.firing import Firing
from qddot.paper.phase import Phase
from qddot.paper.reproduce import Reproduction
from qddot.report import legible, numbers

Vector = NDArray[np.float64]
#: The largest error that is drawn, %.
LARGEST = 1e3
#: Units that are looked at a thousand times as small.
SCALED = {"m": (1e3, "mm"), "rad": (1e3, "mrad")}


def front(errors: Vector, seconds: Vector) -> NDArray[np.int64]:
    """The settings than which none is both quicker and closer, from the quickest to the closest."""
    order = np.lexsort((errors, seconds))
    best = np.minimum.accumulate(errors[order])
    return order[np.flatnonzero(np.diff(best, prepend=np.inf) < 0)]


def fronts(cost: Cost) -> dict[str, tuple[Vector, Vector]]:
    """Of each method, and of all of them together under "", milliseconds and errors in % on the front.

    A method that takes the exact propagation itself, as `auto` does here, has no error beside it, and no front.
    """
    found = {}
    together = [np.concatenate([pair[k] for pair in cost.curves.values()]) for k in (0, 1)]
    for name, (errors, seconds) in [*cost.curves.items(), ("", together)]:
        apart = errors > 0
        chosen = front(errors[apart], seconds[apart])
        if chosen.size:
            found[name] = (1e3 * seconds[apart][chosen], 100 * errors[apart][chosen])
    return found


def exact_point(cost: Cost) -> tuple[float, float]:
    """Milliseconds of the exact propagation, to which errors refer, and the least error, %, of any other run.

    No two ways of computing agree more closely than that.
    """
    exact = next(row for row in cost.cheapest if row.method == "exact")
    errors = np.concatenate([*(errors for errors, _ in cost.curves.values()), [row.error for row in cost.paper]])
    return 1e3 * exact.seconds, 100 * float(errors[errors > 0].min())


def distribution(values: Vector) -> tuple[Vector, Vector]:
    """The empirical distribution function: values in order, and the share of them up to each."""
    return np.sort(values), np.arange(1, len(values) + 1) / len(values)


def plots_of(found: Reproduction) -> dict[str, list[dict[str, Any]]]:
    """The plots of the page, by section, each with its `title`."""
    return {
        "firing": list(_firing(found.firing, found.paper.firing.paper_interval)),
        "phase": list(_phase(found.phase)),
        "speed": list(_speed(found.driving)),
        "cost": [_cost(found.cost)],
    }


def _trace(name: str, x: Vector, y: Vector, colour: int, **more: Any) -> dict[str, Any]:
    return {"name": name, "x": numbers(x), "y": numbers(y), "colour": COLOURS[colour % len(COLOURS)], **more}


def _cost(cost: Cost) -> dict[str, Any]:
    traces = []
    for k, (name, (milliseconds, errors)) in enumerate(fronts(cost).items()):
        shown = errors <= LARGEST
        dash = {"dash": "dash"} if k >= len(COLOURS) else {}
        traces += [_trace(name, milliseconds[shown], errors[shown], k, points=True, **dash)] if name else []
    for row in cost.paper:
        one = np.array([1e3 * row.seconds]), np.array([100 * row.error])
        traces.append(_trace(f"{row.name}, the paper's {row.setting}", *one, 6, points="alone"))
    milliseconds, agreed = (np.array([value]) for value in exact_point(cost))
    traces.append(_trace("exact, to which the errors refer", milliseconds, agreed, 0, points="alone"))
    title = "One shot, 10 s: the least time of each method for an error, or a smaller one"
    marks = [{"y": 100 * cost.limit, "text": f"{100 * cost.limit:g} %"}]
    named = {"title": title, "name": "cost", "x": "computing time, ms", "y": "largest error, %", "unit": "%"}
    return {**named, "log": "xy", "traces": traces, "marks": marks}


def _firing(firing: Firing, interval: float) -> Iterator[dict[str, Any]]:
    for quantity, given in firing.units.items():
        factor, unit = SCALED.get(given, (1.0, legible(given)))
        called = quantity.replace("_", " ")
        traces = [
            _trace(f"{each.shots} shots", each.intervals, factor * each.swings[quantity], k)
            for k, each in enumerate(firing.series)
        ]
        title = f"{called.capitalize()}: largest change after the last shot, by the interval between shots"
        named = {
            "title": title,
            "name": f"firing_{quantity}",
            "x": "interval, s",
            "y": f"{called}, {unit}",
            "unit": unit,
        }
        yield {**named, "traces": traces, "marks": [{"x": interval, "text": f"the paper's {interval:g} s"}]}


def _phase(phase: Phase) -> Iterator[dict[str, Any]]:
    ride = _trace("without shots", phase.t, 1e3 * phase.ride, 0)
    shown = {"title": "The ride without shots", "name": "ride_without_shots", "x": "t, s", "unit": "mm"}
    yield {**shown, "y": f"{phase.quantity}, mm", "traces": [ride]}
    change = 100 * (phase.swings / phase.unfired - 1)
    bound = float(np.abs(change).max())
    title = "What two shots change of the largest displacement after the second, by the first and the interval"
    over = {"title": title, "name": "phase", "x": "time of the first shot, s", "y": "interval, s", "traces": []}
    cells = {"x": numbers(phase.first), "y": numbers(phase.intervals), "z": [numbers(row, 4) for row in change.T]}
    yield {**over, "map": {**cells, "low": -bound, "high": bound, "diverging": True, "label": "change", "unit": "%"}}


def _speed(driving: Driving) -> Iterator[dict[str, Any]]:
    traces = [
        _trace(f"{each.speed:g} km/h", *distribution(each.ratios[0]), k, steps=True)
        for k, each in enumerate(driving.speeds)
    ]
    title = "Hull's amplitude over the road's, without shots: share of the roads up to a ratio"
    named = {"title": title, "name": "ratios", "x": "hull over road", "y": "share of the roads", "traces": traces}
    yield {**named, "marks": [{"x": 1.0, "text": "as much as the road"}]}
    trace = _trace(f"{len(driving.permissible)} roads", *distribution(driving.permissible), 0, steps=True)
    marks = [
        {"x": float(np.quantile(driving.permissible, level)), "text": f"{100 * level:g} %"}
        for level in QUANTILES.values()
    ]
    title = "The speed above which the hull outgrows the road: share of the roads up to a speed"
    named = {
        "title": title,
        "name": "permissible_speed",
        "x": "speed, km/h",
        "y": "share of the roads",
        "traces": [trace],
    }
    yield {**named, "marks": [*marks, {"x": 20.0, "text": "the paper's 20 km/h"}]}
