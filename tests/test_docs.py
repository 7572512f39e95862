"""What README and docs/ tell people to type works, and gives what they show."""

import os
import re
import subprocess
import sys
from urllib.parse import unquote

import numpy as np
import pytest
from browsing import Reader
from commands import command
from netCDF4 import Dataset
from pages import PAGES, ROOT, TEXT, block
from scipy.integrate import solve_ivp


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("own")
    (folder / "duffing.py").write_text(block("duffing.py", "python"))
    (folder / "shaken.toml").write_text(block("shaken.toml", "toml"))
    done = command("generate", "duffing.py", "--into", "kernels", cwd=folder)
    assert done.returncode == 0, done.stderr
    return folder


def test_the_model_of_ones_own_runs_and_agrees_with_scipy(folder):
    done = command("run", "shaken.toml", cwd=folder)
    assert done.returncode == 0, done.stderr
    with Dataset(folder / "results" / "shaken.nc") as file:
        t, x = file["time"][:], file["x"][:]
    m, k, k_3, c = 2.5, 400.0, 4e4, 1.5

    def rhs(time, state):
        s = state[0] - 0.02 * np.sin(5 * np.pi * time)
        sdot = state[1] - 0.02 * 5 * np.pi * np.cos(5 * np.pi * time)
        return [state[1], -(k * s + k_3 * s**3 + c * sdot) / m]

    expected = solve_ivp(rhs, (0, 5), [0, 0], method="DOP853", rtol=1e-11, atol=1e-13, t_eval=t[t <= 5])
    assert np.abs(x[t <= 5] - expected.y[0]).max() < 1e-6


def test_the_slips_give_the_messages_shown(folder):
    study = (folder / "shaken.toml").read_text()
    model = (folder / "duffing.py").read_text()
    (folder / "slip").mkdir(exist_ok=True)
    (folder / "slip" / "duffing.py").write_text(model.replace("k_3 * s**4", 'Symbol("k_33") * s**4'))
    (folder / "unit.toml").write_text(study.replace("2500 g", "2500 mm"))
    (folder / "coarse.toml").write_text(study.replace('"rk4"', '"euler"').replace("1 ms", "50 ms"))
    found = [
        command("generate", "duffing.py", "--into", "kernels", cwd=folder / "slip").stderr,
        command("run", "unit.toml", cwd=folder).stderr.replace("unit.toml", "shaken.toml"),
        command("run", "coarse.toml", cwd=folder).stderr,
    ]
    shown = " ".join(TEXT.split())
    for told in found:
        message = "\n".join(line for line in told.splitlines() if not line.startswith("compiling, once"))
        assert message.startswith("error: ")
        assert " ".join(message.split()) in shown


def test_the_commands_shown_exist():
    targets = set(re.findall(r"^([a-z]+):", (ROOT / "Makefile").read_text(), re.MULTILINE))
    code = " ".join(re.findall(r"```.*?```|`[^`\n]*`", TEXT, re.DOTALL))
    assert set(re.findall(r"\bmake ([a-z]+)", code)) <= targets


def test_the_python_shown_is_the_public_interface():
    import qddot as front

    for name in set(re.findall(r"\bqddot\.([A-Za-z_]+)", TEXT)) - {"py", "model", "runner"}:  # rooms
        assert name in front.__all__, name


@pytest.mark.parametrize("page", PAGES)
def test_every_file_and_heading_linked_is_there(page):
    for target in re.findall(r"\]\(([^)]+)\)", PAGES[page]):
        if target.startswith("http"):
            continue
        file, _, heading = target.partition("#")
        path = (ROOT / page).parent / file if file else ROOT / page
        assert path.exists(), target
        assert not heading or heading in _anchors(path.read_text()), target


