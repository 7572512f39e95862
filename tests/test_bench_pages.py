"""Pages show what was measured, of what there is now, and nothing in their places is typed in."""

import json
import tomllib
from itertools import chain
from pathlib import Path

import pytest

from benchmarks import __main__ as bench
from benchmarks import batch, pages, single_run
from benchmarks.compare import Measured, read
from benchmarks.timing import Table, Timing

ROOT = Path(__file__).parent.parent
AGAIN = "run `make bench`, then `make bench-pages RESULTS=results/benchmarks.json`"


@pytest.fixture(scope="module")
def measured():
    return read(pages.KEPT)


@pytest.mark.parametrize("page", pages.PAGES, ids=lambda page: page.name)
def test_pages_show_what_was_measured(page, measured):
    text = page.read_text()
    assert pages.places(text)
    assert pages.drawn(text, measured, read(pages.ELSEWHERE)) == text, "run `make bench-pages`"


def test_what_was_measured_is_of_this_version(measured):
    here = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["version"]
    assert measured.versions["qddot"] == here, AGAIN


def test_every_group_was_measured_and_none_failed(measured):
    assert set(measured.groups) == set(bench.GROUPS), AGAIN
    assert not measured.failures


def test_every_method_and_case_of_the_contests_was_measured(measured, tmp_path):
    titles = {
        f"{title}, error {wanted:g}"
        for title, _, wanted in chain(single_run._cases(tmp_path), single_run._large_cases(tmp_path))
    }
    assert {table.title for table in measured.groups["single_run"]} == titles, AGAIN
    told = {row.name for table in measured.groups["single_run"] for row in table.rows}
    assert {f"qddot {name}" for name in single_run.METHODS} <= told, AGAIN
    many = {row.name for table in measured.groups["batch"] for row in table.rows}
    assert {f"qddot {name}" for name in batch.METHODS} <= many, AGAIN


RESULTS = Measured("a machine", {"scipy": "1"}, {"size": "no"}, {
    "single_run": [
        Table("A", (Timing("qddot exact", 1e-3, 2e-3), Timing("other", 4e-3, 4e-3), Timing("third", note="no"))),
        Table("B", (Timing("other", 1e-3, 1e-3), Timing("qddot exact", 2e-6, 2e-6))),
    ],
    "batch": [
        Table("M113, 10000 runs at error 1e-8, 2 s", (Timing("qddot a", 1e-6, 1e-6), Timing("b", 3e-6, 3e-6)), "run"),
    ],
})  # fmt: skip


def test_single_runs_are_a_table_the_quickest_first():
    text = "before\n<!-- measured: single runs -->\nold\n<!-- end -->\nafter"
    assert pages.drawn(text, RESULTS, RESULTS) == (
        "before\n<!-- measured: single runs -->\n| | A | B |\n|---|---:|---:|\n| qddot exact | 1 ms | 2 µs |\n"
        "| other | 4 ms | 1 ms |\n| third | - | - |\n<!-- end -->\nafter"
    )


def test_the_front_page_has_a_line_a_table():
    text = pages.drawn("<!-- measured: front -->\n<!-- end -->", RESULTS, RESULTS)
    assert "- M113, 10000 runs at error 1e-8, 2 s, a run: qddot a 1 µs, b 3 µs.\n" in text


def test_two_machines_stand_side_by_side_where_both_measured_a_case():
    """B is not a contest elsewhere, and the batch was not measured there."""
    elsewhere = Measured("another", {}, {}, {
        "single_run": [
            Table("A", (Timing("third", 9e-3, 9e-3), Timing("qddot rk4", 2e-3, 2e-3), Timing("other", 5e-3, 5e-3))),
            Table("B", (Timing("qddot exact", 1e-3, 1e-3), Timing("other", note="not installed"))),
        ],
    })  # fmt: skip
    text = pages.drawn("<!-- measured: two machines -->\n<!-- end -->", RESULTS, elsewhere)
    assert "A: a machine. B: another." in text
    assert [line for line in text.splitlines() if line.startswith("| ") and "qddot" not in line] == [
        "| A | exact 1 ms | other 4 ms | 4 | rk4 2 ms | other 5 ms | 2.5 |"
    ]


def test_the_machine_and_what_failed_are_told():
    text = pages.drawn("<!-- measured: machine -->\n<!-- end -->", RESULTS, RESULTS)
    assert "a machine; scipy 1. size failed: no." in text


def test_a_place_of_what_was_not_measured_is_named():
    with pytest.raises(ValueError, match="nothing is measured of speed, expected one of machine, single runs, front, "):
        pages.drawn("<!-- measured: speed -->\n<!-- end -->", RESULTS, RESULTS)


def test_results_that_are_none_change_nothing(tmp_path, capsys, monkeypatch):
    kept, page = tmp_path / "speed.json", tmp_path / "page.md"
    page.write_text("<!-- measured: machine -->\nas it was\n<!-- end -->")
    (tmp_path / "new.json").write_text(json.dumps({"machine": 3}))
    monkeypatch.setattr(pages, "KEPT", kept)
    monkeypatch.setattr(pages, "PAGES", (page,))
    assert pages.main([str(tmp_path / "new.json")]) == 2
    assert "expected what `make bench` writes" in capsys.readouterr().err
    assert "as it was" in page.read_text() and not kept.exists()
