"""The report: one page that needs nothing else, and that works in a browser where there is one."""

import hashlib
import json
import re
import tomllib
from pathlib import Path

import pytest
from browsing import BROWSER, WORKED, Reader, browsed
from commands import command

from qddot.paper.command import PAPER
from qddot.paper.report import report
from qddot.report import Section, print_page, table, write_page

ROOT = Path(__file__).parent.parent
#: Of the file in the package uplot 1.6.32 of npm.
UPLOT = "19c8d4c6ad88929a79f4ae49d6f7161566dfd0ba3d15cc495e974f787eb78f1f"


MAP = {"x": [1.0, 2.0, 3.0], "y": [0.5, 1.0], "z": [[0.0, 1.0, None], [-2.0, 3.0, 4.0]], "low": -4.0, "high": 4.0}
#: As `qddot paper` writes them.
PLOTS = {
    "cost": [
        {"title": "Least times", "name": "cost", "x": "time, ms", "y": "error, %", "unit": "%", "log": "xy"}
        | {"traces": [{"name": "rk4", "x": [0.1, 1.0], "y": [1e-3, 1e-7], "colour": "#000000", "points": True}]}
        | {"marks": [{"y": 0.05, "text": "0.05 %"}]}
    ],
    "phase": [
        {"title": "A map", "name": "phase", "x": "first, s", "y": "interval, s", "traces": []}
        | {"map": MAP | {"diverging": True, "label": "change", "unit": "%"}}
    ],
}


def claims():
    common = {"where": "3.1", "least": None, "most": None, "unit": "mm", "remark": "", "value": 5.0, "computed": 4.9}
    verdicts = ["rests on an assumption", "holds", "holds", "differs"]
    words = ["a <b> & c", "one", "two", "three"]
    return [
        {"name": f"n{k}", "says": says, "verdict": verdict, "rests_on": ["pulse"] if not k else [], **common}
        for k, (says, verdict) in enumerate(zip(words, verdicts, strict=True))
    ]


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    folder = tmp_path_factory.mktemp("report")
    (folder / "claims.json").write_text(json.dumps({"claims": claims(), "plots": PLOTS}))
    done = command("report", "--claims", folder / "claims.json", "--into", folder / "report.html")
    assert done.returncode == 0, done.stderr
    return folder / "report.html"


def placed(document, colour):
    """The path of the first shape of a colour in the scene."""
    return re.search(rf'--paint: var\(--scene-{colour}\);?"[^>]*><path class="\w+" d="([^"]*)"', document)[1]


def test_the_page_is_whole_and_fetches_nothing(page):
    reader = Reader()
    reader.feed(page.read_text())
    assert not reader.crossed
    assert not reader.open
    assert not reader.fetched
    assert len(reader.ids) == len(set(reader.ids))
    assert {link[1:] for link in reader.links if link.startswith("#")} <= set(reader.ids)
    assert not [link for link in reader.links if not link.startswith("#")]
    assert "default-src 'none'" in page.read_text()  # the browser itself refuses any request


def test_the_page_says_what_it_was_given(page):
    text = page.read_text()
    assert "a &lt;b&gt; &amp; c" in text
    assert re.search(r'class="rests"[^>]*>rests on an assumption', text)
    assert text.count("<math") > 50
    for word in ("637", "1.848", "2.012", "barrel end"):
        assert word in text


def test_nothing_in_the_data_ends_the_script(tmp_path):
    plots = [{"name": "</script><b>", "x": "t", "y": "m", "traces": []}]
    sections = [Section("A & B", table(("x",), [("<i>",)]))]
    written = write_page(tmp_path / "page.html", "</title>$x", "me", sections, plots, None).read_text()
    assert "</script><b>" not in written
    assert "&lt;/title&gt;$x" in written
    assert "&lt;i&gt;" in written
    assert "uPlot" not in written  # no plot, no library
    with pytest.raises(ValueError, match="JSON"):
        write_page(tmp_path / "page.html", "t", "me", [], [{"y": float("nan")}], None)


def test_in_a_browser_the_plots_are_there_and_nothing_is_complained_of(page):
    document, console = browsed(page, "")
    assert not console
    assert WORKED in document
    assert document.count('class="u-wrap"') >= 3
    assert len(re.findall(r'class="u-series"', document)) >= 10


READY = "document.documentElement.dataset.ready"


def test_in_a_browser_claims_are_folded_and_those_of_one_verdict_shown(page, chromium):
    chromium.open(f"file://{page}", ready=READY)
    names = chromium.value("[...document.querySelectorAll('[data-verdict]')].map((e) => e.textContent)")
    assert names == ["All 4", "2 hold", "1 rests on an assumption", "1 differs"]
    shown = "[...document.querySelectorAll('.claim')].filter((e) => e.checkVisibility()).map((e) => e.dataset.is)"
    assert len(chromium.value(shown)) == 4
    chromium.value("document.querySelector('[data-verdict=holds]').focus()")
    chromium.press("Enter")
    assert chromium.value(shown) == ["holds", "holds"]
    pressed = "[...document.querySelectorAll('[data-verdict]')].map((e) => e.getAttribute('aria-pressed'))"
    assert chromium.value(pressed) == ["false", "true", "false", "false"]
    assert not chromium.value("document.querySelector('.claim[data-is=holds]').open")
    chromium.value("document.querySelector('.claim[data-is=holds] summary').focus()")
    chromium.press("Enter")
    assert chromium.value("document.querySelector('.claim[data-is=holds]').open")
    assert "−" in chromium.value("document.querySelector('.claim[data-is=holds]').textContent").replace("-", "−")
    assert not chromium.complaints()


