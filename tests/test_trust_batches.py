"""Batches that are not finished, that somebody stops, or that two want at once: nothing is said that is not so."""

import fcntl
import re
import signal
import socket
import subprocess
import sys
import time
import tracemalloc
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pyarrow.parquet
import pytest
from batches import STUDY, assert_equal, values, written
from commands import command

from qddot.runner.batch.export import export
from qddot.runner.batch.grid import open_batch
from qddot.runner.batch.job import read_job
from qddot.runner.batch.making import create, locked, remove
from qddot.runner.batch.results import Results
from qddot.runner.batch.run import computed, opened, run_batch
from qddot.runner.batch.store import Store, StoreError
from qddot.runner.commands.export import export as export_command
from qddot.runner.commands.plot import picture_of, plot, runs_of
from qddot.runner.commands.summary import summary
from qddot.runner.machine import compiling
from qddot.runner.report import batch_figures, batch_progress
from qddot.runner.study.batch_schema import SweepTable
from qddot.runner.study.sweep import sweep_of

ROOT = Path(__file__).parent.parent


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    folder = tmp_path_factory.mktemp("whole")
    return run_batch(written(folder), folder / "quick.zarr")


@pytest.fixture(scope="module")
def partial(tmp_path_factory, whole):
    """A store of 36 runs in nine blocks, some of which are finished; the last was being written when it was killed."""
    folder = tmp_path_factory.mktemp("partial")
    job = read_job(written(folder))
    store = opened(job, folder / "quick.zarr")
    for i, _ in enumerate(notes := computed(job, store)):
        if i == 1:
            notes.close()
    assert 2 <= len(store.finished()) <= 6
    assert max(store.finished()) < 8
    store.array("status")[32:36] = 1
    store.array("travel")[32:36] = 1e9
    return store.path


@pytest.fixture
def done(partial):
    return 4 * len(Store(partial).finished())


def test_a_store_that_is_not_finished_says_how_far_it_is(partial, done, capsys):
    results = Results(partial)
    assert results.partial == f"partial: {done} of 36 runs"
    assert results.heading == f"A quick batch (partial: {done} of 36 runs)"
    assert summary(partial) == 0
    said = capsys.readouterr().out
    assert f"A quick batch (partial: {done} of 36 runs)" in said
    assert f"{done} of 36 runs, 0 failed" in said
    assert "1e+09" not in said


def test_a_finished_store_says_nothing_of_that(whole):
    assert Results(whole).partial == ""
    assert Results(whole).heading == "A quick batch"
    assert "partial" not in open_batch(whole).attrs


def test_what_a_killed_process_half_wrote_is_not_there(partial, done, whole):
    results = Results(partial)
    there = np.array([4 * block + i for block in sorted(Store(partial).finished()) for i in range(4)])
    assert len(there) == done
    assert np.array_equal(results.finished, there)
    assert np.array_equal(results.column("travel")[there], Results(whole).column("travel")[there])
    assert np.isnan(np.delete(results.column("travel"), there)).all()
    data = open_batch(partial)
    assert data.attrs["partial"] == f"partial: {done} of 36 runs"
    assert (data["status"].to_numpy().ravel() == -1).sum() == 36 - done
    assert np.isnan(data["travel"].to_numpy()).sum() == 36 - done
    assert np.isnan(data["z_s"].to_numpy()).sum() >= (36 - done) * 101


