"""`qddot schema`: the JSON Schema of studies; editors check and complete TOML files with it."""

import json
from pathlib import Path
from typing import Any

from qddot.runner.files import written_aside
from qddot.runner.study.schema import StudyTable


def json_schema() -> dict[str, Any]:
    """The schema (JSON Schema 2020-12) of a study's tables."""
    found = StudyTable.model_json_schema()
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **found, "title": "A study of qddot"}


def schema(path: Path | None) -> int:
    """Print the schema, or write it to a file."""
    text = json.dumps(json_schema(), indent=2, ensure_ascii=False)
    if path is None:
        print(text)
        return 0
    with written_aside(path) as aside:
        aside.write_text(f"{text}\n", encoding="utf-8")
    print(f'wrote {path}; let a study begin with "#:schema {path}"')
    return 0
