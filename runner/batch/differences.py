"""What makes a store that of another batch."""

import json
from collections.abc import Iterator, Mapping
from typing import Any

from qddot.runner.batch.layout import LAYOUT


def differences(stored: Mapping[str, Any], wanted: Mapping[str, Any]) -> list[str]:
    """Why a store is not of this batch, in words; nothing where it is."""
    if stored.get("qddot_layout") != LAYOUT:
        return [f"the store has layout {stored.get('qddot_layout')}, this version of qddot writes {LAYOUT}"]
    found = []
    before, now = (dict(_leaves(json.loads(each["definition"]))) for each in (stored, wanted))
    for key in sorted({*before, *now}):
        if before.get(key) != now.get(key):
            words = [repr(each[key]) if key in each else "not set" for each in (before, now)]
            found.append(f"{key}: {words[0]} in the store, {words[1]} in the study")
    if stored["kernel_digest"] != wanted["kernel_digest"]:
        found.append(f"model {wanted['model']}: its kernels were generated anew since")
    for name in sorted({*stored["file_digests"], *wanted["file_digests"]}):
        if stored["file_digests"].get(name) != wanted["file_digests"].get(name) and not found:
            found.append(f"file {name}: its content changed")
    if not found and stored["axes_digest"] != wanted["axes_digest"]:
        found.append("the sampled values of the axes: this version of SciPy or NumPy draws others")
    return found


def _leaves(node: Any, key: str = "") -> Iterator[tuple[str, Any]]:
    pairs = node.items() if isinstance(node, dict) else enumerate(node) if isinstance(node, list) else ()
    if not pairs:
        yield key, node
    for name, each in pairs:
        yield from _leaves(each, f"{key}.{name}" if key else str(name))