def test_exports_of_a_partial_store_say_so(partial, done, tmp_path, capsys):
    assert export_command(partial, tmp_path / "rows.csv") == 0
    assert capsys.readouterr().out == f"wrote {tmp_path / 'rows.csv'}, partial: {done} of 36 runs\n"
    assert (tmp_path / "rows.csv").read_text().count("not_run") == 36 - done
    table = pyarrow.parquet.read_table(export(Results(partial), tmp_path / "rows.parquet"))
    assert table.schema.metadata[b"partial"].decode() == f"partial: {done} of 36 runs"


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("chosen", [{}, {"over": ["m_s"]}, {"over": ["height"]}, {"runs": [0]}])
def test_figures_of_a_partial_store_say_so(partial, done, chosen, monkeypatch, tmp_path):
    titles, original = [], batch_figures.save

    def saved(figure, path):
        titles.append(figure.get_suptitle())
        return original(figure, path)

    monkeypatch.setattr(batch_figures, "save", saved)
    runs = [int(Results(partial).finished[0])]
    batch_figures.draw(
        Results(partial), tmp_path / "it.png", **{**chosen, **({"runs": runs} if "runs" in chosen else {})}
    )
    assert titles == [f"A quick batch (partial: {done} of 36 runs)"]


def test_a_run_that_is_not_computed_yet_is_not_drawn(partial, tmp_path):
    with pytest.raises(ValueError, match=r"--runs: run 35 is not computed yet; the batch is partial: \d+ of 36 runs"):
        batch_figures.draw(Results(partial), tmp_path / "it.png", runs=[35])


class Clock:
    def __init__(self):
        self.now = 100.0

    def __call__(self):
        return self.now


def test_what_is_left_is_estimated_from_this_sitting_alone(monkeypatch):
    """3712 of 10 000 roads are there: the first hundred of this sitting take 10 s, so the rest takes 10 min."""
    clock = Clock()
    monkeypatch.setattr(compiling.time, "perf_counter", clock)
    monkeypatch.setattr(compiling._CLOCK, "seconds", compiling.compiled_for())
    progress = batch_progress.BatchProgress(10_000, 3712, 0)
    clock.now += 60.0  # compiling, workers that start: not integrating
    progress.ready()
    clock.now += 40.0
    compiling._CLOCK.seconds += 30.0  # of which numba compiled for 30
    progress.add({"runs": 50, "failed": 0, "steps": 500})
    clock.now += 0.001  # two threads finish at once, which is no rate of 50 000 runs/s
    progress.add({"runs": 50, "failed": 0, "steps": 500})
    assert progress.rate == pytest.approx(10.0, rel=1e-3)
    assert progress.left == "about 10 min left"
    progress.stop()
    assert progress.seconds == pytest.approx(10.001)


def test_spans_are_said_in_units_that_fit():
    assert [batch_progress._span(s) for s in (0.4, 119, 120, 7000, 7200, 180_000)] == [
        "0 s", "119 s", "2 min", "117 min", "2.0 h", "2.1 d",
    ]  # fmt: skip


def test_no_two_figures_of_a_store_have_one_name(whole, capsys):
    before = set(whole.parent.iterdir())
    asked = [
        {"metrics": [], "over": [], "runs": None},
        {"metrics": ["travel"], "over": [], "runs": None},
        {"metrics": ["travel"], "over": ["m_s"], "runs": None},
        {"metrics": ["travel"], "over": ["height", "m_s"], "runs": None},
        {"metrics": [], "over": ["height"], "runs": None},
        {"metrics": [], "over": [], "runs": "0,5"},
        {"metrics": [], "over": [], "runs": "best"},
        {"metrics": ["dissipated"], "over": [], "runs": "worst"},
    ]
    for each in asked:
        assert plot(whole, **each, into=None) == 0
    drawn = sorted(path.name for path in set(whole.parent.iterdir()) - before)
    assert len(drawn) == len(asked)
    assert {"quick.png", "quick_metric=travel_over=m_s.png", "quick_runs=0+5.png"} <= set(drawn)
    assert picture_of(Path("x.1")) != picture_of(Path("x.2"))


def test_the_best_and_the_worst_run_are_those_of_the_metric_that_is_given(whole):
    results = Results(whole)
    for metric in results.metrics:
        order = results.best_first(metric)
        assert runs_of(results, "best", [metric]) == [order[0]]
        assert runs_of(results, "worst", [metric]) == [order[-1]]


