"""Batches: every row is the run it says it is, a store can be gone on with and never mixes, failures are rows."""

import json
import shutil
import signal
import threading
from pathlib import Path

import numpy as np
import pyarrow.parquet
import pytest
import xarray
from batches import STUDY, assert_equal, values, written
from commands import command
from scipy.integrate import solve_ivp

import qddot
from qddot.runner.batch.grid import open_batch
from qddot.runner.batch.job import read_job
from qddot.runner.batch.results import Results
from qddot.runner.batch.run import computed, opened, run_batch
from qddot.runner.batch.store import StoreError
from qddot.runner.study.overrides import parsed
from qddot.runner.study.read import StudyError
from qddot.runner.study.rows import row_of

ROOT = Path(__file__).parent.parent


@pytest.fixture(scope="module")
def store(tmp_path_factory):
    folder = tmp_path_factory.mktemp("batch")
    return run_batch(written(folder), folder / "quick.zarr")


@pytest.fixture
def study(tmp_path):
    return written(tmp_path)


def test_a_store_says_what_it_is(store):
    with xarray.open_zarr(store) as data:
        assert data.sizes == {"run": 36, "state": 4, "time": 101}
        assert data["m_s"].attrs["units"] == "kg"
        assert data["height"].attrs["units"] == "cm"
        assert data["travel"].attrs["units"] == "m"
        assert data["dissipated"].attrs["units"] == "J"
        assert "m_s" in data.coords
        assert data["z_s"].dims == ("run", "time")
        assert data.attrs["study"] == STUDY
        assert len(data.attrs["kernel_digest"]) == 64
        assert data.attrs["versions"]["numba"]
        assert data.attrs["seed"] == 0
        assert (data["status"] == 1).all()
        assert np.isfinite(data["travel"]).all()


@pytest.mark.parametrize("row", [0, 17, 35])
def test_a_row_in_lanes_is_the_single_run_with_its_settings_to_rounding(store, study, row):
    single = row_of(study, {"integration.every": 1}, row).run()
    found = values(store)
    assert single.t == pytest.approx(np.linspace(0, 0.5, 501), abs=1e-12)
    assert np.abs(single["z_s"][::5] - found["z_s"][row]).max() < 1e-12 * np.abs(single["z_s"]).max()
    assert single.states[-1] == pytest.approx(found["final_state"][row], rel=1e-9, abs=1e-13)
    assert single.statistics.steps == found["steps"][row]
    assert found["travel"][row] == pytest.approx(np.ptp(single["z_s"]), rel=1e-4)


@pytest.mark.parametrize("method", ["exact", "ode15s"])
def test_a_row_of_a_method_without_lanes_is_the_single_run_to_the_last_bit(tmp_path, method):
    study = written(tmp_path, STUDY.replace('method = "rk4"\nstep = 1e-3', f'method = "{method}"'))
    path = run_batch(study, tmp_path / "a.zarr")
    times = {"integration.output_times": list(np.linspace(0, 0.5, 501))}
    single, found = row_of(study, times, 7).run(), values(path)
    assert np.array_equal(single["z_s"][::5], found["z_s"][7])
    assert np.array_equal(single.states[-1], found["final_state"][7])


def test_a_row_agrees_with_scipy(store):
    found = values(store)
    row = 22
    p = {"m_s": found["m_s"][row]}
    defaults = {each.name: each.default for each in qddot.load("quarter_car").tables.parameters}
    m_u, k_s, k_t, c_s = (defaults[name] for name in ("m_u", "k_s", "k_t", "c_s"))
    height = found["height"][row] / 100

    def rhs(t, x):
        road = height * np.sin(np.pi * (t - 0.05) / 0.1) if 0.05 < t < 0.15 else 0.0
        force = k_s * (x[0] - x[1]) + c_s * (x[2] - x[3])
        gravity = defaults.get("g", 0.0)
        return [x[2], x[3], -force / p["m_s"] - gravity, (force - k_t * (x[1] - road)) / m_u - gravity]

    x = qddot.equilibrium(qddot.load("quarter_car"), {"m_s": p["m_s"]})
    time, expected = found["time"], np.empty(101)
    for t0, t1 in ((0.0, 0.05), (0.05, 0.15), (0.15, 0.5)):
        part = solve_ivp(rhs, (t0, t1), x, method="DOP853", rtol=1e-12, atol=1e-14, dense_output=True)
        inside = (time >= t0) & (time <= t1)
        expected[inside] = part.sol(time[inside])[0]
        x = part.y[:, -1]
    assert np.abs(expected - found["z_s"][row]).max() < 1e-8
    assert np.ptp(expected) > 1e-3