def _anchors(text):
    """The anchors of a page's headings, as GitHub and MkDocs make them."""
    headings = re.findall(r"^#+ (.+)$", re.sub(r"```.*?```", "", text, flags=re.DOTALL), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


def test_the_front_page_is_short():
    assert len(PAGES["README.md"].splitlines()) <= 150


def test_the_front_page_shows_what_its_example_prints(tmp_path):
    for name, language in (("duffing.py", "python"), ("shaken.toml", "toml")):
        (tmp_path / name).write_text(block(name, language))
    printed = ""
    for line in ("qddot generate duffing.py --into kernels", "qddot run shaken.toml"):
        printed += f"$ {line}\n" + command(*line.split()[1:], cwd=tmp_path).stdout
    times = re.compile(r"points, .*")
    assert times.sub("points", printed) == times.sub("points", block("shaken"))


def test_the_generated_kernel_shown_is_the_one_checked_in():
    kernel = TEXT.split("```python\n@njit")[1].split("```")[0]
    assert "@njit" + kernel.rstrip() in (ROOT / "generated" / "quarter_car.py").read_text()


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """The folder of the built site."""
    pytest.importorskip("mkdocs", reason="the site needs the extra `docs`")
    folder = tmp_path_factory.mktemp("site")
    build = [sys.executable, "-m", "mkdocs", "build", "--quiet", "--site-dir", str(folder)]
    environment = {**os.environ, "NO_MKDOCS_2_WARNING": "1"}
    done = subprocess.run(build, capture_output=True, text=True, cwd=ROOT, env=environment, timeout=300, check=False)
    assert done.returncode == 0, done.stderr
    return folder


def test_the_site_builds_without_a_warning_and_asks_nobody(site):
    pages = {path.relative_to(site).as_posix(): path.read_text() for path in site.rglob("*.html")}
    written = {page.removeprefix("docs/").replace(".md", ".html") for page in PAGES if page.startswith("docs/")}
    assert written <= pages.keys()
    for name, page in pages.items():
        assert not re.findall(r"<(?:script|link|img|iframe)[^>]*(?:src|href)=[\"']?(?:https?:)?//", page), name
    import qddot as front

    missing = [name for name in front.__all__ if f'id="qddot.{name}"' not in pages["reference.html"]]
    assert not missing, missing


def test_every_link_of_the_site_leads_to_a_page_and_a_place_of_it(site):
    pages = {}
    for path in site.rglob("*.html"):
        pages[path] = reader = Reader()
        reader.feed(path.read_text())
    broken = []
    for path, reader in pages.items():
        for link in filter(None, reader.links):
            file, _, anchor = unquote(link).partition("#")
            if re.match(r"[a-z]+:", file) or path.name == "404.html":
                continue
            target = (path.parent / file).resolve() if file else path
            there = target.is_file() and (not anchor or target not in pages or anchor in pages[target].ids)
            broken += [] if there or anchor == "__codelineno" else [(path.name, link)]
    assert len(pages) > 30 and not broken, broken[:10]


@pytest.mark.parametrize("dark", [False, True])
@pytest.mark.parametrize("width", [390, 1400])
def test_in_a_browser_the_site_is_quiet_asks_nobody_and_is_no_wider_than_its_screen(site, chromium, width, dark):
    for name in ("index.html", "tutorial.html", "methods.html", "reference.html", "gallery/m113.html"):
        chromium.open(f"file://{site / name}", width, dark=dark)
        assert not chromium.complaints() and not chromium.asked_for(), name
        assert not chromium.wider_than_its_screen(), name
        assert chromium.first_paint() < 1.0, name
        scheme = chromium.value("document.body.dataset.mdColorScheme")
        assert scheme == ("slate" if dark else "default"), name


def test_with_the_keyboard_one_comes_past_the_head_of_a_page(site, chromium):
    chromium.open(f"file://{site / 'tutorial.html'}")
    chromium.press("Tab")
    assert chromium.value("document.activeElement.textContent.trim()") == "Skip to content"
    chromium.press("Enter")
    assert chromium.value("location.hash").startswith("#ten-minute")
