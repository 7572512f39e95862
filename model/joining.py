"""Two parts as one: what they declare side by side, what they add up to, and what they must not both be."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from qddot.model.assumptions import plain
from qddot.model.contents import HELD
from qddot.model.copies import said
from qddot.model.system import ModelError

if TYPE_CHECKING:
    from qddot.model.part import Part

#: What adds up.
SUMS = ("kinetic_energy", "potential_energy", "dissipation")


def joined(one: "Part", other: "Part") -> "Part":
    """Both parts as one. Raises ModelError where they contradict each other."""
    names = f"{one.name} + {other.name}"
    for piece in other.pieces:
        if piece in one.pieces:
            raise ModelError(f'part {piece} is added twice: give each copy a mark of its own, as in axle("2")')
    _refuse_roles(one, other)
    stems = {**one.stems, **other.stems}
    held = {name: _side_by_side(name, one, other, stems) for name in HELD}
    sums = {name: getattr(one, name) + getattr(other, name) for name in SUMS}
    return replace(
        one,
        name=names,
        **held,
        **sums,
        generalized_forces=_added(one.generalized_forces, other.generalized_forces),
        parameter_sets=_sets(one, other),
        baumgarte=_baumgarte(one, other),
        events=(*one.events, *other.events),
        scene=(*one.scene, *other.scene),
        shared=tuple(dict.fromkeys((*one.shared, *other.shared))),
        pieces=(*one.pieces, *other.pieces),
        stems=stems,
    )


def _side_by_side(kind: str, one: "Part", other: "Part", stems: Mapping[str, str]) -> tuple[Any, ...]:
    """The items of both; one that has a copy in the first part stands behind it."""
    items = list(getattr(one, kind))
    known = {said(each.symbol): each for each in items}
    for item in getattr(other, kind):
        name = said(item.symbol)
        if name in known:
            if plain(known[name]) != plain(item):
                raise ModelError(_differing(kind, name, known[name], item, one, other))
            continue
        stem = stems.get(name)
        alike = [k for k, each in enumerate(items) if stem is not None and stems.get(said(each.symbol)) == stem]
        items.insert(alike[-1] + 1 if alike else len(items), item)
    return tuple(items)


def _differing(kind: str, name: str, here: Any, there: Any, one: "Part", other: "Part") -> str:
    """What two declarations of one name differ in, and what to do."""
    if type(here) is not type(there):
        what = f"as {type(here).__name__} and as {type(there).__name__}"
    else:
        each = next(k for k in vars(here) if plain(getattr(here, k)) != plain(getattr(there, k)))
        what = f"with {each} {getattr(here, each)!r} and {getattr(there, each)!r}"
    singular = kind.removesuffix("ies") + "y" if kind.endswith("ies") else kind.removesuffix("s")
    return (
        f"{singular} {name} is declared by {one.name} and by {other.name}, {what}: declare it in one of them, which "
        f"the other then uses; or keep them apart, by a mark or by renamed({{{name!r}: ...}})"
    )


def _refuse_roles(one: "Part", other: "Part") -> None:
    """ModelError where a name is one thing here and another there."""
    roles = [
        {said(each.symbol): kind for kind in reversed(HELD) for each in getattr(part, kind)} for part in (one, other)
    ]
    for name in sorted(roles[0].keys() & roles[1].keys()):
        here, there = (each[name] for each in roles)
        if here != there:
            raise ModelError(
                f"{name} is among the {here} of {one.name} and among the {there} of {other.name}: rename one of them, "
                f"renamed({{{name!r}: ...}}), or give a copy of a part a mark"
            )


def _added(one: Mapping[Any, Any], other: Mapping[Any, Any]) -> dict[Any, Any]:
    found = dict(one)
    for symbol, force in other.items():
        at = next((each for each in found if said(each) == said(symbol)), symbol)
        found[at] = found.get(at, 0) + force
    return found


def _sets(one: "Part", other: "Part") -> dict[str, Mapping[Any, float]]:
    found = {name: dict(values) for name, values in one.parameter_sets.items()}
    for name, values in other.parameter_sets.items():
        known = found.setdefault(name, {})
        for symbol, value in values.items():
            if known.setdefault(symbol, value) != value:
                raise ModelError(
                    f"parameter set {name} gives {symbol} the value {known[symbol]!r} in {one.name} and {value!r} in "
                    f"{other.name}; give it in one of them"
                )
    return dict(found)


def _baumgarte(one: "Part", other: "Part") -> Sequence[Any] | None:
    given = [part.baumgarte for part in (one, other) if part.baumgarte is not None]
    if len(given) == 2 and plain(tuple(given[0])) != plain(tuple(given[1])):
        raise ModelError(
            f"baumgarte is {given[0]} in {one.name} and {given[1]} in {other.name}; give it in one of them"
        )
    return given[0] if given else None