WRONG = {
    "unknown metric": ({"metrics": ["travell"]}, "--metric: unknown metric 'travell'; did you mean 'travel'"),
    "unknown metric of the best": (
        {"metrics": ["travell"], "runs": "best"},
        "--metric: unknown metric 'travell'; did you mean 'travel'",
    ),
    "metric twice": ({"metrics": ["travel", "travel"]}, "--metric: 'travel' is given twice"),
    "unknown axis": ({"over": ["m_z"]}, "--over: unknown axis 'm_z'; did you mean 'm_s'"),
    "axis twice": ({"over": ["m_s", "m_s"]}, "--over: 'm_s' is given twice"),
    "three axes": ({"over": ["m_s", "height", "travel"]}, "--over: unknown axis 'travel'"),
    "no such run": ({"runs": "36"}, "--runs: there is no run 36; the runs are 0 to 35"),
    "no number": ({"runs": "first"}, "--runs 'first': expected numbers of runs such as 0,5,17, or best, or worst"),
    "nothing": ({"runs": ""}, "--runs '': expected numbers"),
    "a number without end": ({"runs": "9" * 400}, "expected numbers of runs"),
    "runs over an axis": ({"runs": "0", "over": ["m_s"]}, "--over: trajectories of --runs are drawn over time"),
    "a metric of numbered runs": ({"runs": "0", "metrics": ["travel"]}, "--metric: trajectories of numbered --runs"),
    "the best of two": ({"runs": "best", "metrics": ["travel", "dissipated"]}, "--runs best: of which metric?"),
}


@pytest.mark.parametrize("case", WRONG)
def test_nothing_that_plot_is_given_is_ignored(whole, case):
    given, message = WRONG[case]
    before = set(whole.parent.iterdir())
    with pytest.raises(ValueError, match=re.escape(message)) as refused:
        plot(whole, **{"metrics": [], "over": [], "runs": None, "into": None} | given)
    assert "\n" not in str(refused.value)
    assert set(whole.parent.iterdir()) == before


@pytest.mark.parametrize("name", ["none.zarr", "empty", "run.nc", "other"])
def test_what_is_no_store_is_refused_in_one_line(tmp_path, name):
    (tmp_path / "empty").mkdir()
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "notes.txt").write_text("mine")
    (tmp_path / "run.nc").write_bytes(b"\x89HDF\r\n\x1a\n")
    path, found = tmp_path / name, []
    for ask in (
        lambda: summary(path),
        lambda: plot(path, [], [], None, None),
        lambda: export_command(path, tmp_path / "rows.csv"),
        lambda: open_batch(path),
    ):
        with pytest.raises(StoreError) as refused:
            ask()
        found.append(str(refused.value))
    what = {
        "none.zarr": "there is nothing",
        "empty": "an empty folder",
        "run.nc": "a file",
        "other": "a folder without",
    }
    for text in found:
        assert text.startswith(f"{path}: {what[name]}")
        assert "\n" not in text
    assert not (tmp_path / "rows.csv").exists()


def test_a_batch_takes_an_empty_folder_and_nothing_that_is_somebody_elses(tmp_path, whole):
    study, job = written(tmp_path), read_job(written(tmp_path))
    (tmp_path / "empty.zarr").mkdir()
    assert opened(job, tmp_path / "empty.zarr").finished() == set()
    other = tmp_path / "other"
    other.mkdir()
    (other / "notes.txt").write_text("mine")
    for fresh in (False, True):
        with pytest.raises(StoreError, match="a folder without a store in it"):
            opened(job, other, fresh)
    with pytest.raises(NotADirectoryError, match="is a file; expected a folder"):
        run_batch(study, study / "below.zarr")
    assert (other / "notes.txt").read_text() == "mine"


def test_of_batches_that_make_one_store_at_once_one_makes_it_and_one_computes_it(tmp_path, whole):
    study, path = written(tmp_path), tmp_path / "one.zarr"

    def attempt(_):
        try:
            return run_batch(study, path)
        except StoreError as error:
            return str(error)

    with ThreadPoolExecutor(4) as pool:
        ends = list(pool.map(attempt, range(4)))
    refused = {end for end in ends if end != path}
    assert path in ends
    assert refused <= {f"{path}: another process is computing this batch"}
    assert_equal(path, whole)
    assert sorted(each.name for each in tmp_path.iterdir()) == ["one.zarr", "quick.toml"]


