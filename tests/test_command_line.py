"""The command line, used as a person uses it."""

import inspect
import subprocess
import sys
from functools import partial
from importlib import import_module
from pathlib import Path

import pytest
import xarray
from commands import command
from study_files import slip

from qddot.command_line import parser
from qddot.commands import COMMANDS

ROOT = Path(__file__).parent.parent


def test_one_shot_writes_a_data_set_a_figure_and_a_summary(tmp_path):
    done = command("run", ROOT / "studies" / "one_shot.toml", cwd=tmp_path, afresh=True)
    assert done.returncode == 0, done.stderr
    data = xarray.open_dataset(tmp_path / "results" / "one_shot.nc")
    assert (tmp_path / "results" / "one_shot.png").read_bytes().startswith(b"\x89PNG")
    assert "wrote results/one_shot.nc" in done.stdout
    assert "wrote results/one_shot.png" in done.stdout
    assert "barrel_end" in done.stdout
    hull = (data["heave"] - data["heave"][0]).to_numpy()
    barrel = (data["barrel_end"] - data["barrel_end"][0]).to_numpy()
    assert 1e3 * hull.max() == pytest.approx(5, abs=0.5)  # Fig. 6: about 5 mm
    assert 1e3 * barrel.max() == pytest.approx(19, abs=0.5)  # Fig. 7: 19 mm
    before = data["time"].to_numpy() < 1.0
    assert abs(hull[before]).max() < 1e-9  # it stands still until it fires
    assert data["heave"].units == "m"
    assert data["heave"].long_name == "heave of the hull"
    assert data.attrs["model"] == "m113"


def test_a_run_that_diverges_says_so_keeps_what_it_has_and_exits_with_1(tmp_path):
    text = (ROOT / "studies" / "one_shot.toml").read_text()
    study = tmp_path / "coarse.toml"
    for right, coarse in (('method = "rk4"', 'method = "euler"'), ("step = 1e-4", "step = 0.02"), ("20 #", "1 #")):
        text = slip(text, right, coarse)
    study.write_text(text)
    done = command("run", study, cwd=tmp_path)
    assert done.returncode == 1
    assert "diverged" in done.stderr
    assert "try a smaller step" in done.stderr
    assert (tmp_path / "results" / "coarse.nc").exists()
    assert "Traceback" not in done.stderr


def test_an_unknown_name_in_the_figure_is_named(tmp_path):
    text = (ROOT / "studies" / "one_shot.toml").read_text().replace('["pitch"],', '["picth"],')
    (tmp_path / "study.toml").write_text(text)
    done = command("run", "study.toml", cwd=tmp_path)
    assert done.returncode == 2
    assert "study.toml: figure: unknown quantity 'picth'; did you mean 'pitch'?" in done.stderr


def test_lists():
    done = command("list")
    assert done.returncode == 0
    for word in ("m113", "chain", "studies/one_shot.toml", "gun_30mm", "frozen_plough", "rk4", "heun"):
        assert word in done.stdout
    wrong = command("list", "model")
    assert wrong.returncode == 2
    assert "did you mean 'models'?" in wrong.stderr


def test_show_gives_the_papers_periods():
    done = command("show", "m113")
    assert done.returncode == 0, done.stderr
    for period in ("1.848", "1.081", "2.012", "1.115"):
        assert period in done.stdout


def test_show_of_a_study_prints_and_draws_its_inputs(tmp_path):
    done = command("show", ROOT / "studies" / "terrain_run.toml", "--into", tmp_path)
    assert done.returncode == 0, done.stderr
    assert "road: iso8608, read from -2.98 m to 55.22 m; Gd(n0) = 0.0259 m^3, class F" in done.stdout
    assert (tmp_path / "terrain_run_inputs.png").exists()


def test_show_of_a_model_without_an_isolated_equilibrium_says_so():
    done = command("show", "cart_pole")
    assert done.returncode == 0
    assert "No modes" in done.stdout


def test_equations_are_printed_and_written(tmp_path):
    done = command("equations", "quarter_car", "--into", tmp_path, afresh=True)
    assert done.returncode == 0, done.stderr
    assert "z̈" in done.stdout
    assert "<math" in (tmp_path / "quarter_car.html").read_text()
    assert r"\ddot{z}_{s}" in (tmp_path / "quarter_car.tex").read_text()


@pytest.mark.parametrize(
    "arguments", [["run", "none.toml"], ["show", "m13"], ["show", "none.toml"], ["run", "/"], ["equations", "m13"]]
)
def test_bad_arguments_end_in_one_message(tmp_path, arguments):
    done = command(*arguments, cwd=tmp_path)
    assert done.returncode == 2
    assert done.stderr.startswith("error: ")
    assert "Traceback" not in done.stderr


NEEDED = {
    **{name: ["name"] for name in ("compare", "run", "identify", "batch", "show", "summary", "plot", "new")},
    "export": ["name", "--to", "table.csv"],
}


@pytest.mark.parametrize("name", COMMANDS)
def test_a_command_gives_its_function_what_it_takes(name):
    given = vars(parser().parse_args([name, *NEEDED.get(name, [])]))
    assert given.pop("command") == name
    function = COMMANDS[name].function
    if isinstance(function, partial):
        room, function_name = function.args
        function = getattr(import_module(room), function_name)
    inspect.signature(function).bind(**given)  # a TypeError where they differ


def test_words_repeated_and_switched_off_arrive():
    given = vars(parser().parse_args(["run", "a.toml", "--set", "x=1", "--set", "y=2", "--no-figure", "--row", "3"]))
    assert given["settings"] == ["x=1", "y=2"]
    assert given["figure"] is False
    assert given["row"] == 3
    assert vars(parser().parse_args(["run", "a.toml"]))["settings"] == []
    assert vars(parser().parse_args(["compare", "a.txt", "--json"]))["form"] == "json"
    assert vars(parser().parse_args(["compare", "a.txt"]))["form"] == "text"


def test_a_mistyped_command_or_option_is_refused_and_no_command_shows_the_help():
    wrong = {"rn": "'rn'", "run a.toml --int x": "'--int'", "run": "STUDY", "run a.toml --row x": "'x'"}
    for arguments, named in wrong.items():
        done = command(*arguments.split())
        assert done.returncode == 2
        assert "usage: qddot" in done.stderr
        assert named in done.stderr
    assert "Run a study once" in command().stdout


def test_output_that_nobody_reads_any_more_is_no_error():
    line = [sys.executable, "-m", "qddot", "schema"]
    with subprocess.Popen(line, stdout=subprocess.PIPE, stderr=subprocess.PIPE, cwd=ROOT) as process:
        process.stdout.close()
        assert process.stderr.read() == b""
    assert process.returncode == 1
