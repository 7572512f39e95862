"""Copies of a part: names that carry a mark, names exchanged for others, names bound to what another part has."""

import re
from collections.abc import Iterator, Mapping
from dataclasses import fields, replace
from numbers import Real
from typing import TYPE_CHECKING, Any

from sympy import Expr, Symbol, sympify

from qddot.model.constraints import reaction_symbol
from qddot.model.contents import HELD
from qddot.model.events import Impact
from qddot.model.mapping import held, mapped
from qddot.model.naming import dotted
from qddot.model.system import Coordinate, Input, ModelError, Parameter, Quantity
from qddot.words import nearest

if TYPE_CHECKING:
    from qddot.model.part import Part

#: Where a mark goes in a name, and its label in a meaning.
MARK = "{}"
_SOUND = re.compile(r"[A-Za-z0-9_]+\Z")


def marked(part: "Part", mark: str, label: str) -> "Part":
    """A copy of a part whose own names carry a mark, and whose meanings say the label."""
    if not isinstance(mark, str) or not _SOUND.match(mark):
        raise ModelError(f"part {part.name}: the mark {mark!r} must be a text of letters, digits and underscores")
    names = _marks(part, mark)
    copy = renamed(part, names)
    told: dict[str, Any] = {
        kind: tuple(_told(new, label) if said(old.symbol) in names else new for old, new in _pairs(part, copy, kind))
        for kind in HELD
    }
    told["events"] = tuple(_told(replace(each, name=_with_mark(each.name, mark)), label) for each in copy.events)
    stems = {other: part.stems.get(name, f"{part.name} {name}") for name, other in names.items()}
    return replace(copy, **told, stems=stems, name=label, pieces=(label,))


def names_of_copy(part: "Part", mark: str) -> dict[str, str]:
    """What a part declares, by the names without a mark, with the names in a copy."""
    names = _marks(part, mark)
    own = (said(each.symbol) for each in _items(part))
    return {name.replace(MARK, ""): names.get(name, name) for name in own}


def _marks(part: "Part", mark: str) -> dict[str, str]:
    """The names of a part's own with those that they have in a copy."""
    common = {said(symbol) for symbol in part.shared}
    rates = (rate for each in _items(part) if (rate := _own_rate(each)) is not None)
    own = [said(symbol) for symbol in (*(each.symbol for each in _items(part)), *rates, *_of_contacts(part))]
    return {name: _with_mark(name, mark) for name in own if name not in common}


def _with_mark(name: str, mark: str) -> str:
    return name.replace(MARK, mark) if MARK in name else f"{name}_{mark}"


def _pairs(one: "Part", other: "Part", kind: str) -> Iterator[tuple[Any, Any]]:
    return zip(getattr(one, kind), getattr(other, kind), strict=True)


def renamed(part: "Part", names: Mapping[str, str]) -> "Part":
    """A part with other names; what is derived from a name, its rate, its acceleration, its reaction, follows."""
    known = {said(symbol) for symbol in held([getattr(part, each.name) for each in fields(part)])}
    known |= {said(symbol) for symbol in (*(each.symbol for each in _items(part)), *_of_contacts(part))}
    for name in names:
        if name not in known:
            raise ModelError(f"part {part.name} uses no name {name}{nearest(name, known)}")
    exchanged = _followed(part, names)
    taken = {said(each.symbol) for each in _items(part)} - names.keys()
    for name, other in names.items():
        if other in taken:
            raise ModelError(f"part {part.name}: {name} would become {other}, which it has already; give another name")

    def change(symbol: Symbol) -> Symbol:
        return Symbol(exchanged.get(symbol.name, symbol.name), **symbol.assumptions0)

    return replace(_mapped(part, change), stems={exchanged.get(name, name): stem for name, stem in part.stems.items()})


def bound(part: "Part", names: Mapping[str, str], given: Mapping[str, Any]) -> "Part":
    """A copy with what is given in place of its names, see `Part.__call__`; names: see `names_of_copy`."""
    for key, value in given.items():
        if key not in names:
            raise ModelError(f"part {part.name} declares no {key}{nearest(key, names)}")
        expression = sympify(value) if isinstance(value, Real | Expr) and not isinstance(value, bool) else None
        if not isinstance(expression, Expr):
            raise ModelError(f"part {part.name}: {key} is {value!r}, expected a number, a symbol or an expression")
        item = next(each for each in _items(part) if said(each.symbol) == names[key])
        part = _bound(part, item, expression)
    return part


