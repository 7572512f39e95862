"""A study from Python, read once and run in many ways; numbers of a run; and one's own TOML files and pages."""

import numpy as np
import pytest

import qddot
from qddot import drawing, report, toml

STUDY = """\
model = "quarter_car"
span = [0, 2]
[integration]
method = "rk4"
step = 1e-3
output_times = [0.5, 1.0]
[parameters]
m_s = "300 kg"
[inputs.z_r]
kind = "sine"
amplitude = 0.01
frequency = 2
[initial]
z_s = 0.02
"""


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    file = tmp_path_factory.mktemp("studies") / "car.toml"
    file.write_text(STUDY)
    return file


@pytest.fixture(scope="module")
def study(path):
    return qddot.read_study(path)


def test_a_study_that_was_read_runs_as_its_file_does(path, study):
    run, before = study.run(), qddot.run_study(path)
    np.testing.assert_array_equal(run.values, before.values)
    assert list(run.t) == [0.0, 0.5, 1.0, 2.0]
    assert study.span == (0.0, 2.0)
    assert study.tables.parameters == {"m_s": "300 kg"}
    assert study.arguments["parameters"] == (None, {"m_s": 300.0})
    assert study.inputs["z_r"](0.125) == pytest.approx(0.01)


def test_a_study_that_is_changed_is_the_one_that_the_file_would_say(path, study):
    changes = {"parameters.m_s": "0.4 t", "inputs.z_r.frequency": 3, "integration.output_times": [0.25]}
    run = study.changed(changes).run()
    np.testing.assert_array_equal(run.values, qddot.run_study(path, changes=changes).values)
    assert run.metadata["parameter m_s"] == 400.0
    assert study.run().metadata["parameter m_s"] == 300.0  # itself it stays as it is
    assert study.changed({"span": [0, 1]}).model is study.model


def test_a_run_exchanges_method_span_and_inputs(study):
    exact = study.run(method="exact", output_times=[1.0], span=(0.0, 1.5), inputs={"z_r": 0.0})
    car, start = study.model, [0.02, 0.0, 0.0, 0.0]
    by_hand = qddot.simulate(
        car, (0.0, 1.5), method="exact", output_times=[1.0], parameters={"m_s": 300.0}, initial=start
    )
    assert list(exact.t) == [0.0, 1.0, 1.5]
    np.testing.assert_array_equal(exact["z_s"], by_hand["z_s"])
    finer = study.run(step=5e-4)
    assert list(finer.t) == [0.0, 0.5, 1.0, 2.0]  # what else the study says of the method stays
    assert finer.statistics.steps == 2 * study.run().statistics.steps


def test_a_prepared_study_is_run_from_other_states(study):
    ready = study.prepare(method="exact", inputs={"z_r": 0.0})
    once, twice = ready([0.01, 0.0, 0.0, 0.0]), ready([0.02, 0.0, 0.0, 0.0])
    np.testing.assert_allclose(twice["z_s"], 2.0 * once["z_s"], atol=1e-14)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda study: study.changed({"parametres.m_s": 1}), r"car.toml: parametres.m_s: unknown table 'parametres'"),
        (lambda study: study.changed({"span": [1, 0]}), r"car.toml, line 2: span: from 1 to 0 s"),
        (lambda study: study.run(method="rk5"), r"car.toml: unknown method 'rk5'; did you mean"),
        (lambda study: study.run(method="rk4", step=-1.0), r"car.toml: step is -1.0, expected"),
        (lambda study: study.run(stepp=1.0), r"car.toml: unknown option 'stepp'; did you mean 'step'"),
        (lambda study: study.run(inputs={"z": 1.0}), r"car.toml: .*unknown input 'z'"),
        (lambda study: qddot.read_study(study.path, {"model": "quarter_cart"}), r"car.toml, line 1: model: "),
    ],
)
def test_what_cannot_be_names_the_file(study, call, message):
    with pytest.raises(qddot.StudyError, match=message):
        call(study)


@pytest.fixture(scope="module")
def sine_run():
    """A run whose input is 0.01 sin(4 pi t), saved every 7 ms."""
    road = qddot.signal.sine(0.01, 2.0)
    return qddot.simulate(
        qddot.load("quarter_car"), (0, 2), step=1e-3, inputs={"z_r": road}, initial=[0.0] * 4, every=7
    )


