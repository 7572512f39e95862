"""What all families of methods share: which times are saved, where a run stops, room for points and events."""

import ast
from pathlib import Path

import numpy as np
import pytest
from numba import njit

from qddot.runner.frame.log import log_for
from qddot.runner.frame.output_times import check_within, wanted_times
from qddot.runner.frame.stops import grid_stops, stops_to_end
from qddot.runner.load import load
from qddot.runner.problem import Status
from qddot.runner.simulate import simulate
from qddot.runner.solve import solve

#: One method of each family.
FAMILIES = ("rk4", "tsit5", "ode15s", "rodas5p")


@njit
def decay(t, x, u, c, dx):
    dx[0] = -x[0]


@njit
def swing(t, x, u, c, dx):
    dx[0], dx[1] = x[1], -x[0]


class TestTimes:
    def test_wanted_are_those_within_and_the_ends_are_saved_anyway(self):
        assert wanted_times([0.0, 0.25, 1.0], 0.0, 1.0).tolist() == [0.25]
        assert wanted_times(None, 0.0, 1.0).size == 0

    def test_no_more_than_rounding_beyond_the_end_is_the_end(self):
        assert wanted_times([0.5, np.nextafter(1.0, 2.0)], 0.0, 1.0).tolist() == [0.5]

    @pytest.mark.parametrize(("t0", "t1"), [(0.0, 1.0), (1.0, 0.0)])
    def test_what_lies_outside_is_named_whichever_way_the_run_goes(self, t0, t1):
        with pytest.raises(ValueError, match=rf"output time 1.5 is outside the span from {t0} to {t1}"):
            check_within([0.5, 1.5], t0, t1)

    def test_stops_are_breakpoints_within_then_the_end(self):
        assert stops_to_end(np.array([-1.0, 0.0, 0.5, 0.5, 1.0, 2.0]), 0.0, 1.0).tolist() == [0.5, 1.0]

    def test_breakpoints_of_a_grid_are_its_points_and_no_wanted_time_twice(self):
        near = 3 * 0.1  # a grid point as it is computed here, not as the grid counts it from 0
        stops = grid_stops(np.array([0.25, near, 0.7]), np.array([0.7, 0.85]), 0.0, 1.0, 0.1)
        assert stops.tolist() == [0.25, 3.0 * 0.1, 0.7, 0.85]


class TestLog:
    def problem(self):
        return type("P", (), {"initial_state": np.array([1.0, 2.0]), "t0": 0.0})

    def test_room_doubles_and_what_is_there_stays(self):
        log = log_for(self.problem(), np.array([1.0]), np.zeros(0), refine=1, events=1, room=4)
        log.save(0.5, np.array([3.0, 4.0]))
        log.make_room(1)
        assert log.record["room"] == 8
        assert log.arrays["saved_x"][:2].tolist() == [[1.0, 2.0], [3.0, 4.0]]
        assert log.record["saved_x"] == log.arrays["saved_x"].ctypes.data

    def test_room_is_made_for_a_step_of_many_points_and_many_events(self):
        log = log_for(self.problem(), np.array([1.0]), np.zeros(0), refine=1000, room=4)
        log.make_room(40)
        assert log.record["room"] >= 1002
        assert log.record["event_room"] >= 40

    def test_a_point_is_saved_once(self):
        log = log_for(self.problem(), np.array([1.0]), np.zeros(0))
        log.save(0.0, np.array([9.0, 9.0]))
        assert log.record["saved"] == 1


@pytest.mark.parametrize("method", ["tsit5", "ode15s", "rodas5p"])
def test_more_points_a_step_than_there_is_room_for_at_first(method):
    """A run that asked for them used to wait for ever for room that nobody made."""
    run = solve(decay, (0, 1), [1.0], method=method, refine=1000, max_step=0.5, rtol=1e-6, time_limit=60)
    assert run.status is Status.FINISHED
    assert len(run.t) == 1 + 1000 * run.statistics.steps
    assert (np.diff(run.t) > 0).all()
    np.testing.assert_allclose(run["x_1"], np.exp(-run.t), rtol=1e-4)


@pytest.mark.parametrize("method", FAMILIES)
def test_a_time_that_rounding_put_beyond_the_end_is_the_end(method):
    times = [0.1, 0.2, np.nextafter(0.3, 1.0)]
    run = solve(swing, (0, 0.3), [1.0, 0.0], method=method, output_times=times, step=0.01 if method == "rk4" else None)
    assert run.t.tolist() == [0.0, 0.1, 0.2, 0.3]


def test_the_exact_method_saves_at_the_same_times():
    oscillator = load("tests/sample_models/oscillator.py")
    times = [0.1, 0.2, np.nextafter(0.3, 1.0)]
    run = simulate(oscillator, (0, 0.3), method="exact", initial=[0.1, 0.0], output_times=times)
    assert run.t.tolist() == [0.0, 0.1, 0.2, 0.3]


def test_the_frame_knows_no_method():
    root = Path(__file__).parent.parent / "runner"
    families = {path.name for path in root.iterdir() if path.name in ("explicit", "stiff", "exact", "lanes")}
    assert len(families) == 4
    for path in (root / "frame").glob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.ImportFrom):
                assert not families & set(str(node.module).split(".")), path