def test_in_a_browser_a_map_tells_the_cell_that_is_pointed_at_with_units(page, chromium):
    chromium.open(f"file://{page}", ready=READY)
    place = "[...document.querySelectorAll('[data-plot]')].find((e) => e.querySelector('.bar'))"
    chromium.value(f"{place}.scrollIntoView({{block: 'center', behavior: 'instant'}})")
    box = "(({x, y, width, height}) => [x, y, width, height])"
    x, y, width, height = chromium.value(f"{box}({place}.querySelector('.u-over').getBoundingClientRect())")
    read = f"{place}.querySelector('.key').lastChild.textContent"
    for across, up, told in ((0.5, 0.25, "first 2\xa0s, interval 1\xa0s: change 3\xa0%"), (0.9, 0.9, "change –")):
        chromium.ask("Input.dispatchMouseEvent", type="mouseMoved", x=x + across * width, y=y + up * height)
        chromium.value("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
        assert told in chromium.value(read)
    assert not chromium.complaints()


def test_the_sections_that_the_paper_computed_and_what_was_identified_are_on_the_page(page):
    text = page.read_text()
    heads = re.findall(r"<h2 id=[^>]*>([^<]*)</h2>", text)
    assert heads[:3] == ["The ride", "Claims of the paper", "Shots standing still"]
    assert {"Cost", "When to fire on rough ground", "Identification"} <= set(heads)
    for path in (ROOT / "studies" / "paper" / "identified").glob("*.toml"):
        fit = tomllib.loads(path.read_text())
        impulse = fit["estimates"]["impulse"]
        assert f">{impulse['value']:.4g}<" in text and f">{impulse['standard_error']:.3g}<" in text


def test_in_a_browser_the_vehicle_moves(page, chromium):
    start, later = (browsed(page, place)[0] for place in ("#t=0", "#t=4.9"))
    assert placed(start, "olive") != placed(later, "olive")
    assert ">4.900 s<" in later
    begun = (
        "parseFloat([...document.querySelectorAll('output')].find((e) => e.textContent.endsWith(' s')).textContent) > 0"
    )
    chromium.open(f"file://{page}#play", ready=f"{READY} && {begun}")
    playing = chromium.value("document.documentElement.outerHTML")
    assert not chromium.complaints()
    assert ">Pause<" in playing
    wheels = [re.findall(r'<path class="line" d="([^"]*)"', each)[-1] for each in (start, playing)]
    assert wheels[0] != wheels[1]  # they turn at once; the first metre is level


@pytest.mark.parametrize("dark", [False, True])
@pytest.mark.parametrize("width", [390, 1400])
def test_at_any_width_and_in_any_light_nothing_is_wider_than_the_screen(page, chromium, width, dark):
    chromium.open(f"file://{page}", width, dark=dark, ready=READY)
    assert not chromium.wider_than_its_screen() and not chromium.complaints() and not chromium.asked_for()


def test_without_claims_the_command_says_what_to_do(tmp_path):
    claims, page = tmp_path / "none.json", tmp_path / "r.html"
    done = command("report", "--claims", claims, "--into", page)
    assert done.returncode == 2
    assert "`qddot paper` writes it" in done.stderr


def test_claims_of_another_vehicle_are_not_shown_beside_the_papers(tmp_path):
    claims = tmp_path / "claims.json"
    claims.write_text(json.dumps({"parameter_set": "public_unloaded", "claims": []}))
    with pytest.raises(ValueError, match="judged with the parameter set public_unloaded, but the report shows"):
        report(PAPER, claims, "", tmp_path / "report.html")


def test_the_page_says_that_a_shot_is_about_ten_rounds(page):
    words = page.read_text().split("Shots standing still</h2>")[1].split("</p>")[0]
    assert "605 N s" in words and "about ten rounds" in words


@pytest.mark.skipif(BROWSER is None, reason="no browser is installed")
def test_the_page_is_printed_as_pdf(page, tmp_path):
    printed = print_page(BROWSER, page, tmp_path / "report.pdf").read_bytes()
    assert printed.startswith(b"%PDF") and len(re.findall(rb"/Type\s*/Page\b", printed)) >= 3
    assert [each.name for each in tmp_path.iterdir()] == ["report.pdf"]


def test_a_browser_that_fails_is_named(tmp_path):
    with pytest.raises(OSError, match="false did not print"):
        print_page("/bin/false", tmp_path / "page.html", tmp_path / "report.pdf")
    assert not list(tmp_path.iterdir())


def test_the_plotting_library_is_the_one_named_with_its_licence():
    folder = ROOT / "runner" / "report" / "page" / "uplot"
    library = folder / "uPlot.iife.min.js"
    assert hashlib.sha256(library.read_bytes()).hexdigest() == UPLOT
    assert "(v1.6.32)" in library.read_text().splitlines()[0]
    assert (folder / "LICENSE").read_text().startswith("The MIT License (MIT)")