def test_metrics_of_a_run_are_those_of_its_sine(sine_run):
    assert qddot.metric(sine_run, "rms", "z_r", interval=1e-3) == pytest.approx(0.01 / np.sqrt(2), rel=1e-3)
    assert qddot.metric(sine_run, "max", "z_r", interval=7e-3) == pytest.approx(0.01, rel=1e-4)
    assert qddot.metric(sine_run, "crossings", "z_r", interval=7e-3, level=0.005) == 8  # 4 periods, up and down
    late = qddot.metric(sine_run, "time_of_max", "z_r", interval=7e-3, after=1.0, before=1.5)
    assert late == pytest.approx(1.125, abs=1e-3)


def test_samples_that_are_evenly_spaced_need_no_interval(study):
    even = study.run(method="exact", output_times=np.linspace(0.0, 2.0, 401))
    kept = qddot.metric(even, "mean", "z_s"), qddot.metric(even, "mean", "z_s", interval=5e-3)
    assert kept[0] == kept[1] == pytest.approx(np.trapezoid(even["z_s"], even.t) / 2.0)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda run: qddot.metric(run, "rsm", "z_r"), "unknown metric 'rsm'; did you mean 'rms'"),
        (lambda run: qddot.metric(run, "rms", "z"), "unknown quantity 'z'; did you mean"),
        (lambda run: qddot.metric(run, "rms"), "rms.of: missing"),
        (lambda run: qddot.metric(run, "rms", "z_r"), "the points of the run are not evenly spaced"),
        (lambda run: qddot.metric(run, "rms", "z_r", interval=0.0), "interval is 0.0, expected"),
        (lambda run: qddot.metric(run, "rms", "z_r", interval=5.0), "but the run lasts 2 s"),
        (lambda run: qddot.metric(run, "rms", "z_r", interval=0.01, level=1.0), "rms takes none"),
        (lambda run: qddot.reading(run, "z_r", "gratest"), "unknown reading 'gratest'; did you mean 'greatest'"),
        (lambda run: qddot.reading(run, "z_r", "at"), "`at` is a time"),
        (lambda run: qddot.reading(run, "z_r", "final", at=1.0), "`at` is a time"),
        (lambda run: qddot.reading(run, "z_r", "at", at=3.0), "run from 0 to 2 s"),
        (lambda run: qddot.reading(run, "zr"), "unknown quantity 'zr'; did you mean 'z_r'"),
    ],
)
def test_a_number_that_cannot_be_taken_says_why(sine_run, call, message):
    with pytest.raises(ValueError, match=message):
        call(sine_run)


class Shots(toml.Table):
    """Shots of a study."""

    study: toml.StudyFile
    times: tuple[toml.Real, ...]
    rounds: toml.Whole = 1


def test_a_file_of_ones_own_is_read_as_strictly_as_a_study(tmp_path):
    file = tmp_path / "shots.toml"
    file.write_text('study = "car.toml"\ntimes = [1, 2.85]\n')
    assert toml.read(file, Shots) == Shots(study="car.toml", times=(1.0, 2.85))
    for text, message in (
        ('study = "car.toml"\ntimes = [1, "2"]', r"shots.toml, line 2: times.1: found '2', expected a number"),
        ('study = "car.toml"\ntime = [1]', r"shots.toml, line 2: time: unknown key 'time'; did you mean 'times'"),
        ('study = "../car.toml"\ntimes = [1]', r"shots.toml, line 1: study: '../car.toml' does not lie below"),
        ("study = ", r"shots.toml: no valid TOML"),
    ):
        file.write_text(text)
        with pytest.raises(qddot.StudyError, match=message):
            toml.read(file, Shots)


def test_a_page_of_ones_own_has_its_sections_styles_scripts_and_data(tmp_path):
    moving = report.Section("Moving", "<p>here</p>", style=".own { color: red; }", script="use(data.own.speed);")
    page = report.write_page(tmp_path / "page.html", "Mine", "me", [moving], data={"speed": 3.5}).read_text()
    assert ".own { color: red; }" in page
    assert "{\nuse(data.own.speed);}" in page
    assert '"own":{"speed":3.5}' in page
    assert page.index("use(data.own.speed)") < page.index('dataset.ready = "yes"')


def test_panels_are_drawn_under_each_other(tmp_path):
    figure, axes = drawing.panels(2, 1.0, title="Two", below="t in s")
    for axis, colour in zip(axes, drawing.COLOURS, strict=False):
        axis.plot([0.0, 1.0], [0.0, 1.0], color=colour)
    assert axes[-1].get_xlabel() == "t in s" and not axes[0].get_xlabel()
    assert drawing.save(figure, tmp_path / "two.png").read_bytes().startswith(b"\x89PNG")
