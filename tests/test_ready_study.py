"""A study ready to run: changes of it are what a study read with them is, and share with it what stays."""

from pathlib import Path

import numpy as np
import pytest
from batches import STUDY
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from study_files import write

import qddot
from qddot.runner.study.read import StudyError
from qddot.runner.study.ready import read_study
from qddot.runner.study.rows import row_of

ROOT = Path(__file__).parent.parent


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    return write(tmp_path_factory.mktemp("ready"), STUDY)


CHANGES = st.fixed_dictionaries(
    {},
    optional={
        "parameters.m_s": st.floats(150, 600),
        "inputs.z_r.peak": st.floats(-0.05, 0.05),
        "inputs.z_r.times.0": st.floats(0.0, 0.3),
        "integration.step": st.sampled_from([1e-3, "2 ms", 5e-4]),
        "initial": st.fixed_dictionaries({"z_s": st.floats(-0.1, 0.1)}),
    },
)


@settings(deadline=None, max_examples=25, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(first=CHANGES, second=CHANGES)
def test_a_change_of_a_study_is_the_study_read_with_it(path, first, second):
    base = read_study(path)
    for changes in (first, second, {}):
        found = base.changed(changes).run()
        expected = qddot.run_study(path, changes=changes)
        assert np.array_equal(found.t, expected.t)
        assert np.array_equal(found.values, expected.values)
    again = base.changed(first).changed(second).run()
    assert np.array_equal(again.values, qddot.run_study(path, changes={**first, **second}).values)


def test_what_a_change_leaves_is_not_made_again(path):
    base = read_study(path)
    lighter = base.changed({"parameters.m_s": 222.0})
    assert lighter.model is base.model
    assert lighter.arguments["inputs"]["z_r"] is base.arguments["inputs"]["z_r"]
    higher = base.changed({"inputs.z_r.peak": 0.01})
    assert higher.arguments["inputs"]["z_r"] is not base.arguments["inputs"]["z_r"]
    assert base.tables.parameters == {}


def test_the_profile_of_a_road_is_made_once_for_all_speeds():
    base = read_study(ROOT / "studies" / "terrain_run.toml")
    assert base.tables.road.kind == "iso8608"

    def road(changes):
        inputs = base.changed(changes).arguments["inputs"]
        return next(inputs[name] for name in inputs if inputs[name].pieces.shape[0] > 100)

    fast, slow, other = road({}), road({"road.speed": "9 km/h"}), road({"road.seed": 77})
    assert slow.pieces is fast.pieces
    assert slow.rate == pytest.approx(2.5)
    assert other.pieces is not fast.pieces
    assert not np.array_equal(other.pieces, fast.pieces)


def test_another_model_is_loaded_and_its_inputs_are_its_own(path):
    base = read_study(path, {"inputs": {}})
    other = base.changed({"model": "pendulum"})
    assert (base.model.name, other.model.name) == ("quarter_car", "pendulum")


@pytest.mark.parametrize(("changes", "message"), [
    ({"parameters.m_z": 1.0}, "parameters.m_z: unknown parameter 'm_z'; did you mean"),
    ({"inputs.z_r.peak": "1 kg"}, "inputs.z_r.peak"),
    ({"span": [1, 0]}, "span: from 1 to 0 s; expected a start before the end"),
    ({"integration.step": -1}, "step is -1"),
])  # fmt: skip
def test_a_change_that_cannot_be_is_refused_as_in_a_file(path, changes, message):
    with pytest.raises(StudyError, match=message) as refused:
        read_study(path).changed(changes).run()
    assert str(refused.value).startswith(str(path))


def test_runs_prepared_once_run_as_often_as_wanted(path):
    prepared = read_study(path).prepare()
    one, other = prepared(), prepared()
    assert np.array_equal(one.values, other.values)


def test_a_row_of_a_study_that_only_its_sweep_completes_runs(tmp_path):
    """The pulse has no peak of its own: `qddot batch` runs it, and so does `--row`."""
    path = write(tmp_path, STUDY.replace("peak = 0.02\n", ""))
    with pytest.raises(StudyError):
        read_study(path).run()
    assert row_of(path, {}, 5).run().success
    with pytest.raises(StudyError, match="the runs of the sweep are 0 to 35"):
        row_of(path, {}, 36)


def test_a_slip_in_the_sweep_is_named_with_its_place_for_a_row(tmp_path):
    path = write(tmp_path, STUDY.replace('["200 kg", "400 kg", 9]', '["200 kg", "400 kg", 0]'))
    with pytest.raises(StudyError, match=rf"{path.name}, line \d+: sweep.axes.0.linspace: a count of 0"):
        row_of(path, {}, 0)
