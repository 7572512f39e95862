"""Changes of a study by dotted key, before it is checked: `--set` and sweeps."""

from collections.abc import Mapping, Sequence
from typing import Any

from qddot.runner.checks import unknown
from qddot.runner.study.toml import tables_of

Tree = dict[str, Any]

#: Tables that may be missing in the file, and whose keys are the model's names.
_OPEN = (
    *("parameters", "initial", "equilibrium_guess", "assemble", "inputs", "outputs", "events"),
    *("integration", "integration.fixed", "integration.adaptive"),
)


def changed(tree: Tree, changes: Mapping[str, Any]) -> Tree:
    """The tree with the values at these dotted keys; the tree itself stays as it is, what is not changed is shared.

    "inputs.F.times.1" is the second item of a list. Raises ValueError naming the part of a key that does not exist.
    """
    for key, value in changes.items():
        tree = _with(tree, key.split("."), 0, value)
    return tree


def parsed(settings: Sequence[str]) -> dict[str, Any]:
    """Changes from texts such as "parameters.m_6=11 t" or "inputs.F.times=[1.0, 2.85]": a TOML value, else a text."""
    changes: dict[str, Any] = {}
    for setting in settings:
        key, equals, text = setting.partition("=")
        key = key.strip()
        if not equals or not all(part.strip() == part != "" for part in key.split(".")):
            raise ValueError(f"--set {setting!r}: expected key=value, such as parameters.m_6=11360 or span=[0,5]")
        try:
            tree = tables_of(f"value = {text}")
        except ValueError:
            tree = {}
        changes[key] = tree["value"] if len(tree) == 1 else text.strip()  # with a line break in it, it may be several
    return changes


def _with(node: Any, parts: list[str], depth: int, value: Any) -> Any:
    if depth == len(parts):
        return value
    part = parts[depth]
    if isinstance(node, list):
        place = _place(node, parts, depth)
        return [*node[:place], _with(node[place], parts, depth + 1, value), *node[place + 1 :]]
    if not isinstance(node, Mapping):
        above = ".".join(parts[:depth])
        raise ValueError(f"{'.'.join(parts)}: {above} is {node!r}, which has no {part!r} in it")
    last = depth == len(parts) - 1
    if part not in node and not last and ".".join(parts[: depth + 1]) not in _OPEN:
        tables = [name for name, each in node.items() if isinstance(each, Mapping | list)]
        raise ValueError(f"{'.'.join(parts)}: {unknown('table', part, tables)}")
    return {**node, part: _with(node.get(part, {}), parts, depth + 1, value)}


def _place(items: list[Any], parts: list[str], depth: int) -> int:
    part, above = parts[depth], ".".join(parts[:depth])
    if not part.isdecimal():
        raise ValueError(f"{'.'.join(parts)}: {above} is a list; expected a place from 0, found {part!r}")
    if int(part) >= len(items):
        raise ValueError(f"{'.'.join(parts)}: {above} has {len(items)} items, so none at place {part} (from 0)")
    return int(part)
