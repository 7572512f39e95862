"""Which options a method takes: what is given and not meant for it is refused by name, for nothing is ignored."""

from collections.abc import Iterable
from functools import cache

from qddot.runner.method import Method
from qddot.runner.methods import METHODS
from qddot.runner.options import TABLE, Options


@cache
def taken(method: Method, *, many: bool = False) -> tuple[str, ...]:
    """The options that a method takes, in one run or in many at once."""
    takers = {name: option.many if many else option.takers for name, option in TABLE.items()}
    return tuple(name for name, those in takers.items() if method.family in those or method.name in those)


def fitted(options: Options, method: Method) -> Options:
    """The options as a method reads them, those that it takes and that are not given at their defaults.

    Raises ValueError naming the first that is given and not meant for it.
    """
    own = taken(method)
    for name in TABLE:
        if name not in own and getattr(options, name) is not None:
            raise ValueError(f"{name}: {misfit(method, own, name)}")
    filled = object.__new__(Options)  # what is given was checked, and defaults need no check
    given = {name: getattr(options, name) for name in TABLE}
    vars(filled).update(given | {name: TABLE[name].default for name in own if given[name] is None})
    return filled


def misfit(method: Method, own: Iterable[str], name: str, instead: str = "") -> str:
    """What to say of an option that is given to a method that takes others, its `own`; instead: what else to do."""
    others = [each.name for each in METHODS.values() if name in taken(each)]
    todo = ["leave it out", instead, f"choose {', '.join(others)}" if others else ""]
    return f"method {method.name} takes none; it takes {', '.join(own)}; {' or '.join(filter(None, todo))}"
