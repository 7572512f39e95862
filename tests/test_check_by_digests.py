"""`qddot generate --check` derives nothing where nothing changed, and everything where anything did."""

import sys

import pytest

from qddot import origin
from qddot.codegen import checked, command
from qddot.codegen.command import generate


@pytest.fixture
def derived(monkeypatch):
    """How often models were derived."""
    times, changes = [], command._changes
    monkeypatch.setattr(command, "_changes", lambda *arguments: times.append(1) or changes(*arguments))
    return times


@pytest.fixture
def folder(tmp_path):
    assert generate(("one_axle",), tmp_path, check=False, diff=False) == 0
    return tmp_path


def check(folder, *names):
    return generate(names or ("one_axle",), folder, check=True, diff=False)


def test_what_was_checked_is_not_derived_again(folder, derived, capsys):
    assert check(folder) == check(folder) == check(folder) == 0
    assert len(derived) == 1
    assert len(set(capsys.readouterr().out.splitlines()[-3:])) == 1


@pytest.mark.parametrize("name", ["one_axle.py", "one_axle.tex"])
def test_an_edited_file_is_stale_every_time_and_right_again_when_it_is_put_back(folder, derived, name):
    check(folder)
    whole = (folder / name).read_text()
    (folder / name).write_text(whole + "\n")
    assert check(folder) == check(folder) == 1
    (folder / name).write_text(whole)
    assert check(folder) == 0
    assert len(derived) == 3


@pytest.mark.parametrize("what", ["generator", "library", "Python", "model"])
def test_another_generator_library_or_model_is_derived_with(folder, derived, monkeypatch, what):
    check(folder)
    if what == "generator":
        monkeypatch.setattr(origin, "generator", lambda: "another")
    elif what == "library":
        version = checked.version
        monkeypatch.setattr(checked, "version", lambda name: "0" if name == "symengine" else version(name))
    elif what == "Python":
        monkeypatch.setattr(sys, "version", "4")
    else:
        monkeypatch.setattr(origin, "sources", lambda file: {file: "edited"})
    check(folder)
    assert len(derived) == 2


def test_what_was_seen_of_one_model_says_nothing_of_two(folder, derived):
    check(folder)
    assert check(folder, "one_axle", "quarter_car") == 1
    assert len(derived) == 2


def test_a_model_of_ones_own_is_derived_every_time(tmp_path, derived):
    """Its program may read what it likes."""
    own = tmp_path / "own.py"
    own.write_text((origin.model_file("one_axle")).read_text())
    generate((str(own),), tmp_path / "into", check=False, diff=False)
    del derived[:]
    assert check(tmp_path / "into", str(own)) == check(tmp_path / "into", str(own)) == 0
    assert len(derived) == 2


def test_a_folder_that_cannot_be_written_is_checked_all_the_same(folder, derived):
    (folder / ".qddot").write_text("in the way")
    assert check(folder) == check(folder) == 0
    assert len(derived) == 2


def test_bad_names_are_refused_as_before(folder):
    with pytest.raises(ValueError, match="there is no model 'one_axl'"):
        check(folder, "one_axl")