def test_many_make_a_store_and_none_removes_what_another_is_making(tmp_path, whole):
    job = read_job(written(tmp_path))
    for turn in range(5):
        path = tmp_path / f"{turn}.zarr"
        with ThreadPoolExecutor(8) as pool:
            stores = list(pool.map(lambda _, path=path: create(path, job), range(8)))
        assert {store.path for store in stores} == {path}
        assert set(values(path)) == set(values(whole))
    assert not list(tmp_path.glob(".*"))


def test_a_store_that_is_being_computed_is_not_removed(tmp_path, whole):
    job = read_job(written(tmp_path))
    store = opened(job, tmp_path / "s.zarr")
    with locked(store.path), pytest.raises(StoreError, match="another process is computing this batch"):
        opened(job, store.path, fresh=True)
    run_batch(job.path, store.path)
    assert_equal(store.path, whole)
    assert opened(job, store.path, fresh=True).finished() == set()
    assert sorted(each.name for each in tmp_path.iterdir()) == ["quick.toml", "s.zarr"]


@pytest.mark.parametrize("anew", [False, True])
def test_a_store_that_was_removed_while_its_lock_was_waited_for_is_not_computed(tmp_path, whole, monkeypatch, anew):
    job = read_job(written(tmp_path))
    store, original = opened(job, tmp_path / "s.zarr"), fcntl.flock

    def late(file, how):
        monkeypatch.setattr(fcntl, "flock", original)
        remove(store.path)
        if anew:
            create(store.path, job)
            (store.path / ".qddot" / "lock").write_text("")
        original(file, how)

    monkeypatch.setattr(fcntl, "flock", late)
    with pytest.raises(StoreError, match="another process removed this store; give the same command again"):
        next(computed(job, store))


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"workers": 0}, "--workers 0: expected a number of processes from 1 to"),
        ({"workers": -3}, "--workers -3: expected a number"),
        ({"workers": 10**6}, "--workers 1000000: expected a number of processes from 1 to"),
        ({"workers": 2, "scheduler": "tcp://localhost:1"}, "give one of them"),
        ({"scheduler": "nonsense"}, "--scheduler 'nonsense': expected an address such as tcp://host:8786"),
        ({"scheduler": ""}, "--scheduler '': expected an address"),
        ({"scheduler": "tcp://host"}, "expected an address"),
        ({"scheduler": "tcp://host:port"}, "expected an address"),
        ({"scheduler": "tcp://host:99999"}, "expected an address"),
        ({"scheduler": "foo://host:8786"}, "expected an address"),
        ({"scheduler": "tcp://[::1:8786"}, "expected an address"),
        ({"scheduler": "closed"}, ": no scheduler answers (Connection refused)"),
    ],
)
def test_workers_that_cannot_be_had_are_refused_before_anything_is_computed(tmp_path, given, message):
    with socket.socket() as bound:  # a port at which nobody listens
        bound.bind(("127.0.0.1", 0))
        if given.get("scheduler") == "closed":
            given = {"scheduler": f"tcp://127.0.0.1:{bound.getsockname()[1]}"}
        with pytest.raises(ValueError, match=re.escape(message)):
            run_batch(written(tmp_path), tmp_path / "no.zarr", **given)
    assert not (tmp_path / "no.zarr").exists()


