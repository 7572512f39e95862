"""Figures of batches: no star on one of many ties, no legend of one entry, units with raised powers."""

from types import SimpleNamespace

import numpy as np
import pytest

from qddot.runner.report import batch_figures


@pytest.fixture
def results():
    """A sweep of 4 by 3 runs: `least` has one best run, `tied` has six."""
    x, y = (each.ravel() for each in np.meshgrid(np.arange(4.0), np.arange(3.0), indexing="ij"))
    columns = {"x": x, "y": y, "least": x + y, "tied": np.where(x < 2, 0.0, x * (1 + y))}
    attrs = {"groups": [["x"], ["y"]], "shape": [4, 3], "sampled": []}

    class Data(dict):
        def __getitem__(self, name):
            return SimpleNamespace(attrs={"scale": "linear"})

    data = Data()
    data.attrs = attrs
    return SimpleNamespace(
        axes=("x", "y"),
        heading="A sweep",
        data=data,
        column=columns.__getitem__,
        unit=lambda name: {"least": "m/s^2", "x": "kN/m"}.get(name, ""),
        best_first=lambda name: np.argsort(columns[name], kind="stable"),
        text=lambda axis, run: f"{columns[axis][run]:g}",
    )


def test_the_star_stands_on_the_best_run_and_on_none_of_many_ties(results):
    figure = batch_figures._maps(results, ["least", "tied"], ["x", "y"])
    alone, tied = figure.axes[:2]
    (star,) = alone.lines
    assert (star.get_xdata(), star.get_ydata()) == (0.0, 0.0)
    assert not tied.lines and tied.get_title("left") == "best: 6 runs alike"
    assert figure.axes[2].get_ylabel() == "least, m/s²" and alone.get_xlabel() == "x, kN/m"
    assert alone.get_legend() is None


def test_colour_bars_touch_no_other_map(results):
    figure = batch_figures._maps(results, ["least", "tied"], ["x", "y"])
    figure.draw_without_rendering()
    left, right, bar = (axis.get_tightbbox() for axis in figure.axes[:3])
    assert left.x1 < bar.x0 and bar.x1 + 5 < right.x0


def test_a_legend_of_one_entry_is_a_title_where_the_axis_does_not_say_it(results):
    figure = batch_figures._lines(results, ["least"], "x")
    (axis,) = figure.axes
    assert len(axis.lines) == 3 and len(axis.get_legend().get_texts()) == 3  # one for each y
    results.data.attrs.update(groups=[["x", "y"]], shape=[12])
    (axis,) = batch_figures._lines(results, ["least"], "x").axes
    assert axis.get_legend() is None and axis.get_ylabel() == "least, m/s²"
