"""Long sums taken apart, however they are nested: of what does not repeat as a whole the terms may.

A term of a sum that stands in a product is a tuple of factors, which are multiplied where it is written alone: most
terms are those of another cell.
"""

from collections.abc import Mapping
from typing import Any

import symengine as se

from qddot.codegen.cells import LEAST
from qddot.codegen.nodes import operands


def terms(expression: Any, definitions: Mapping[Any, Any]) -> list[Any]:
    """The terms of a long sum, those within sums and products of it by themselves; none where it is not long.

    definitions: of temporaries, one of which the expression may be.
    """
    while expression in definitions:
        expression = definitions[expression]
    found = _terms(expression, {})
    return found if len(found) >= LEAST else []


def _terms(node: Any, known: dict[Any, list[Any]]) -> list[Any]:
    """The terms that it is the sum of, itself where it is none."""
    if node not in known:
        known[node] = _taken_apart(node, known)
    return known[node]


def _taken_apart(node: Any, known: dict[Any, list[Any]]) -> list[Any]:
    parts = operands(node)
    if isinstance(node, se.Add):
        return [term for part in parts for term in _terms(part, known)]
    if isinstance(node, se.Mul):
        long = [part for part in parts if isinstance(part, se.Add) and len(_terms(part, known)) >= LEAST]
        if len(long) == 1:
            rest = se.Mul(*(part for part in parts if part is not long[0]))
            return [(rest, *(term if isinstance(term, tuple) else (term,))) for term in _terms(long[0], known)]
    return [node]
