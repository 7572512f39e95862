"""The gallery has every shipped model, and its pages are those of the studies and models that are there."""

import importlib.util
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
spec = importlib.util.spec_from_file_location("gallery", ROOT / "docs" / "gallery.py")
gallery = importlib.util.module_from_spec(spec)
spec.loader.exec_module(gallery)
NAMES = gallery.models()


@pytest.mark.parametrize("name", NAMES)
def test_a_page_is_what_its_study_and_model_give(name):
    assert (gallery.INTO / f"{name}.md").read_text() == gallery.page(name), "make gallery"
    for each in (name, f"{name}_scene"):
        picture = (gallery.INTO / f"{each}.png").read_bytes()
        assert picture.startswith(b"\x89PNG") and len(picture) < 130_000


def test_every_model_has_a_page_in_the_gallery_and_in_the_site_and_no_other_has():
    assert len(NAMES) >= 10 and "pendulum" in NAMES and set(gallery.MOMENTS) == set(NAMES)
    assert (gallery.INTO / "index.md").read_text() == gallery.index(NAMES), "make gallery"
    pages = {f"{name}.md" for name in NAMES} | {"index.md"}
    assert {path.name for path in gallery.INTO.glob("*.md")} == pages
    nav = (ROOT / "mkdocs.yml").read_text()
    assert all(f"gallery/{page}" in nav for page in pages)


def test_studies_of_the_gallery_are_shown():
    shown = {gallery.study_of(name) for name in NAMES}
    assert {path for path in (ROOT / "studies" / "gallery").glob("*.toml")} <= shown


def test_a_figure_is_drawn_anew(tmp_path, monkeypatch):
    monkeypatch.setattr(gallery, "INTO", tmp_path)
    gallery.draw("chain")
    for name in ("chain", "chain_scene"):
        assert (tmp_path / f"{name}.png").read_bytes().startswith(b"\x89PNG")
