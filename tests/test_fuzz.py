"""Thousands of slips in what may be given: each ends soon, in a status and a message, and half-writes nothing."""

import contextlib
import io
import os
import random
import re
import shutil
import sys
import time
import warnings
from itertools import chain
from pathlib import Path
from typing import ClassVar

import pytest
from batches import STUDY as QUICK
from commands import command
from mutations import OF_TEXT, OF_TOML, garbled, mutated

from qddot.codegen.compare import command as comparing
from qddot.command_line import main
from qddot.commands import COMMANDS
from qddot.paper.claims import read as read_claims
from qddot.runner.batch.job import read_job
from qddot.runner.batch.run import run_batch
from qddot.runner.identify.problem import read as read_identification
from qddot.runner.study.toml import LONGEST_FILE

ROOT = Path(__file__).parent.parent
STUDIES = ROOT / "studies"
SEED = 1302
#: The longest that a call may take of a processor, s: others may be using it as well.
LONGEST = 10.0
#: The most runs of a batch that is run here.
MOST_RUNS = 40
#: Kind -> mutations in all; and how many of them a test makes, so that several processes share them.
COUNTS = {
    "run": 720,
    "batch": 320,
    "library": 160,
    "csv": 200,
    "set": 160,
    "reading": 240,
    "equations": 120,
    "store": 120,
}
TOGETHER, PROCESSES = 40, 40
#: Kinds that are tried in processes of their own, and how many calls a test makes.
IN_PROCESSES, EACH = ("run", "csv", "equations", "store"), 10

#: Changes that make shipped studies runs of some milliseconds.
SHORT = {
    "one_shot": {"span = [0.0, 10.0]": "span = [0.0, 0.02]", "times = [1.0]": "times = [0.005]"},
    "terrain_run": {"span = [0.0, 10.0]": "span = [0.0, 0.02]", "times = [5.0]": "times = [0.005]"},
    "burst": {"span = [0.0, 30.0]": "span = [0.0, 0.2]"},
}
TABLE = """\
model = "quarter_car"
span = [0, 0.05]

[integration]
step = "1 ms"

[inputs.z_r]
kind = "table"
file = "road.csv"
time = "t"
value = "height"
interpolation = "linear"
"""
FEW = QUICK.replace("span = [0, 0.5]", "span = [0, 0.1]").replace('"400 kg", 9]', '"400 kg", 3]')
CURVE = "# a road\nt [s], height [mm]\n" + "".join(f"{i / 100:.2f},{(7 * i) % 11 - 5}\n" for i in range(12))


def shortened(name):
    text = (STUDIES / f"{name}.toml").read_text()
    for long, short in SHORT[name].items():
        assert long in text
        text = text.replace(long, short)
    return text


def called(*arguments):
    """The status of a command, what it wrote to stdout and stderr, and the seconds of a processor that it took."""
    out, err, before = io.StringIO(), io.StringIO(), sys.argv
    sys.argv = ["qddot", *map(str, arguments)]
    started = time.process_time()
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            main()
    except SystemExit as ended:
        return ended.code, out.getvalue(), err.getvalue(), time.process_time() - started
    finally:
        sys.argv = before
    raise AssertionError("main() ends by SystemExit")


def files(folder):
    """All that is in a folder, by paths in it."""
    start = len(f"{folder}{os.sep}")
    return {f"{where}{os.sep}{name}"[start:] for where, *those in os.walk(folder) for name in chain(*those)}


def assert_ended_well(status, err, seconds, before, after):
    """A status; a message that is no traceback, one line a mistake; soon; and files that are whole or not there."""
    assert status in (0, 1, 2)
    assert seconds < LONGEST
    assert not re.search(r"\.partial|/\.[^/]*\.[0-9a-f]{8}(/|$)", "\n".join(f"/{name}" for name in after))
    assert "Traceback" not in err
    if status == 2:
        assert after == before
        told = err.splitlines()
        assert sum(bool(re.match(r"(qddot[\w ]*: )?error: ", each)) for each in told) == 1
        assert len(told) <= 24
        assert all(len(each) < 4000 for each in told)