def test_the_energy_dissipated_closes_the_balance(tmp_path):
    """What the road puts in and the car does not hold at the end was dissipated."""
    pulse = STUDY[STUDY.index('kind = "pulse_train"') : STUDY.index("[[sweep")]
    text = STUDY.replace(pulse, 'kind = "sine"\namplitude = 0.02\nfrequency = 3.0\n\n').replace(
        "z_r.peak", "z_r.amplitude"
    )
    text += '\n[metrics.put_in]\nkind = "integral"\nof = "input_power"\n'
    text += "".join(
        f'\n[metrics.{end}_{which}]\nkind = "{end}"\nof = "{which}_energy"\n'
        for end in ("start", "final")
        for which in ("kinetic", "potential")
    )
    found = values(run_batch(written(tmp_path, text), tmp_path / "e.zarr"))
    gained = found["final_kinetic"] + found["final_potential"] - found["start_kinetic"] - found["start_potential"]
    assert found["dissipated"] == pytest.approx(found["put_in"] - gained, rel=1e-3)
    assert (found["dissipated"] > 0).all()


def test_going_on_redoes_nothing_and_gives_the_same_store(store, study, tmp_path):
    path = tmp_path / "s.zarr"
    notes = computed(read_job(study), opened(read_job(study), path))
    for _ in range(3):
        next(notes)
    notes.close()
    before = {each.name: each.stat().st_mtime_ns for each in (path / ".qddot" / "blocks").iterdir()}
    assert 3 <= len(before) < 9
    assert Results(path).status.tolist().count(-1) >= 4
    run_batch(study, path)
    after = {each.name: each.stat().st_mtime_ns for each in (path / ".qddot" / "blocks").iterdir()}
    assert len(after) == 9
    assert before.items() <= after.items()
    assert_equal(path, store)


def test_ctrl_c_ends_a_batch_between_two_blocks(store, study, tmp_path):
    path = tmp_path / "c.zarr"
    job = read_job(study)
    announced = []
    for i, _ in enumerate(computed(job, opened(job, path), announce=announced.append)):
        if i == 1:
            signal.raise_signal(signal.SIGINT)
    finished = len(list((path / ".qddot" / "blocks").iterdir()))
    assert announced == [signal.SIGINT]
    assert 2 <= finished < 9
    run_batch(study, path)
    assert_equal(path, store)


CHANGES = {
    "parameter": ("parameters.m_u=41", "parameters.m_u: not set in the store, 41 in the study"),
    "axis": ("sweep.axes.0.linspace=[200,400,10]", "sweep.axes.0.linspace.2: 9 in the store, 10 in the study"),
    "metric": ("metrics.travel.kind=max", "metrics.travel.kind: 'peak_to_peak' in the store, 'max' in the study"),
    "outputs": ("outputs.every=2", "outputs.every: 5 in the store, 2 in the study"),
    "method": ("integration.method=heun", "integration.method: 'rk4' in the store, 'heun' in the study"),
    "block": ("sweep.block=5", "sweep.block: 4 in the store, 5 in the study"),
}


@pytest.mark.parametrize("case", CHANGES)
def test_a_changed_study_does_not_mix_with_a_store(store, study, case):
    setting, message = CHANGES[case]
    with pytest.raises(StoreError) as refused:
        run_batch(study, store, changes=parsed([setting]))
    assert "is of another batch" in str(refused.value)
    assert message in str(refused.value)


def test_another_title_is_not_another_batch(store, study):
    run_batch(study, store, changes={"title": "Other words"})


def test_a_regenerated_model_does_not_mix_with_a_store(tmp_path):
    module = tmp_path / "mine.py"
    shutil.copy(ROOT / "generated" / "quarter_car.py", module)
    study = written(tmp_path, STUDY.replace('"quarter_car"', '"./mine.py"'))
    path = run_batch(study, tmp_path / "m.zarr")
    module.write_text(module.read_text() + "\n# generated anew\n")
    with pytest.raises(StoreError, match="model quarter_car: its kernels were generated anew"):
        run_batch(study, path)


def test_a_changed_file_of_the_study_does_not_mix_with_a_store(tmp_path):
    road = '[inputs.z_r]\nkind = "table"\nfile = "road.csv"\n'
    text = STUDY.split("[inputs")[0] + road + "[[sweep" + STUDY.split("[[sweep", 1)[1].split("[[sweep")[0]
    text += '[metrics.top]\nkind = "max"\nof = "z_s"\n'
    (tmp_path / "road.csv").write_text("t,z\n0,0\n0.1,0.02\n0.2,0\n")
    study = written(tmp_path, text)
    path = run_batch(study, tmp_path / "f.zarr")
    run_batch(study, path)
    (tmp_path / "road.csv").write_text("t,z\n0,0\n0.1,0.03\n0.2,0\n")
    with pytest.raises(StoreError, match=r"file road\.csv: its content changed"):
        run_batch(study, path)


