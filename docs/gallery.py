"""For `make gallery`: a page with a figure for each shipped model, from its study, below docs/gallery/.

The pages are kept with the sources: they are small, are read where the sources are, and building the site integrates
nothing. What a page was made from is in its last line; a test compares.
"""

import hashlib
from pathlib import Path

import qddot
from qddot.report import written_aside

ROOT = Path(__file__).parent.parent
INTO = ROOT / "docs" / "gallery"
STUDIES = ROOT / "studies"
#: Models of which a ready study is shown that is not called by their name.
READY = {"m113": "terrain_run.toml"}
#: The time, s, at which a model's scene is shown.
MOMENTS = {
    "cart_pole": 1.4,
    "chain": 0.7,
    "double_pendulum": 1.2,
    "four_bar": 3.63,
    "half_car": 0.62,
    "m113": 5.06,
    "one_axle": 0.25,
    "pendulum": 2.0,
    "quarter_car": 3.0,
    "recoil_damper": 0.004,
}


def models() -> list[str]:
    """The names of the models that come with qddot."""
    return sorted(path.stem for path in (ROOT / "model").glob("*.py") if "\ndef system(" in path.read_text("utf-8"))


def study_of(model: str) -> Path:
    """The study that shows a model: one of the gallery's own, or a ready one."""
    own = STUDIES / "gallery" / f"{model}.toml"
    return own if own.is_file() else STUDIES / READY.get(model, f"{model}.toml")


def made_from(model: str) -> str:
    """The digest of a model and its study."""
    texts = (path.read_bytes().replace(b"\r\n", b"\n") for path in (ROOT / "model" / f"{model}.py", study_of(model)))
    return hashlib.sha256(b"\0".join(texts)).hexdigest()[:16]


def page(model: str) -> str:
    """The page of a model: what is seen, the figure, and the study."""
    path = study_of(model)
    text, place = path.read_text("utf-8"), path.relative_to(ROOT).as_posix()
    lines = text.splitlines()
    count = next(k for k, line in enumerate(lines) if not line.startswith("#"))
    said = " ".join(line.lstrip("# ") for line in lines[:count])
    study = qddot.read_study(path)
    return f"""# {study.model.tables.title}

{said}

![The model at {MOMENTS[model]:g} s]({model}_scene.png)

![{study.tables.title}]({model}.png)

```
qddot run {place}
qddot report {place}
qddot equations {model}
```

The study:

```toml
{chr(10).join(lines[count:])}
```

<!-- made from {made_from(model)} -->
"""


def index(names: list[str]) -> str:
    """The page of all pictures."""
    shown = "\n\n".join(
        f"## [{qddot.load(name).tables.title}]({name}.md)\n\n[![{name}]({name}_scene.png)]({name}.md)" for name in names
    )
    return f"# Gallery\n\nA study of every model that comes with qddot; `make gallery` makes the pages.\n\n{shown}\n"


def draw(model: str) -> None:
    """Run the study of a model and draw it as `qddot run` does, and a moment of its scene."""
    study = qddot.read_study(study_of(model))
    figure = study.tables.figure
    run = study.run()
    curves = run.plot(*figure.panels, from_start=figure.from_start, title=study.tables.title)
    for drawn, name in ((curves, model), (run.scene(MOMENTS[model]), f"{model}_scene")):
        with written_aside(INTO / f"{name}.png") as aside:
            drawn.savefig(aside, format="png", dpi=80, pil_kwargs={"optimize": True})


def main() -> None:
    """Write all pages and figures."""
    INTO.mkdir(exist_ok=True)
    names = models()
    for name in names:
        draw(name)
        (INTO / f"{name}.md").write_text(page(name), encoding="utf-8")
        print(f"wrote docs/gallery/{name}.md and its figures", flush=True)
    (INTO / "index.md").write_text(index(names), encoding="utf-8")


if __name__ == "__main__":
    main()