def _bound(part: "Part", item: Any, value: Expr) -> "Part":
    if isinstance(item, Parameter):
        return _parameter(part, item, value)
    if isinstance(item, Quantity):
        other = replace(item, expression=value)
        kinds = ("quantities", "outputs")
        places: dict[str, Any] = {each: tuple(other if q == item else q for q in getattr(part, each)) for each in kinds}
        return replace(part, **places)
    if not isinstance(item, Coordinate | Input):
        hint = "it has an equation of its own; parameters, coordinates, inputs and quantities can be given"
        what = type(item).__name__.lower()
        raise ModelError(f"part {part.name}: {said(item.symbol)}, of the kind {what}, cannot be given: {hint}")
    left = _without(part, item)
    if isinstance(value, Symbol):
        return _connected(left, item, value)
    quantity = Quantity(item.symbol, value, item.unit, item.meaning, rate=item.rate)
    return replace(left, quantities=(quantity, *left.quantities))


def _parameter(part: "Part", item: Parameter, value: Expr) -> "Part":
    """A part with a number as the default of a parameter, or with an expression in its place."""
    name = said(item.symbol)
    if value.is_number:
        numbered = (replace(each, default=float(value)) if each == item else each for each in part.parameters)
        return replace(part, parameters=tuple(numbered))
    for group, values in part.parameter_sets.items():
        if name in map(said, values):
            raise ModelError(f"part {part.name}: {name} is given, and the set {group} gives it a value; leave one out")
    return _mapped(_without(part, item), lambda symbol: value if said(symbol) == name else symbol)


def _without(part: "Part", item: Any) -> "Part":
    kind = next(each for each in HELD if item in getattr(part, each))
    left: dict[str, Any] = {kind: tuple(each for each in getattr(part, kind) if each != item)}
    return replace(part, **left)


def _connected(part: "Part", item: Any, symbol: Symbol) -> "Part":
    """A part in which a coordinate or an input is that of another part, by its dotted names."""
    pairs = [(item.symbol, symbol), (item.rate, dotted(symbol)), (dotted(item.rate), dotted(dotted(symbol)))]
    if isinstance(item, Coordinate):
        pairs.append((reaction_symbol(item), Symbol(f"reaction_{symbol}")))
    others = {said(one): other for one, other in pairs}
    return _mapped(part, lambda each: others.get(said(each), each))


def _followed(part: "Part", names: Mapping[str, str]) -> dict[str, str]:
    """The names with those that follow from them."""
    found = dict(names)
    items = {said(each.symbol): each for each in _items(part)}
    for name, other in names.items():
        if type(items.get(name)).__name__ in (
            "Parameter",
            "Quantity",
            "Friction",
            "Output",
            "Constraint",
            "Rolling",
            "Contact",
        ):
            continue
        rate, new_rate = (dotted(Symbol(each)) for each in (name, other))
        if name in items and (explicit := _own_rate(items[name])) is not None:
            rate, new_rate = explicit, Symbol(names.get(said(explicit), said(explicit)))
        follow = [(rate, new_rate), (dotted(rate), dotted(new_rate))]
        follow += [(Symbol(f"reaction_{name}"), Symbol(f"reaction_{other}"))]
        for one, two in follow:
            if said(one) not in items:
                found.setdefault(said(one), said(two))
    return found


def _mapped(part: "Part", change: Any) -> "Part":
    """A part with every symbol exchanged; what adds up on one symbol is added."""
    values = {each.name: mapped(getattr(part, each.name), change) for each in fields(part)}
    forces: dict[Symbol, Any] = {}
    for symbol, force in part.generalized_forces.items():
        at = change(symbol)
        forces[at] = forces.get(at, 0) + mapped(force, change)
    return replace(part, **values | {"generalized_forces": forces})


def _items(part: "Part") -> list[Any]:
    return [each for name in HELD for each in getattr(part, name)]


def _of_contacts(part: "Part") -> Iterator[Symbol]:
    """What impacts have as outputs."""
    for each in part.events:
        if isinstance(each, Impact):
            yield each.force_symbol
            yield each.rests_symbol


def _own_rate(item: Any) -> Symbol | None:
    """The rate that an item names itself."""
    for name in ("velocity", "rate_symbol"):
        if hasattr(item, name):
            found: Symbol | None = getattr(item, name)
            return found
    return item.rate if isinstance(item, Quantity) else None


def _told(item: Any, label: str) -> Any:
    """The same item, its meaning with the label."""
    meaning = str(item.meaning)
    return replace(item, meaning=meaning.replace(MARK, label) if MARK in meaning else f"{meaning}, {label}")


def said(symbol: Symbol) -> str:
    """The name of a symbol: what is assumed of it is no part of it."""
    return str(symbol.name)
