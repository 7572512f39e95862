"""The equations fit the page, the screen and the terminal, and what an author writes stays text."""

import re
import shutil
import subprocess
from html.parser import HTMLParser

import pytest
from displayed import MODELS, documents
from hypothesis import given
from hypothesis import strategies as st

from qddot.codegen.equations.latex_script import LatexScript
from qddot.codegen.equations.latex_text import escape, unit
from qddot.codegen.equations.layout import Box, beside, joined, lines
from qddot.codegen.equations.page import html
from qddot.codegen.equations.terminal import text
from qddot.codegen.equations.tex import tex
from qddot.codegen.equations.typeset import TypesetError, pdf
from qddot.codegen.equations.typesetter import Typesetter
from qddot.codegen.equations.unicode_script import columns


@pytest.mark.skipif(shutil.which("pdflatex") is None, reason="pdflatex is not installed")
@pytest.mark.parametrize("name", MODELS)
def test_pdflatex_finds_no_overfull_line(name, tmp_path):
    (tmp_path / "a.tex").write_text(tex(documents(name)), "utf-8")
    for _ in range(2):
        subprocess.run(
            ["pdflatex", "-interaction=nonstopmode", "-halt-on-error", "-no-shell-escape", "a.tex"],
            cwd=tmp_path,
            check=True,
            capture_output=True,
        )
    log = (tmp_path / "a.log").read_text("latin-1")
    assert not [line for line in log.splitlines() if line.startswith("Overfull")]


@pytest.mark.skipif(shutil.which("pdflatex") is None, reason="pdflatex is not installed")
def test_estimated_widths_are_upper_bounds_of_what_latex_sets(tmp_path):
    boxes = []
    for document in map(documents, MODELS):
        write = Typesetter(LatexScript(document.dotted))
        for formula in (*document.definitions, *document.energies, *document.motion, *document.output_definitions):
            boxes += write.formula(formula)[:6]
    measured = "\n".join(rf"\setbox0\hbox{{$\displaystyle {{}}{box.text}$}}\typeout{{WIDTH \the\wd0}}" for box in boxes)
    source = rf"\documentclass[10pt]{{article}}\usepackage{{amsmath}}\begin{{document}}{measured}\end{{document}}"
    (tmp_path / "a.tex").write_text(source, "utf-8")
    done = subprocess.run(
        ["pdflatex", "-halt-on-error", "a.tex"], cwd=tmp_path, check=True, capture_output=True, text=True
    )
    widths = [float(width) / 10.0 for width in re.findall(r"WIDTH ([\d.]+)pt", done.stdout)]
    assert len(widths) == len(boxes)
    for box, width in zip(boxes, widths, strict=True):
        assert 0.7 * box.width - 1.0 <= width <= box.width, box.text


@pytest.mark.parametrize("name", MODELS)
@pytest.mark.parametrize("width", [40, 72, 100])
def test_no_line_in_the_terminal_is_wider_than_asked(name, width):
    for line in text(documents(name), width).splitlines():
        assert columns(line) <= width, line


class Balance(HTMLParser):
    """Every element is closed where it should be."""

    VOID = ("meta", "wbr", "link", "br")

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.attributes: list[tuple[str, str | None]] = []

    def handle_starttag(self, tag, attrs) -> None:
        self.attributes += attrs
        assert tag not in ("script", "link", "img", "iframe", "object")
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs) -> None:
        self.attributes += attrs

    def handle_endtag(self, tag) -> None:
        assert self.open.pop() == tag


@pytest.mark.parametrize("name", MODELS)
def test_the_page_is_well_formed_and_fetches_nothing(name):
    page = html(documents(name))
    balance = Balance()
    balance.feed(page)
    assert balance.open == []
    assert not [value for key, value in balance.attributes if key in ("src", "srcset", "style") or key.startswith("on")]
    targets = [value for key, value in balance.attributes if key == "href"]
    assert targets and all(f'id="{target.removeprefix("#")}"' in page for target in targets)
    assert set(re.findall(r"https?://[^\"' ]*", page)) == {"http://www.w3.org/1998/Math/MathML"}
    assert "url(" not in page and "@import" not in page
    assert not re.search(r"\\[a-zA-Z]+", re.sub(r"\\input", "", page)), "LaTeX that MathML does not know"


def test_hostile_text_is_text():
    source, page = tex(documents("crane")), html(documents("crane"))
    assert r"\input" not in source and "%" not in re.sub(r"\\%|^%.*", "", source, flags=re.MULTILINE)
    assert r"50 \% of \textless{}script\textgreater{}" in source
    assert "<script>" not in page and "&lt;script&gt;" in page
    assert r"\input{/etc/passwd}" in page


def test_text_that_latex_cannot_set_is_named_by_its_code_point():
    assert escape("é ß Å 漢") == r"\'{e} \ss{} \r{A} \texttt{U+6F22}"
    assert escape("α_1 → 50%") == r"\ensuremath{\alpha}\_1 \ensuremath{\to} 50\%"
    assert escape("x" * 50).count(r"\allowbreak{}") == 2


def test_units_are_upright_with_raised_powers():
    assert unit("kg m^2") == r"kg\,m\textsuperscript{2}"
    assert unit("N s/m") == r"N\,s/m"
    assert unit("rad s**-1") == r"rad\,s\textsuperscript{\ensuremath{-}1}"
    assert unit("1") == "--"


@given(st.lists(st.integers(1, 12), min_size=1, max_size=20), st.integers(8, 30))
def test_lines_keep_all_terms_in_order_and_stay_within_the_width(widths, width):
    boxes = [Box(f"<{k}" + "x" * (w - 1), float(w)) for k, w in enumerate(widths)]
    broken = lines([joined(boxes)], width, 2.0)
    assert "".join(box.text for line in broken for box in line) == "".join(box.text for box in boxes)
    for k, line in enumerate(broken):
        used = sum(box.width for box in line)
        assert used <= width - (2.0 if k else 0.0) or len(line) == 1


def test_a_term_wider_than_the_line_is_cut_within_its_brackets():
    inner = joined([Box("a", 1.0), Box(" + b", 4.0), Box(" + c", 4.0)])
    box = beside(beside(Box("k·(", 3.0), inner), Box(")²", 2.0))
    assert [[piece.text for piece in line] for line in lines([box], 8.0, 1.0)] == [["k·(a", " + b"], [" + c)²"]]


def test_a_missing_pdflatex_says_what_to_install(monkeypatch, tmp_path):
    monkeypatch.setattr(shutil, "which", lambda _: None)
    with pytest.raises(TypesetError, match="install the packages texlive-latex-base and texlive-latex-recommended"):
        pdf(tmp_path / "a.tex", tmp_path)


@pytest.mark.skipif(shutil.which("pdflatex") is None, reason="pdflatex is not installed")
def test_a_pdf_is_placed_whole_and_a_failure_names_the_line(tmp_path):
    good, bad, into = tmp_path / "good.tex", tmp_path / "bad.tex", tmp_path / "out"
    good.write_text(tex(documents("quarter_car")), "utf-8")
    assert pdf(good, into) == into / "good.pdf"
    assert (into / "good.pdf").read_bytes().startswith(b"%PDF")
    bad.write_text("\\documentclass{article}\n\\begin{document}\n\\nonsense\n\\end{document}\n", "utf-8")
    with pytest.raises(TypesetError, match=r"bad\.tex: Undefined control sequence. \(l\.3 .nonsense\)"):
        pdf(bad, into)
    assert sorted(path.name for path in into.iterdir()) == ["good.pdf"]
