"""Figures of runs and batches: scaled units, nothing twice, nothing hidden by offsets, nothing left out unsaid."""

import re
import sys
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from commands import command

import qddot
from qddot.runner.commands.plot_runs import plot_runs
from qddot.runner.pictures.arrange import TALL, run_picture
from qddot.runner.pictures.figures import drawn
from qddot.runner.pictures.panel import Line, panel_of
from qddot.runner.pictures.scales import legible, scaled
from qddot.runner.report.saved_run import read_run
from qddot.runner.tables import Quantity

ROOT = Path(__file__).parent.parent
T = np.linspace(0.0, 1.0, 101)
WAVE = np.sin(2 * np.pi * T)
CAR = qddot.load("quarter_car")


class Run:
    """Columns by name: name -> (unit, values)."""

    def __init__(self, **columns):
        self.t, self.columns, self.names = T, columns, tuple(columns)

    def quantity(self, name):
        return Quantity(name, self.columns[name][0], f"meaning of {name}")

    def __getitem__(self, name):
        return self.columns[name][1]


@pytest.fixture(scope="module")
def run():
    bump = qddot.signal.pulse_train(times=[0.1], duration=0.2, impulse=0.004)
    return qddot.simulate(CAR, (0, 1), step=1e-3, inputs={"z_r": bump})


@pytest.mark.parametrize(
    ("unit", "largest", "factor", "said"),
    [
        ("m", 0.02, 1e3, "mm"),
        ("m", 0.3, 1e3, "mm"),
        ("m", 2.0, 1.0, "m"),
        ("m", 2e-6, 1e6, "µm"),
        ("m", 4e9, 1e-3, "km"),
        ("N", 26_150.0, 1e-3, "kN"),
        ("N", 3e6, 1e-6, "MN"),
        ("N", 999.0, 1.0, "N"),
        ("N m", 5000.0, 1e-3, "kN m"),
        ("N s/m", 2000.0, 1e-3, "kN s/m"),
        ("m/s", 0.4, 1.0, "m/s"),
        ("m/s^2", 0.004, 1e3, "mm/s²"),
        ("rad", 0.004, 1e3, "mrad"),
        ("rad", 4000.0, 1.0, "rad"),
        ("m^2", 1e-4, 1.0, "m²"),
        ("kg", 1e5, 1.0, "kg"),
        ("1", 1e5, 1.0, ""),
        ("m", 0.0, 1.0, "m"),
        ("m", np.nan, 1.0, "m"),
        ("molecule", 1e5, 1.0, "molecule"),
    ],
)
def test_units_are_those_an_engineer_would_write(unit, largest, factor, said):
    assert scaled(unit, largest) == (pytest.approx(factor), said)


def test_powers_are_raised():
    assert [legible(unit) for unit in ("m/s^2", "m s^-1.75", "kg*m**2", "1", "m^(-3)")] == [
        "m/s²", "m s⁻¹·⁷⁵", "kg m²", "", "m⁻³",
    ]  # fmt: skip


def test_a_panel_says_quantity_and_unit_and_has_no_legend_of_one_entry():
    panel = panel_of([Line(T, 0.02 * WAVE, "heave", "m", "heave of the hull")], None)
    assert (panel.axis, panel.above, panel.legend) == ("heave, mm", "heave of the hull", False)
    np.testing.assert_allclose(panel.curves[0].values, 20 * WAVE)
    both = panel_of([Line(T, WAVE, "a", "N"), Line(T, 2000 * WAVE, "b", "N")], None)
    assert (both.axis, both.legend, [curve.name for curve in both.curves]) == ("force, kN", True, ["a", "b"])


def test_quantities_of_several_units_are_each_scaled_and_say_so():
    panel = panel_of([Line(T, 0.02 * WAVE, "x", "m"), Line(T, 5000 * WAVE, "F", "N")], ())
    assert [curve.name for curve in panel.curves] == ["x, mm", "F, kN"]
    np.testing.assert_allclose(panel.curves[1].values, 5 * WAVE)


def test_an_offset_that_would_flatten_a_curve_is_taken_off_and_told():
    panel = panel_of([Line(T, 0.7 + 1e-4 * WAVE, "q", "m", "height")], None)
    assert panel.axis == "change of q, µm" and panel.above == "height, from 0.7 m"
    np.testing.assert_allclose(panel.curves[0].values, 100 * WAVE, atol=1e-6)
    apart = [Line(T, level + WAVE, f"F_{level}", "N") for level in (0.0, 40.0)]
    found = panel_of(apart, None)
    assert (found.axis, found.above) == ("change of force, N", "since the start")
    assert panel_of(apart, ()).axis == "force, N"  # unless somebody chose
    assert panel_of([Line(T, 3.0 + WAVE, "q", "m")], None).axis == "q, m"


