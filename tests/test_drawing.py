"""The drawing process beside a run: it holds nothing up, draws what it is given, and says why where it cannot."""

import os
import signal

import numpy as np
import pytest

from qddot.runner.pictures.picture import Curve, Panel, Picture
from qddot.runner.report.background import Drawing


@pytest.fixture
def picture():
    t = np.linspace(0.0, 10.0, 50_001)  # far more than a pipe holds
    return Picture("sine", (Panel((Curve(t, np.sin(t), "sine"),), "sine, m"),))


def test_a_process_that_is_not_ready_holds_the_run_up_in_no_way(picture, tmp_path):
    with Drawing() as drawing:
        os.kill(drawing._process.pid, signal.SIGSTOP)
        drawing.begin(picture, tmp_path / "sine.png")  # would never return if it waited for the process
        os.kill(drawing._process.pid, signal.SIGCONT)
        drawing.finish()
    assert (tmp_path / "sine.png").read_bytes().startswith(b"\x89PNG")


def test_a_picture_that_cannot_be_drawn_is_an_error_that_says_why(picture, tmp_path):
    with Drawing() as drawing:
        drawing.begin(picture, tmp_path / "sine.nonsense")
        with pytest.raises(OSError, match=r"the figure could not be drawn: .*nonsense"):
            drawing.finish()


def test_a_process_that_was_killed_is_an_error(picture, tmp_path):
    with Drawing() as drawing:
        drawing._process.kill()
        drawing.begin(picture, tmp_path / "sine.png")
        with pytest.raises(OSError, match="no reason given"):
            drawing.finish()


def test_a_run_that_fails_before_its_figure_leaves_no_process():
    with Drawing() as drawing:
        pass
    assert drawing._process.returncode is not None
