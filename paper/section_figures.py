"""Figures of sections 3.2 and 4 of paper 2116."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from qddot.drawing import COLOURS, panels, save
from qddot.paper.cost import Cost
from qddot.paper.curves import LARGEST, SCALED, distribution, exact_point, fronts
from qddot.paper.driving import QUANTILES, Driving
from qddot.paper.firing import Firing
from qddot.paper.phase import Phase
from qddot.paper.reproduce import Reproduction
from qddot.report import legible

_SHOTS = ("no shot", "one shot", "two shots", "three shots")


def draw_all(found: Reproduction, into: Path) -> Iterator[Path]:
    """Every figure, its path as soon as it is written."""
    yield draw_shots(found, into / "figures_5_to_7.png")
    yield draw_cost(found.cost, into / "cost.png")
    yield draw_firing(found.firing, found.paper.firing.paper_interval, into / "firing.png")
    yield draw_phase(found.phase, into / "phase.png")
    yield draw_driving(found.driving, into / "figures_10_to_12.png")
    yield draw_permissible(found.driving, into / "permissible_speed.png")


def draw_shots(found: Reproduction, path: Path) -> Path:
    """Figs. 5 to 7: the assumed force, the hull after one, two and three shots, the barrel end after two."""
    study, interval = found.paper.firing.study, found.paper.firing.paper_interval
    first, short = found.paper.firing.first, 1.07
    title = "Shots as of ten 12.7 mm rounds (assumed): force, hull, barrel end; dotted: the paper's 19, 25, 11 mm"
    figure, axes = panels(3, title=title, below="t, s")
    vehicle = found.studies.study(study)
    runs = {name: [first + k * interval for k in range(n)] for n, name in enumerate(_SHOTS) if n}
    pairs = {"intervals 1.85 s": [first, first + interval], "intervals 1.07 s": [first, first + short]}
    for axis, quantity, salvos in ((axes[1], "heave", runs), (axes[2], "barrel_end", pairs)):
        for (name, times), colour in zip(salvos.items(), COLOURS, strict=False):
            fired = vehicle.changed({"inputs.F.times": times})
            run = fired.run(method="exact", step=0.01)
            axis.plot(run.t, 1e3 * (run[quantity] - run[quantity][0]), color=colour, linewidth=1.2, label=name)
            if name == "one shot":
                _force(axes[0], fired.run(method="exact", step=1e-3))
        axis.set_ylabel(f"{quantity.replace('_', ' ')}, mm")
        axis.legend(fontsize="small", frameon=False, loc="upper right", ncols=3)
    for value in (19, 25, 11):
        axes[2].axhline(value, color="0.6", linewidth=0.8, linestyle=":")
    for axis, above in zip(axes, (0.05, 0.25, 0.25), strict=True):
        axis.margins(x=0.0, y=above)
    return save(figure, path)


def _force(axis: Any, run: Any) -> None:
    axis.plot(run.t, 1e-3 * run["F"], color=COLOURS[0], linewidth=1.2)
    axis.set_ylabel("recoil force, kN")


def draw_cost(cost: Cost, path: Path) -> Path:
    """The least time that each method takes for an error, the front of all of them, and the paper's three settings."""
    title = "One shot, 10 s: least computing time for an error or a smaller one; dotted: 0.05 %"
    figure, axes = panels(1, 5.4, title=title, below="computing time, ms")
    found = fronts(cost)
    axes[0].loglog(
        *found.pop(""), "-", color="0.8", linewidth=7, solid_capstyle="round", label="front of all but exact"
    )
    for k, (method, (milliseconds, errors)) in enumerate(found.items()):
        style = {"linestyle": "-" if k < len(COLOURS) else "--", "color": COLOURS[k % len(COLOURS)]}
        axes[0].loglog(milliseconds, errors, marker=".", linewidth=1.0, label=method, **style)
    for row, marker in zip(cost.paper, "sD^", strict=False):
        label = f"{row.name}, the paper's {row.setting}"
        axes[0].loglog(1e3 * row.seconds, 100 * row.error, marker, color="k", label=label)
    exact, agreed = exact_point(cost)
    label = "exact: the errors are beside it; two methods agree no closer"
    axes[0].loglog(exact, agreed, "*", color=COLOURS[1], markeredgecolor="k", markersize=14, label=label)
    axes[0].axhline(100 * cost.limit, color="0.4", linewidth=0.9, linestyle=":")
    axes[0].set_ylabel("largest error at 1.648 and 2.356 s, %")
    axes[0].set_ylim(top=LARGEST)
    axes[0].legend(fontsize="x-small", frameon=False, ncols=2, loc="upper right")
    return save(figure, path)