def test_what_stands_still_is_not_said_to_change():
    assert panel_of([Line(T, np.full(101, 5.0), "q", "N")], None).axis == "q, N"


def test_five_roads_are_raised_apart_and_the_distance_is_told():
    lines = [Line(T, 0.02 * np.roll(WAVE, 5 * k), f"z_{k}", "m", f"road under axle {k}") for k in range(5)]
    panel = panel_of(lines, None, apart=True)
    assert panel.spacing == 50 and panel.above == "road under axle 0 … 4; 50 mm from line to line"
    assert [curve.raised for curve in panel.curves] == [200, 150, 100, 50, 0]
    edges = [(curve.values.min() + curve.raised, curve.values.max() + curve.raised) for curve in panel.curves]
    assert all(upper[0] > lower[1] for upper, lower in pairwise(edges))  # none hides another
    roads = Run(**{line.name: (line.unit, line.values) for line in lines})
    axis = drawn(run_picture(roads, {"inputs": roads.names})).axes[0]
    assert [label.get_text() for label in axis.get_yticklabels()] == [f"z_{k}" for k in range(5)]


def test_an_output_that_is_a_coordinate_is_drawn_once_under_both_names():
    columns = {"q_6": ("m", 0.01 * WAVE), "heave": ("m", 0.01 * WAVE), "other": ("m", 0.02 * WAVE), "F": ("N", 0 * T)}
    run = Run(**columns)
    picture = run_picture(run, {"coordinates": ["q_6"], "outputs": ["heave", "other"], "inputs": ["F"]})
    assert [panel.axis for panel in picture.panels] == ["heave = q_6, mm", "other, mm"]
    assert picture.notes == ("0 throughout, not drawn: F",)
    asked = run_picture(run, {"coordinates": ["q_6"], "outputs": ["heave"]}, panels=["q_6", "heave"])
    assert [panel.axis for panel in asked.panels] == ["q_6, mm", "heave, mm"]  # who asks for both has both


def test_nothing_is_left_out_without_a_word():
    many = {f"q_{k}": ("m", (k + 1) * WAVE) for k in range(100)}
    picture = run_picture(Run(**many), {"coordinates": list(many)})
    drawn_names = [curve.name for panel in picture.panels for curve in panel.curves]
    assert len(picture.panels) == TALL
    (note,) = picture.notes
    assert note.startswith(f"not drawn: {100 - len(drawn_names)} quantities more, q_{len(drawn_names)}")
    twenty = dict(list(many.items())[:20])
    panels = run_picture(Run(**twenty), {"coordinates": list(twenty)}).panels
    assert [len(panel.curves) for panel in panels] == [5, 5, 5, 5]


def test_titles_are_wrapped_and_dollars_are_dollars(tmp_path):
    picture = run_picture(Run(q=("m", WAVE)), {}, "costs $5 and $6 " * 12, ["q"])
    figure = drawn(picture)
    figure.savefig(tmp_path / "it.png")
    assert figure.get_suptitle().count("\n") >= 1 and max(map(len, figure.get_suptitle().split("\n"))) < 110


def test_a_solution_plots_what_it_is_asked_for(run):
    figure = run.plot("z_s", ("z_s", "z_u"), from_start=["z_s"])
    assert [axis.get_ylabel() for axis in figure.axes] == ["change of z_s, mm", "displacement, mm"]
    line = figure.axes[0].lines[0]
    np.testing.assert_allclose(line.get_ydata(), 1e3 * (run.closely["z_s"] - run["z_s"][0]))
    assert figure._repr_png_().startswith(b"\x89PNG")
    assert len(run.plot().axes) >= 4
    with pytest.raises(ValueError, match="unknown quantity 'z_t'; did you mean"):
        run.plot("z_t")


def test_a_signal_plots_its_peak():
    shot = qddot.signal.pulse_train(times=[1.0], duration=0.01, impulse=5.0)
    axis = shot.plot(0, 100, name="F", unit="N").axes[0]
    assert axis.get_ylabel() == "F, N"
    assert axis.lines[0].get_ydata().max() == pytest.approx(5.0 * np.pi / 2 / 0.01, rel=1e-3)
    assert shot.plot().axes[0].get_xlim()[0] < 1.0 < shot.plot().axes[0].get_xlim()[1]
    for ends, found in (((2, 1), "start is 2 s and end is 1 s"), ((0, np.nan), "end is nan, expected a finite number")):
        with pytest.raises(ValueError, match=found):
            shot.plot(*ends)