class Place:
    """A folder of its own with what is right in it, of which each call gets something wrong."""

    #: Kinds of which what is right has been tried by this process.
    _tried: ClassVar[set[str]] = set()

    def __init__(self, folder, kind):
        self.folder, self.kind = folder, kind
        (folder / "results").mkdir()
        self.study = folder / "study.toml"
        if kind == "csv":
            self.study.write_text(TABLE)
        if kind == "library":
            (folder / "library").mkdir()
        if kind == "reading":
            shutil.copytree(STUDIES, folder / "studies")
        if kind == "store":
            self.study.write_text(FEW)
            self.store = run_batch(self.study, folder / "wrong.zarr")
            self.right = {each: each.read_bytes() for each in sorted(self.store.rglob("*")) if each.is_file()}
        if kind not in self._tried:
            self._try_what_is_right()
            self._tried.add(kind)

    def _try_what_is_right(self):
        """What is not wrong yet works, and is compiled then."""
        if self.kind in ("run", "set", "library"):
            for name in SHORT:
                self.study.write_text(shortened(name))
                assert called(*self._running())[0] == 0
        elif self.kind == "csv":
            (self.folder / "road.csv").write_text(CURVE)
            assert called(*self._running())[0] == 0
        elif self.kind == "batch":
            self.study.write_text(FEW)
            assert called("batch", self.study, "--no-figure", "--out", self.folder / "batch.zarr")[0] == 0

    def arguments(self, rng):
        """Get something wrong, and what is called then: arguments, None where it could take long and be right."""
        return getattr(self, f"_{self.kind}")(rng)

    def _run(self, rng):
        self.study.write_text(mutated(shortened(rng.choice(list(SHORT))), rng))
        if rng.random() < 0.02:
            return ["show", self.study, "--into", self.folder / "results"]
        return self._running()

    def _running(self):
        row = ["--row", "0"] if "[[sweep" in self.study.read_text() else []
        limit = ["--set", "integration.time_limit=0.5"]
        return ["run", self.study, "--no-figure", "--into", self.folder / "results", *row, *limit]

    def _batch(self, rng):
        self.study.write_text(mutated(FEW, rng))
        out = self.folder / "results" / "batch.zarr"
        shutil.rmtree(out, ignore_errors=True)
        with contextlib.suppress(ValueError, OSError):
            if len(read_job(self.study).sweep) > MOST_RUNS:
                return None
        limit = ["--set", "integration.time_limit=0.5"] if rng.random() < 0.5 else []
        return ["batch", self.study, "--no-figure", "--out", out, *limit]

    def _library(self, rng):
        for name in ("guns", "roads"):
            text = (STUDIES / "library" / f"{name}.toml").read_text()
            (self.folder / "library" / f"{name}.toml").write_text(mutated(text, rng) if rng.random() < 0.6 else text)
        self.study.write_text(shortened(rng.choice([*SHORT])))
        return self._running()

    def _csv(self, rng):
        text = mutated(CURVE, rng, OF_TEXT).encode()
        (self.folder / "road.csv").write_bytes(garbled(text, rng) if rng.random() < 0.2 else text)
        return self._running()

    def _set(self, rng):
        self.study.write_text(shortened("one_shot"))
        settings = rng.choice(["parameters.m_6=11 t", "inputs.F.times=[0.001, 0.002]", "integration.fixed.step=1e-4"])
        setting = mutated(settings, rng, (*OF_TOML, *OF_TEXT)).replace("\0", "")
        return [*self._running(), "--set", setting]

    def _reading(self, rng):
        """Files that take long where they are right: they are called where reading them alone refuses them."""
        kind = rng.choice(["identify", "claims"])
        name = rng.choice(["identify_recoil", "identify_recoil_and_damping"]) if kind == "identify" else "paper"
        for each in ("identify_recoil", "identify_recoil_and_damping", "paper"):
            shutil.copy(STUDIES / "paper" / f"{each}.toml", self.folder / "studies" / "paper")
        path = self.folder / "studies" / "paper" / f"{name}.toml"
        path.write_text(mutated(path.read_text(), rng))
        try:
            (read_identification if kind == "identify" else read_claims)(path)
        except (ValueError, OSError):
            file = [path] if kind == "identify" else ["--claims", path]
            return [kind if kind == "identify" else "paper", *file, "--into", self.folder / "results"]
        return None

    def _equations(self, rng):
        text = (STUDIES / "paper" / "equations_5_to_11.txt").read_text()
        head, *equations = text.split("\n\n")
        path = self.folder / "equations.txt"
        path.write_text(mutated("\n\n".join([head, rng.choice(equations)]), rng, OF_TEXT))
        return ["compare", path]

    def _store(self, rng):
        for path, right in self.right.items():
            if not path.exists() or path.read_bytes() != right:
                path.write_bytes(right)
        for path in rng.sample([*self.right], rng.choice([1, 1, 2, 5])):
            path.write_bytes(garbled(self.right[path], rng))
        other = ["export", self.store, "--to", self.folder / "results" / "rows.csv"]
        return rng.choice([["summary", self.store], ["summary", self.store], other])


