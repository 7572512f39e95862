"""The values of one axis of a sweep: numbers in one unit, or anything else that may stand in a study."""

import json
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from qddot.runner.study.base import Amount
from qddot.runner.study.batch_schema import AxisTable
from qddot.runner.study.units import magnitude
from qddot.units.amounts import number_and_unit
from qddot.units.worth import problem

#: Ways to give the values of an axis; those of SAMPLED are drawn, one value a run.
LISTED = ("values", "linspace", "logspace", "range")
SAMPLED = ("uniform", "loguniform", "normal", "integers")
#: The most values of one axis.
MOST = 10_000_000
#: How a text begins that is meant as a number.
_SLIP = re.compile(r"\s*[-+−]?[.,]?\d")


@dataclass(frozen=True, eq=False)
class Axis:
    """keys get the same value; its values (n,), numbers in `unit` or labels of `items`; group: what it advances with.

    distribution: name and two numbers of a sampled axis, whose values are not known yet. offset, factor: what stands
    in the study is offset + factor * value. logarithmic: the values are spaced by equal ratios.
    """

    keys: tuple[str, ...]
    name: str
    unit: str
    group: str | None
    values: NDArray[Any]
    items: tuple[Any, ...] | None = None
    distribution: tuple[str, float, float] | None = None
    offset: float = 0.0
    factor: float = 1.0
    logarithmic: bool = False

    def setting(self, i: int) -> Any:
        """What stands in the study for value i: a number, "12.5 km/h", or the item."""
        if self.items is not None:
            return self.items[i]
        value = self.values[i].item()
        if self.offset != 0.0 or self.factor != 1.0:
            value = self.offset + self.factor * value
        return f"{value!r} {self.unit}" if self.unit not in ("", "1") else value


def axis_of(table: AxisTable, name: str) -> Axis:
    """The axis in this table, called `name`. Raises ValueError that begins with the key it is about."""
    given = [way for way in (*LISTED, *SAMPLED) if getattr(table, way) is not None]
    if len(given) != 1:
        found = " and ".join(given) or "none"
        raise ValueError(f"key: expected one of {', '.join((*LISTED, *SAMPLED))}; found {found}")
    way = given[0]
    if table.unit is not None and (wrong := problem(table.unit)):
        raise ValueError(f"unit: {table.unit!r}: {wrong}")
    keys = (table.key,) if isinstance(table.key, str) else table.key
    if not keys:
        raise ValueError("key: expected a dotted key such as parameters.m_6, or a list of some")
    if way != "values" and table.labels is not None:
        raise ValueError("labels: they name the items of `values`, which is not given")
    if way in SAMPLED:
        if table.zip is not None:
            raise ValueError(f"zip: sampled axes advance together anyway; leave it out, or give values, not {way}")
        low, high, unit = _distribution(table, way)
        axis = Axis(
            keys, name, unit, "samples", np.empty(0), distribution=(way, low, high), logarithmic=way == "loguniform"
        )
    elif way == "values":
        axis = _listed(table, keys, name)
    else:
        values, unit = _spaced(table, way)
        axis = Axis(keys, name, unit, table.zip, values, logarithmic=way == "logspace")
    return _mapped(axis, table)


def _mapped(axis: Axis, table: AxisTable) -> Axis:
    """The axis with its offset and factor."""
    if table.offset == 0.0 and table.factor == 1.0:
        return axis
    if axis.items is not None:
        raise ValueError("offset: the values are no numbers, so they have neither offset nor factor")
    if not math.isfinite(table.factor) or table.factor == 0.0:
        raise ValueError(f"factor: {table.factor}; expected a finite number other than 0")
    (offset,), unit = _numbers("offset", (table.offset,), axis.unit or None)
    if unit != axis.unit:
        raise ValueError(f"offset: {table.offset!r} has a unit, the values have none")
    return replace(axis, offset=offset, factor=table.factor)