def test_a_batch_plots_runs_or_what_most_of_them_are_between():
    times = np.linspace(0, 0.5, 51)
    heights = np.linspace(0.01, 0.03, 9)
    batch = qddot.simulate_batch(
        CAR,
        (0, 0.5),
        step=1e-3,
        inputs={"z_r": [qddot.signal.constant(h) for h in heights]},
        output_times=times,
        names=["z_s", "tyre_force"],
    )
    axis = batch.plot("z_s").axes[0]
    np.testing.assert_allclose(axis.lines[0].get_ydata(), 1e3 * np.median(batch["z_s"], axis=0), rtol=1e-12)
    assert len(axis.collections) == 1 and "90 % of 9 runs" in axis.get_title("left")
    chosen = batch.plot(runs=[0, 8]).axes
    assert [text.get_text() for text in chosen[0].get_legend().get_texts()] == ["run 0", "run 8"] and len(chosen) == 2
    for wrong, message in (
        (lambda: batch.plot("z_x"), "unknown quantity 'z_x'"),
        (lambda: batch.plot(runs=[9]), "there is no run 9; the runs are 0 to 8"),
        (lambda: batch.plot(runs=[]), "runs is empty"),
    ):
        with pytest.raises(ValueError, match=message):
            wrong()


def test_without_matplotlib_the_extra_is_named(run, monkeypatch):
    monkeypatch.setitem(sys.modules, "qddot.runner.pictures.figures", None)  # as where an import fails
    monkeypatch.delitem(sys.modules, "matplotlib.figure")
    real = __import__

    def without(name, *rest, **more):
        if name == "qddot.runner.pictures.figures":
            raise ModuleNotFoundError("No module named 'matplotlib'", name="matplotlib")
        return real(name, *rest, **more)

    monkeypatch.setattr("builtins.__import__", without)
    for plot in (run.plot, qddot.signal.constant(1.0).plot):
        with pytest.raises(ModuleNotFoundError, match=r"needs matplotlib, .*pip install 'qddot\[report\]'"):
            plot()


@pytest.fixture(scope="module")
def saved(run, tmp_path_factory):
    folder = tmp_path_factory.mktemp("saved")
    softer = qddot.simulate(
        CAR, (0, 1), step=2e-3, parameters={"k_s": 8000.0}, inputs={"z_r": qddot.signal.constant(0.01)}
    )
    return run.save(folder / "a.nc"), softer.save(folder / "b.nc")


def test_a_saved_run_is_read_back(run, saved):
    read = read_run(saved[0])
    np.testing.assert_array_equal(read["z_s"], run["z_s"])
    assert read.headlines == run.headlines and read.quantity("z_s") == run.quantity("z_s")


def test_runs_are_drawn_alone_over_each_other_and_as_a_page(saved, tmp_path):
    (tmp_path / "x").mkdir()
    assert plot_runs(saved, [], False, tmp_path / "two.svg") == 0
    svg = (tmp_path / "two.svg").read_text()
    assert re.search("<!-- tyre_force, k?N ", svg) and svg.count("<!-- a -->") == svg.count("<!-- b -->") == 1
    assert plot_runs(saved, ["z_s"], False, tmp_path / "two.pdf") == 0
    assert (tmp_path / "two.pdf").read_bytes().startswith(b"%PDF")
    assert plot_runs(saved[:1], ["z_s"], True, tmp_path / "x" / "one.html") == 0
    page = (tmp_path / "x" / "one.html").read_text()
    assert "displacement of the sprung mass" in page and 'id="cursor"' in page
    assert not (saved[0].parent / "a.png").exists()
    plot_runs(saved, ["z_s"], False, None)
    assert (saved[0].parent / "a_over_b_quantity=z_s.png").exists()


def test_what_cannot_be_plotted_is_told_in_one_line(saved, tmp_path):
    (tmp_path / "c.nc").write_text("a text")
    a, b = map(str, saved)
    for words, message in (
        ([a, "--quantity", "z_t"], "--quantity: unknown quantity 'z_t'; did you mean"),
        ([a, a], "is given twice"),
        ([a, "--metric", "rms"], "--metric is of a batch"),
        ([a, tmp_path], "expected one batch, or one or several runs"),
        ([tmp_path / "c.nc"], "c.nc is no NetCDF file"),
        ([tmp_path / "d.nc"], "d.nc: there is no such file"),
        ([a, b, "--html", "--into", tmp_path / "e.png"], "with --html expected a name that ends in .html"),
        ([a, "--quantity", "z_s", "--quantity", "z_s"], "'z_s' is given twice"),
    ):
        done = command("plot", *words)
        assert done.returncode == 2 and message in done.stderr, done.stderr
        assert done.stderr.count("\n") == 1
    assert sorted(path.name for path in tmp_path.iterdir()) == ["c.nc"]