MANY = 10**12


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({"axes": [{"key": "a.b", "range": [0, MANY]}]}, f"{MANY} numbers; 1 to"),
        ({"axes": [{"key": "a.b", "linspace": [0, 1, MANY]}]}, f"a count of {MANY}; expected 1 to"),
        ({"axes": [{"key": "a.b", "logspace": [1, 2, MANY]}]}, f"a count of {MANY}; expected 1 to"),
        ({"axes": [{"key": "a.b", "uniform": [0, 1]}], "samples": MANY}, f"sweep.samples: {MANY}; expected"),
        ({"axes": [{"key": "a.b", "values": []}]}, "values: there are none"),
        (
            {"axes": [{"key": f"a.{name}", "linspace": [0, 1, 10_000]} for name in "bcd"]},
            f"sweep: {MANY} runs; at most 100000000 work",
        ),
    ],
)
def test_sweeps_of_no_runs_or_without_end_are_refused_before_they_take_memory(table, message):
    tracemalloc.start()
    try:
        with pytest.raises(ValueError, match=re.escape(message)):
            sweep_of(SweepTable.model_validate(table))
        assert tracemalloc.get_traced_memory()[1] < 5e6
    finally:
        tracemalloc.stop()


#: Runs that take long enough to be stopped among them.
LONG = STUDY.replace("[0, 0.5]", "[0, 20]").replace("step = 1e-3", "step = 1e-4").replace('"1 ms"', '"10 ms"')


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_a_batch_with_a_word_and_its_number(tmp_path, number, whole):
    study, store = written(tmp_path, LONG.replace('400 kg", 9', '400 kg", 200')), tmp_path / "results" / "quick.zarr"
    line = [sys.executable, "-m", "qddot", "batch", str(study), "--no-figure"]
    process = subprocess.Popen(line, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    while process.poll() is None and not list((store / ".qddot" / "blocks").glob("*.json")):
        time.sleep(0.02)
    process.send_signal(number)
    out, err = process.communicate(timeout=120)
    assert process.returncode == 128 + number, err
    assert "stopping when the blocks that were begun are written; press Ctrl-C again to drop them" in err
    assert " of 800 runs, 0 failed: the same command goes on from there" in out
    assert "Traceback" not in err
    assert 0 < len(Store(store).finished()) < 200
    assert not list(store.rglob("*.partial"))


def test_sigterm_ends_any_command_with_a_word_and_nothing_half_written(tmp_path):
    code = """
import os, signal, sys
from importlib import import_module
from pathlib import Path
from qddot.command_line import main
from qddot.runner.files import written_aside
def half(what):
    with written_aside(Path(sys.argv[2])) as aside:
        aside.write_text("half")
        os.kill(os.getpid(), signal.SIGTERM)
        aside.write_text("whole")
    return 0
listing = import_module("qddot.commands.list")
listing.COMMAND = listing.COMMAND._replace(function=half)
main()
"""
    (tmp_path / "it").write_text("old")
    done = command("list", code=code.replace("sys.argv[2]", repr(str(tmp_path / "it"))))
    assert (done.returncode, done.stderr) == (128 + signal.SIGTERM, "terminated\n")
    assert [each.name for each in tmp_path.iterdir()] == ["it"]
    assert (tmp_path / "it").read_text() == "old"


def test_brackets_in_a_title_are_no_markup(tmp_path, capsys, whole):
    study = written(tmp_path, STUDY.replace("A quick batch", "A [quick] batch [/bold] :smile:"), "brackets")
    path = run_batch(study, tmp_path / "brackets.zarr")
    assert summary(path) == 0
    assert "A [quick] batch [/bold] :smile:" in capsys.readouterr().out


@pytest.mark.slow
def test_the_clock_of_workers_starts_when_they_have_loaded_what_they_need(tmp_path, whole):
    from qddot.runner.batch.cluster import connected

    job, loaded = read_job(written(tmp_path)), []

    def ready():
        name = "qddot.runner.batch.cluster"
        loaded.extend(client.run(lambda: sys.modules[name]._opened.cache_info().currsize).values())

    store = opened(job, tmp_path / "w.zarr")
    with connected(1, None) as client:
        from qddot.runner.batch.cluster import on_workers
        from qddot.runner.batch.stopping import Wish

        for _ in on_workers(job, store, range(job.blocks), Wish(), client, ready):
            pass
    assert loaded == [1]
    assert_equal(store.path, whole)
