"""`qddot new` writes what runs; a study may name a model's own file, and needs no step between."""

import pytest
from commands import command
from netCDF4 import Dataset

import qddot
from qddot.codegen.new import new
from qddot.model.system import ModelError


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("mine")
    made = command("new", "bouncer", cwd=folder, afresh=True)
    assert made.returncode == 0, made.stderr
    assert made.stdout.endswith("next: qddot equations bouncer.py\n      qddot run bouncer.toml\n")
    return folder


def test_the_new_study_runs_as_it_is_and_rests_on_its_spring(folder):
    ran = command("run", "bouncer.toml", "--no-figure", cwd=folder)
    assert ran.returncode == 0, ran.stderr
    assert "note: generating kernels of bouncer.py" in ran.stderr
    with Dataset(folder / "results" / "bouncer.nc") as file:
        assert file["x"][0] == pytest.approx(-10 * 9.81 / 4000, rel=1e-12)
        assert {"acceleration", "ground_force"} <= set(file.variables)
    assert not (folder / "generated").exists()


def test_a_second_run_generates_nothing_and_an_edit_is_seen(folder):
    command("run", "bouncer.toml", "--no-figure", cwd=folder)
    again = command("run", "bouncer.toml", "--no-figure", cwd=folder)
    assert "note:" not in again.stderr
    model = folder / "bouncer.py"
    text = model.read_text()
    model.write_text(text.replace('Parameter(m, 10.0, "kg"', 'Parameter(m, 20.0, "kg"'))
    edited = command("run", "bouncer.toml", "--no-figure", cwd=folder)
    model.write_text(text)
    assert "note: generating kernels of bouncer.py" in edited.stderr
    with Dataset(folder / "results" / "bouncer.nc") as file:
        assert file["x"][0] == pytest.approx(-20 * 9.81 / 4000, rel=1e-12)


def test_a_slip_in_the_model_is_named_where_the_study_runs(folder):
    model = folder / "bouncer.py"
    text = model.read_text()
    model.write_text(text.replace("HALF * m * xdot**2", "HALF * mm * xdot**2"))
    ran = command("run", "bouncer.toml", cwd=folder)
    model.write_text(text)
    assert ran.returncode == 2
    assert "Traceback" not in ran.stderr
    assert "bouncer.py" in ran.stderr.splitlines()[-1]


def test_a_batch_that_was_begun_refuses_an_edited_model(folder):
    study = (folder / "bouncer.toml").read_text()
    sweep = '[[sweep.axes]]\nkey = "parameters.c"\nvalues = [20, 40]\n'
    sweep += '[metrics.shaking]\nkind = "rms"\nof = "acceleration"\n'
    (folder / "swept.toml").write_text(study + sweep)
    assert command("batch", "swept.toml", "--no-figure", cwd=folder).returncode == 0
    model = folder / "bouncer.py"
    text = model.read_text()
    model.write_text(text.replace('Parameter(m, 10.0, "kg"', 'Parameter(m, 30.0, "kg"'))
    refused = command("batch", "swept.toml", "--no-figure", cwd=folder)
    model.write_text(text)
    assert refused.returncode == 2
    assert "--keep-kernels" in refused.stderr and "--fresh" in refused.stderr


@pytest.mark.parametrize("name", ["2wheels", "class", "a/b", "math", "x" * 101])
def test_a_name_that_no_model_can_have_is_refused(name, tmp_path):
    with pytest.raises(ModelError, match="choose another name"):
        new(name, tmp_path)
    assert not list(tmp_path.iterdir())


def test_nothing_is_replaced(tmp_path):
    (tmp_path / "mine.toml").write_text("kept")
    with pytest.raises(ModelError, match=r"mine\.toml is there, and is not replaced"):
        new("mine", tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["mine.toml"]


def test_a_program_is_told_to_generate_first(folder):
    with pytest.raises(qddot.LoadError, match="defines a model, and is no generated module"):
        qddot.load(folder / "bouncer.py")
