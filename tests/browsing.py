"""Pages looked at: read by their tags, and in a browser where there is one."""

import subprocess
from html.parser import HTMLParser

import pytest

from qddot.report import browser

BROWSER = browser()
#: What a page says when its script is done, and where the script says so.
WORKED, WORKS = 'data-ready="yes"', "dataset.ready"
#: Milliseconds of a page's own time that a browser has for it; a machine under load wants more before it is loaded.
BUDGETS = 5000, 20000, 80000


class Reader(HTMLParser):
    """Collects ids, links, what would be fetched, and whether elements are closed in order."""

    VOID = frozenset(("meta", "link", "img", "input", "br", "hr", "wbr", "path", "circle"))

    def __init__(self):
        super().__init__(convert_charrefs=True)
        self.ids, self.links, self.fetched, self.open, self.crossed = [], [], [], [], []

    def handle_starttag(self, tag, attrs):
        found = dict(attrs)
        self.ids += [found["id"]] if "id" in found else []
        self.links += [found["href"]] if tag == "a" and "href" in found else []
        self.fetched += [found["src"]] if "src" in found else []
        self.fetched += [found["href"]] if tag == "link" else []
        self.open += [] if tag in self.VOID else [tag]

    def handle_startendtag(self, tag, attrs):
        self.handle_starttag(tag, attrs)
        self.open = self.open[:-1] if tag not in self.VOID else self.open

    def handle_endtag(self, tag):
        if tag not in self.VOID and (not self.open or self.open.pop() != tag):
            self.crossed.append(tag)


def browsed(page, place, *options):
    """The document after five seconds in a browser, more where its script is not done, and what its console says."""
    if BROWSER is None:
        pytest.skip("no Chromium here")
    command = [
        BROWSER,
        "--headless",
        "--no-sandbox",
        "--disable-gpu",
        "--enable-logging=stderr",
        "--dump-dom",
        *options,
    ]
    works = WORKS in page.read_text(encoding="utf-8")
    for budget in BUDGETS:
        whole = [*command, f"--virtual-time-budget={budget}", f"file://{page}{place}"]
        done = subprocess.run(whole, capture_output=True, text=True, timeout=120, check=False)
        if WORKED in done.stdout or not works:
            break
    return done.stdout, [line for line in done.stderr.splitlines() if "CONSOLE" in line]
