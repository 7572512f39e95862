"""The table of integration methods by name; a family is imported when one of its methods is first asked for."""

import pkgutil
from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import cache
from importlib import import_module

from qddot.runner.checks import shown, unknown
from qddot.runner.method import Method
from qddot.runner.options import EVERY_FAMILY
from qddot.runner.tableaux import pages

#: The methods without a page in `tableaux.pages`, and the module that holds each.
_OTHERS = {
    **dict.fromkeys(("ode15s", "rodas5p"), "qddot.runner.stiff.methods"),
    "exact": "qddot.runner.exact.methods",
    "taylor": "qddot.runner.taylor.methods",
    "auto": "qddot.runner.auto",
}


class _Methods(Mapping[str, Method]):
    """Name -> method, read-only, family by family; looking one up imports its family, and compiles nothing."""

    def __getitem__(self, name: str) -> Method:
        if name not in _names():
            raise KeyError(name)
        return _method(name)

    def __iter__(self) -> Iterator[str]:
        return iter(sorted(_names(), key=_rank))

    def __len__(self) -> int:
        return len(_names())

    def __repr__(self) -> str:
        return "\n".join(map(repr, self.values()))


METHODS: Mapping[str, Method] = _Methods()


def methods() -> Mapping[str, Method]:
    """All integration methods by name; see `Method` for what is known of each."""
    return METHODS


def find_method(name: str) -> Method:
    """The method of this name; raises ValueError with the nearest name that exists."""
    if not isinstance(name, str):
        raise ValueError(f"method is {shown(name)}, expected a method's name, such as 'rk4'")
    if name in _names():
        return METHODS[name]
    raise ValueError(unknown("method", name, _names()))


@cache
def _names() -> tuple[str, ...]:
    return (*(page.name for page in pkgutil.iter_modules(pages.__path__)), *_OTHERS)


def _rank(name: str) -> tuple[int, int]:
    return EVERY_FAMILY.index(_method(name).family), _method(name).order


@cache
def _method(name: str) -> Method:
    if name in _OTHERS:
        found: Method = {method.name: method for method in import_module(_OTHERS[name]).METHODS}[name]
    else:
        page = import_module(f"{pages.__name__}.{name}").METHOD
        found = import_module("qddot.runner.explicit.methods").runge_kutta(page)
    return replace(found, find=find_method)