def _listed(table: AxisTable, keys: tuple[str, ...], name: str) -> Axis:
    items = table.values or ()
    if not items:
        raise ValueError("values: there are none")
    if table.labels is not None:
        if len(table.labels) != len(items) or len(set(table.labels)) < len(items):
            raise ValueError(
                f"labels: {len(table.labels)} for {len(items)} values; expected one for each, all different"
            )
        return Axis(keys, name, "", table.zip, np.array(table.labels, dtype=object), items)
    amounts = [_is_amount(item) for item in items]
    if any(amounts) and not all(amounts):
        for item in items:
            if isinstance(item, str) and _SLIP.match(item):
                _parts("values", item)  # raises where it is none
    if all(amounts):
        values, unit = _numbers("values", items, table.unit)
        whole = all(isinstance(item, int) for item in items) and not unit
        return Axis(keys, name, unit, table.zip, np.array(values, dtype=np.int64 if whole else np.float64))
    if table.unit is not None:
        raise ValueError(f"unit: {table.unit!r} is given, but not all values are numbers")
    labels = [item if isinstance(item, str) else json.dumps(item, default=str) for item in items]
    return Axis(keys, name, "", table.zip, np.array(labels, dtype=object), items)


def _is_amount(item: Any) -> bool:
    """Whether an item is a number, or a text with a number and a unit."""
    if not isinstance(item, str):
        return isinstance(item, int | float) and not isinstance(item, bool)
    try:
        number_and_unit(item)
    except ValueError:
        return False
    return True


def _spaced(table: AxisTable, way: str) -> tuple[NDArray[Any], str]:
    if way == "range":
        assert table.range is not None  # the way that is given
        first, stop = table.range
        if not 0 < stop - first <= MOST:
            raise ValueError(
                f"range: from {first} up to {stop} there are {max(0, stop - first)} numbers; 1 to {MOST} work"
            )
        return np.arange(first, stop, dtype=np.int64), table.unit or ""
    first, last, count = getattr(table, way)
    if not 1 <= count <= MOST:
        raise ValueError(f"{way}: a count of {count}; expected 1 to {MOST}")
    (low, high), unit = _numbers(way, (first, last), table.unit)
    if way == "linspace":
        return np.linspace(low, high, count), unit
    if low * high <= 0:
        raise ValueError(f"logspace: from {low:g} to {high:g}; expected two numbers of one sign, none of them 0")
    return np.geomspace(low, high, count), unit


def _distribution(table: AxisTable, way: str) -> tuple[float, float, str]:
    a, b = getattr(table, way)
    (low, high), unit = _numbers(way, (a, b), table.unit)
    if way == "normal":
        if high <= 0:
            raise ValueError(f"normal: a standard deviation of {high:g}; expected one greater than 0")
    elif not low < high:
        raise ValueError(f"{way}: from {low:g} to {high:g}; expected the lower end first")
    if way == "loguniform" and low <= 0:
        raise ValueError(f"loguniform: from {low:g}; expected a number greater than 0")
    return low, high, unit


def _numbers(where: str, amounts: Sequence[Amount], declared: str | None) -> tuple[list[float], str]:
    """The amounts in one unit: the one declared, or else that of the first amount that has one."""
    pairs = [_parts(where, amount) for amount in amounts]
    unit = declared or next((unit for _, unit in pairs if unit), "")
    return [number if own in ("", unit) else magnitude(where, f"{number!r} {own}", unit) for number, own in pairs], unit


def _parts(where: str, amount: Amount) -> tuple[float, str]:
    """Number and unit of an amount."""
    try:
        number, unit = number_and_unit(amount) if isinstance(amount, str) else (float(amount), "")
    except ValueError as error:
        raise ValueError(f"{where}: {error}") from None
    if not math.isfinite(number):
        raise ValueError(f"{where}: {amount!r}; expected a finite number, with or without a unit")
    return number, unit