def test_two_processes_do_not_compute_one_store_at_once(study, tmp_path):
    job = read_job(study)
    store = opened(job, tmp_path / "l.zarr")
    first = computed(job, store)
    next(first)
    with pytest.raises(StoreError, match="another process is computing this batch"):
        next(computed(job, store))
    first.close()


def test_a_folder_that_is_no_store_is_left_alone(study, tmp_path):
    folder = tmp_path / "mine"
    folder.mkdir()
    (folder / "notes.txt").write_text("precious")
    with pytest.raises(StoreError, match="a folder without a store in it"):
        run_batch(study, folder)
    assert (folder / "notes.txt").read_text() == "precious"


FAILING = STUDY.replace('linspace = ["200 kg", "400 kg", 9]', 'values = ["200 kg", "0 kg", "0.0001 kg"]')


def test_a_run_that_fails_is_a_row_with_a_reason(tmp_path):
    path = run_batch(written(tmp_path, FAILING), tmp_path / "fail.zarr")
    found = values(path)
    assert found["status"].tolist() == [1] * 4 + [100] * 4 + [3] * 4
    assert np.isfinite(found["travel"][:4]).all()
    assert np.isnan(found["travel"][4:]).all()
    assert np.isfinite(found["failed_at"][8:]).all()
    failures = {reason: count for count, reason, _ in Results(path).failures()}
    assert failures == {
        "refused: model quarter_car: constant inverse_m_s is inf; zero: m_s": 4,
        "diverged, zdot_s first": 4,
    }


def test_a_study_of_which_no_run_can_start_is_refused(tmp_path):
    text = STUDY + "\n[parameters]\nm_u = 0\n"
    with pytest.raises(StudyError, match=r"constant inverse_m_u is inf; zero: m_u \(run 0 of the sweep: "):
        run_batch(written(tmp_path, text), tmp_path / "none.zarr")
    assert not (tmp_path / "none.zarr").exists()


def test_a_grid_has_a_dimension_for_each_axis(store):
    grid, flat = open_batch(store), values(store)
    assert grid["travel"].dims == ("m_s", "height")
    assert grid["z_s"].dims == ("m_s", "height", "time")
    chosen = grid["travel"].sel(m_s=300.0, height=2.0, method="nearest")
    assert float(chosen) == flat["travel"][(flat["m_s"] == 300) & (flat["height"] == 2)][0]
    assert grid["m_s"].attrs["units"] == "kg"


def test_export_to_csv_and_parquet(store, tmp_path):
    from qddot.runner.batch.export import export

    table = export(Results(store), tmp_path / "rows.csv").read_text().splitlines()
    assert table[0] == "run,m_s [kg],height [cm],status,failed_at [s],travel [m],dissipated [J]"
    assert len(table) == 37
    found = values(store)
    assert float(table[18].split(",")[5]) == found["travel"][17]
    rows = pyarrow.parquet.read_table(export(Results(store), tmp_path / "rows.parquet"))
    assert rows["travel"].to_pylist() == found["travel"].tolist()
    assert rows.schema.field("m_s").metadata == {b"units": b"kg"}
    with pytest.raises(ValueError, match=r"expected a name that ends in \.csv or \.parquet"):
        export(Results(store), tmp_path / "rows.xls")


def test_a_batch_runs_outside_the_main_thread(study, tmp_path, store):
    done = []
    thread = threading.Thread(target=lambda: done.append(run_batch(study, tmp_path / "t.zarr")))
    thread.start()
    thread.join()
    assert_equal(done[0], store)


def test_a_full_disk_leaves_a_store_that_can_be_gone_on_with(store, study, tmp_path, monkeypatch):
    from qddot.runner.batch import store as module

    path, calls = tmp_path / "full.zarr", []

    def full(where, content):
        calls.append(where)
        if len(calls) > 4:
            raise OSError(28, "No space left on device")
        return original(where, content)

    original = module.written_down
    monkeypatch.setattr(module, "written_down", full)
    with pytest.raises(OSError, match="No space left"):
        run_batch(study, path)
    monkeypatch.setattr(module, "written_down", original)
    assert 0 < len(list((path / ".qddot" / "blocks").iterdir())) < 9
    run_batch(study, path)
    assert_equal(path, store)


#: A process that may write files of so many bytes only, as on a disk that is full: a real failing write.
LIMITED = """
import resource, signal, sys
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
sys.argv[0] = "qddot"
import qddot.runner.commands.batch
from qddot.runner.batch import block
from qddot.runner.batch.job import read_job
block.warm_up(read_job(__import__("pathlib").Path(sys.argv[2])))
resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, resource.RLIM_INFINITY))
from qddot.command_line import main
main()
"""