def draw_firing(firing: Firing, interval: float, path: Path) -> Path:
    """What swings after the last of 2, 3, 8 shots at equal intervals, and the best and worst bursts."""
    quantities = list(firing.units)
    title = "Largest change after the last shot by the interval between shots; dotted: the paper's 1.85 s"
    figure, axes = panels(len(quantities), title=title, below="interval, s")
    for axis, quantity in zip(axes, quantities, strict=True):
        unit = SCALED.get(firing.units[quantity], (1.0, legible(firing.units[quantity])))
        for series, colour in zip(firing.series, COLOURS, strict=False):
            worst = series.worst(quantity)
            label = f"{series.shots} shots, worst {worst:.2f} s"
            axis.plot(series.intervals, unit[0] * series.swings[quantity], color=colour, linewidth=1.3, label=label)
        axis.axvline(interval, color="0.5", linewidth=0.9, linestyle=":")
        axis.set_ylabel(f"{quantity.replace('_', ' ')}, {unit[1]}")
        axis.margins(x=0.0, y=0.2)
        axis.legend(fontsize="small", frameon=False, ncols=3, loc="upper left")
    return save(figure, path)


def draw_phase(phase: Phase, path: Path) -> Path:
    """The swing after two shots over the time of the first and the interval, above the ride without shots."""
    title = "Two 30 mm shots on the plough at 20 km/h: largest displacement after them, beside no shots"
    figure, axes = panels(2, title=title, below="time of the first shot, s")
    axes[0].plot(phase.t, 1e3 * phase.ride, color=COLOURS[0], linewidth=1.2)
    axes[0].set_ylabel(f"{phase.quantity} without shots, mm")
    change = 100 * (phase.swings / phase.unfired - 1)
    bound = float(np.abs(change).max())
    x, y, colours = phase.first, phase.intervals, "RdBu_r"
    mesh = axes[1].pcolormesh(x, y, change.T, cmap=colours, vmin=-bound, vmax=bound, shading="auto")
    figure.colorbar(mesh, ax=axes[1], label="change by the shots, %")
    axes[1].set_ylabel("interval, s")
    axes[1].grid(visible=False)
    for axis in axes:
        axis.set_xlim(phase.first[0], phase.first[-1])
    return save(figure, path)


def draw_driving(driving: Driving, path: Path) -> Path:
    """Figs. 10 to 12: hull and road at each speed, without shots and with three."""
    title = "Frozen plough, one of the random roads: displacement of hull and road (Figs. 10 to 12)"
    figure, axes = panels(len(driving.samples), title=title, below="t, s")
    for axis, sample in zip(axes, driving.samples, strict=True):
        axis.plot(sample.t, 1e3 * sample.road, color="0.7", linewidth=1.0, label="road")
        for shots, colour in ((0, COLOURS[0]), (max(sample.heave), COLOURS[1])):
            axis.plot(sample.t, 1e3 * sample.heave[shots], color=colour, linewidth=1.1, label=f"hull, {_SHOTS[shots]}")
        axis.set_ylabel(f"{sample.speed:g} km/h, mm")
        axis.margins(x=0.0, y=0.25)
        axis.legend(fontsize="small", frameon=False, ncols=3, loc="upper right")
    return save(figure, path)


def draw_permissible(driving: Driving, path: Path) -> Path:
    """The share of the roads up to a ratio of hull to road at each speed, and up to a permissible speed."""
    title = f"{len(driving.permissible)} random roads: share of them up to a value; dashed: quantiles 5, 50, 95 %"
    figure, axes = panels(2, title=title, below="speed above which the hull outgrows the road, km/h")
    for each, colour in zip(driving.speeds, COLOURS, strict=False):
        label = f"{each.speed:g} km/h, no shots"
        axes[0].step(*distribution(each.ratios[0]), where="post", linewidth=1.4, color=colour, label=label)
    axes[0].axvline(1.0, color="0.5", linewidth=0.9, linestyle=":")
    axes[0].set_xlabel("hull's amplitude over the road's")
    axes[1].step(*distribution(driving.permissible), where="post", linewidth=1.4, color=COLOURS[0], label="all roads")
    for level in QUANTILES.values():
        speed = float(np.quantile(driving.permissible, level))
        axes[1].plot([speed, speed, 0], [0, level, level], "--", color="0.4", linewidth=0.9)
        axes[1].annotate(f"{speed:.3g}", (speed, 0), (3, 4), textcoords="offset points", fontsize="small", color="0.3")
    axes[1].axvline(20.0, color=COLOURS[1], linewidth=1.4, label="the paper's 20 km/h")
    for axis in axes:
        axis.set_ylabel("share of the roads")
        axis.set_ylim(0.0, 1.02)
        axis.legend(fontsize="small", frameon=False, loc="lower right")
    axes[1].set_xlim(left=0.0)
    return save(figure, path)
