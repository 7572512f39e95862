from qddot.runner.frame.slices import run_slices
from qddot.runner.problem import Status


class Run:
    """A run of ten slices; something happens before slice `at`."""

    def __init__(self, at=None, happens=None):
        self.slices, self.at, self.happens = 0, at, happens

    def one_slice(self):
        if self.slices == self.at:
            return self.happens()
        self.slices += 1
        return int(Status.FINISHED if self.slices == 10 else Status.RUNNING)

    def fraction_done(self):
        return self.slices / 10


def interrupt():
    raise KeyboardInterrupt


def test_slices_run_until_finished():
    run = Run()
    assert run_slices(run.one_slice, fraction_done=run.fraction_done) is Status.FINISHED
    assert run.slices == 10


def test_interrupt_keeps_what_was_done():
    run = Run(4, interrupt)
    assert run_slices(run.one_slice, fraction_done=run.fraction_done) is Status.INTERRUPTED
    assert run.slices == 4


def test_time_limit_ends_the_run_between_slices():
    run = Run()
    assert run_slices(run.one_slice, fraction_done=run.fraction_done, time_limit=1e-12) is Status.TIME_LIMIT
    assert run.slices == 1


def test_failure_is_handed_on():
    run = Run(3, lambda: int(Status.NON_FINITE))
    assert run_slices(run.one_slice, fraction_done=run.fraction_done, time_limit=1e9) is Status.NON_FINITE


def test_progress_ends_with_everything_done(monkeypatch):
    monkeypatch.setattr("qddot.runner.frame.slices.REPORT_INTERVAL", 0.0)
    run, seen = Run(), []
    run_slices(run.one_slice, fraction_done=run.fraction_done, progress=seen.append)
    assert seen == [i / 10 for i in range(1, 11)]