def test_a_write_that_fails_is_told_and_can_be_gone_on_with(tmp_path):
    text = STUDY.replace("every = 5", "every = 1").replace("block = 4", "block = 12")
    study, path = written(tmp_path, text), tmp_path / "limited.zarr"
    done = command("batch", study, "--out", path, code=LIMITED)
    assert done.returncode == 2, done.stderr
    assert "0 of 36 runs are safe: make room and give the same command" in done.stderr
    assert "Traceback" not in done.stderr
    run_batch(study, path)
    assert_equal(path, run_batch(study, tmp_path / "whole.zarr"))


def test_the_commands_of_batches(tmp_path, store):
    study = written(tmp_path)
    done = command("batch", study, "--set", "parameters.m_u=41 kg", cwd=tmp_path, afresh=True)
    assert done.returncode == 0, done.stderr
    for words in ("36 runs in", "runs/s", "steps/s", "36 of 36 runs, 0 failed", "travel", "wrote results/quick.zarr"):
        assert words in done.stdout
    assert (tmp_path / "results" / "quick.png").read_bytes().startswith(b"\x89PNG")
    assert json.loads(values_attribute(tmp_path / "results" / "quick.zarr", "definition"))["parameters"] == {
        "m_u": "41 kg"
    }
    again = command("batch", study, cwd=tmp_path)
    assert again.returncode == 2
    assert "parameters.m_u: '41 kg' in the store, not set in the study" in again.stderr
    single = command("run", study, "--row", "36", "--no-figure", cwd=tmp_path)
    assert "--row 36: the runs of the sweep are 0 to 35" in single.stderr
    summary = command("summary", store, cwd=tmp_path)
    assert "36 of 36 runs, 0 failed" in summary.stdout


def values_attribute(path, name):
    with xarray.open_zarr(path) as data:
        return data.attrs[name]


def test_figures_of_every_kind_are_drawn(store, tmp_path):
    from qddot.runner.report.batch_figures import draw

    results = Results(store)
    kinds = {
        "map": {},
        "line": {"over": ["m_s"], "metrics": ["travel"]},
        "runs": {"runs": [0, 35]},
    }
    for name, chosen in kinds.items():
        assert draw(results, tmp_path / f"{name}.png", **chosen).read_bytes().startswith(b"\x89PNG")
    for wrong, message in (
        ({"metrics": ["travell"]}, "did you mean 'travel'"),
        ({"over": ["m_u"]}, "unknown axis 'm_u'"),
        ({"runs": [36]}, "there is no run 36"),
    ):
        with pytest.raises(ValueError, match=message):
            draw(results, tmp_path / "no.png", **wrong)
    assert not (tmp_path / "no.png").exists()


@pytest.mark.parametrize("name", ["burst", "interval_sweep", "suspension_map", "terrain", "terrain_monte_carlo"])
def test_the_ready_batches_can_be_run(name):
    job = read_job(ROOT / "studies" / f"{name}.toml")
    assert len(job.sweep) == {"burst": 5, "interval_sweep": 251, "terrain": 12}.get(name, len(job.sweep))
    assert job.prepared(len(job.sweep) - 1).simulation.problem.t1 > 1


def test_the_worst_interval_is_that_of_the_slow_mode(tmp_path):
    """The paper: the worst pause between two shots is 1.85 s, 1.07 s is comfortable."""
    study = ROOT / "studies" / "interval_sweep.toml"
    few = {"sweep.axes.0.linspace": [0.5, 3.0, 51], "outputs.keep": []}
    delays = open_batch(run_batch(study, tmp_path / "i.zarr", changes=few))
    assert float(delays["energy_dissipated"].idxmax()) == pytest.approx(1.85, abs=0.05)
    assert float(delays["barrel_rise"].idxmax()) == pytest.approx(1.85, abs=0.15)
    comfortable = delays["barrel_rise"].sel(delay=1.05, method="nearest")
    assert comfortable < 0.3 * delays["barrel_rise"].max()


def test_the_json_schema_knows_every_key(tmp_path):
    done = command("schema", "--into", "s.json", cwd=tmp_path, afresh=True)
    assert done.returncode == 0, done.stderr
    schema = json.loads((tmp_path / "s.json").read_text())
    assert {"sweep", "metrics", "outputs", "road", "inputs"} <= set(schema["properties"])
    assert set(schema["required"]) == {"model", "span"}
    assert "linspace" in schema["$defs"]["AxisTable"]["properties"]
    assert schema["$defs"]["AxisTable"]["additionalProperties"] is False
