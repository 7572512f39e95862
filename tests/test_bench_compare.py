"""`make bench-compare A.json B.json`: rows beside each other, what changed, what is missing, what is no result."""

import json
import math
import subprocess
from pathlib import Path

import pytest

from benchmarks.compare import main, read, report
from benchmarks.report import write
from benchmarks.timing import Table, Timing

ROOT = Path(__file__).parent.parent
EMPTY = {"machine": "x", "versions": {}, "failures": {}, "groups": {}}


def results(folder, *tables, **failures):
    folder.mkdir()
    return write({"single_run": tables}, failures, folder)[0]


@pytest.fixture
def files(tmp_path):
    """B is slower in rk4, faster in vern7, alike in exact, undecided in tsit5; heyoka takes part in A alone."""
    a = Table("M113", (
        Timing("rk4", 1.0, 1.1), Timing("vern7", 2e-3, 2.2e-3, "tolerance 1e-07", 1e-9), Timing("exact", 1e-4, 1e-4),
        Timing("tsit5", 1.0, 1.0), Timing("heyoka", 1.0, 1.0),
    ))  # fmt: skip
    b = Table("M113", (
        Timing("rk4", 1.5, 1.65), Timing("vern7", 1e-3, 1.1e-3), Timing("exact", 1.02e-4, 1.04e-4),
        Timing("tsit5", 1.2, 0.9), Timing("heyoka", note="does not take part: ImportError"), Timing("CyRK", 1.0, 1.0),
    ))  # fmt: skip
    return results(tmp_path / "a", a, Table("chain", (Timing("rk4", 1.0, 1.0),))), results(
        tmp_path / "b", b, batch="no"
    )


def test_rows_stand_beside_each_other_with_their_ratios(files):
    said = report(*map(read, files))
    assert "| rk4 | 1.5 | 1.5 | 1 s | 1.5 s | slower |" in said
    assert "| vern7 | 0.5 | 0.5 | 2 ms | 1 ms | faster |" in said
    assert "| exact | 1.02 | 1.04 | 100 µs | 102 µs |  |" in said
    assert "| tsit5 | 1.2 | 0.9 | 1 s | 1.2 s |  |" in said
    assert "| heyoka |  |  | 1 s | does not take part: ImportError |  |" in said
    assert "1 row slower in B by more than 5%\n- single_run: M113: rk4, 1.5\n1 row faster" in said


def test_what_only_one_has_is_named(files):
    said = report(*map(read, files)).splitlines()
    assert "in A alone: single_run: chain" in said
    assert "in B alone: single_run: M113: CyRK" in said
    assert "failed in B: batch: no" in said


def test_a_file_is_alike_to_itself(files):
    said = report(read(files[0]), read(files[0]))
    assert "0 rows slower in B by more than 5%\n0 rows faster" in said
    assert "alone" not in said


def test_times_that_are_missing_are_no_numbers(files):
    heyoka = read(files[1]).groups["single_run"][0].rows[4]
    assert math.isnan(heyoka.least)
    assert heyoka.error is None


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (None, "No such file or directory; expected what `make bench` writes to results/benchmarks.json"),
        ("{", "is no JSON"),
        ("[]", "expected what `make bench` writes"),
        ('{"machine": "x"}', "versions: "),
        (
            '{"machine": "x", "versions": {}, "failures": {}, "groups": {"a": [{"title": "b", "rows": 1}]}}',
            "groups.a.0.rows",
        ),
    ],
)
def test_a_file_that_holds_no_results_is_refused(files, tmp_path, text, said, capsys):
    wrong = tmp_path / "wrong.json"
    if text is not None:
        wrong.write_text(text)
    assert main([str(files[0]), str(wrong)]) == 2
    error = capsys.readouterr().err
    assert error.startswith(str(wrong))
    assert said in error
    assert len(error.splitlines()) == 1


def test_make_takes_two_files(files):
    done = subprocess.run(["make", "bench-compare", *files], cwd=ROOT, capture_output=True, text=True, check=True)
    assert "| rk4 | 1.5 | 1.5 | 1 s | 1.5 s | slower |" in done.stdout
    done = subprocess.run(["make", "bench-compare", files[0]], cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode != 0
    assert "found 1 file, expected two: make bench-compare A.json B.json" in done.stderr


def test_results_are_written_as_they_are_read(files):
    written = json.loads(files[0].read_text())
    assert read(files[0]).machine == written["machine"]
    assert [row.name for row in read(files[0]).groups["single_run"][0].rows][:2] == ["rk4", "vern7"]