PARTS = [(kind, part) for kind, count in COUNTS.items() for part in range(count // TOGETHER)]


def test_there_are_enough():
    assert sum(COUNTS.values()) >= 2000
    assert all(count % TOGETHER == 0 for count in COUNTS.values())


@pytest.fixture(scope="module")
def derived_once():
    """A model is read and derived once for all texts that are compared with it; processes do so each for itself."""
    known = {}

    def once(function):
        def remembered(argument):
            key = function, argument if isinstance(argument, tuple) else id(argument)
            if key not in known:
                known[key] = function(argument), argument
            return known[key][0]

        return remembered

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(comparing, "find", once(comparing.find))
        patch.setattr(comparing, "derive", once(comparing.derive))
        yield


@pytest.mark.usefixtures("derived_once")
@pytest.mark.parametrize(("kind", "part"), PARTS)
def test_slips_end_in_a_status_and_one_message(kind, part, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    place, seed = Place(tmp_path, kind), f"{SEED} {kind} {part}"
    rng = random.Random(seed)
    for number in range(TOGETHER):
        if (arguments := place.arguments(rng)) is None:
            continue
        before = files(tmp_path)
        with told(f"seed {seed!r}, mutation {number}", arguments, place.study):
            status, _, err, seconds = called(*arguments)
            assert_ended_well(status, err, seconds, before, files(tmp_path))


@contextlib.contextmanager
def told(which, arguments, study):
    """Print what it was, where something inside fails."""
    try:
        yield
    except BaseException:
        print(f"{which}: qddot {' '.join(map(str, arguments))}")
        print(study.read_text(errors="replace") if study.exists() else "")
        raise


@pytest.mark.parametrize("kind", [*IN_PROCESSES] * (PROCESSES // len(IN_PROCESSES) // EACH))
def test_processes_end_so_too(kind, tmp_path, monkeypatch, request):
    monkeypatch.chdir(tmp_path)
    place, seed = Place(tmp_path, kind), f"{SEED} {request.node.name}"
    rng = random.Random(seed)
    for number in range(EACH):
        while (arguments := place.arguments(rng)) is None:
            pass
        before = files(tmp_path)
        with told(f"seed {seed!r}, mutation {number}", arguments, place.study):
            done = command(*arguments, cwd=tmp_path, afresh=number == 0)
            assert_ended_well(done.returncode, done.stderr, done.seconds, before, files(tmp_path))


HEAD = 'model = "quarter_car"\nspan = [0, 0.01]\n[integration]\nstep = 1e-3\n'
#: What is as large as a file may be, and takes long to refuse if anything does.
LARGE = {
    "keys": lambda n: "".join(f"k{i}=1\n" for i in range(n // 9)) + HEAD,
    "tables": lambda n: HEAD + "".join(f"[k{i}]\n" for i in range(n // 9)),
    "inputs": lambda n: HEAD + "".join(f"[inputs.k{i}]\nkind='sine'\n" for i in range(n // 26)),
    "axes": lambda n: HEAD + "[[sweep.axes]]\n" * (n // 16),
    "numbers": lambda n: HEAD + f"output_times=[{'1,' * (n // 2 - 60)}]",
    "lists": lambda n: HEAD + f"x=[{('[' * 200 + ']' * 200 + ',') * (n // 401 - 1)}]",
    "a text": lambda n: HEAD + f"title='{'x' * (n - 100)}'",
    "a unit": lambda n: HEAD + f"[parameters]\nm_s='1 {'kg*' * (n // 3 - 60)}kg'",
}


@pytest.mark.parametrize("case", LARGE)
def test_what_is_large_is_refused_soon(case, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    study = tmp_path / "study.toml"
    (tmp_path / "results").mkdir()
    study.write_text(LARGE[case](LONGEST_FILE)[:LONGEST_FILE])
    before = files(tmp_path)
    status, _, err, seconds = called("run", study, "--no-figure", "--row", "0")
    assert status == 2
    assert_ended_well(status, err, seconds, before, files(tmp_path))


@pytest.mark.parametrize(
    ("integration", "message"),
    [
        ("step=1e-13\nevery=1", "points are to be saved, expected at most 100000000; give a larger every"),
        ('method="exact"\nstep=1e-11\n', "1000000000 points are to be saved, expected at most 100000000"),
        (
            'method="dop853"\nrefine=1000000000',
            "refine is 1000000000, expected a whole number, at least 1, at most",
        ),
        ('method="ode15s"\nrefine=9223372036854775807', "refine is 9223372036854775807, expected a whole number"),
    ],
)
def test_more_points_than_can_be_saved_are_refused(integration, message, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "study.toml").write_text(HEAD.replace("step = 1e-3", integration))
    status, _, err, _ = called("run", "study.toml", "--no-figure")
    assert (status, message in err) == (2, True), err


def test_a_machine_without_memory_is_told_in_one_line(monkeypatch):
    def without(**given):
        raise MemoryError("Unable to allocate 5 GiB")

    monkeypatch.setattr("qddot.commands.list.COMMAND", COMMANDS["list"]._replace(function=without))
    status, _, err, _ = called("list")
    assert (status, err) == (2, "error: out of memory: Unable to allocate 5 GiB\n")
