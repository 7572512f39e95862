"""What was made for one run of a study and will do for others: they differ in little."""

from collections.abc import Callable, Hashable
from typing import Any, TypeVar

Made = TypeVar("Made")


class Memory:
    """Things by what they are made of, at most so many; threads may share it, and at worst make a thing twice."""

    def __init__(self, most: int = 64) -> None:
        self._most = most
        self._known: dict[Hashable, Any] = {}

    def __call__(self, key: Hashable, make: Callable[[], Made]) -> Made:
        """What was made of this before, or is made now. Raises what `make` raises, and remembers nothing then."""
        found: Made | None = self._known.get(key)
        if found is None:
            found = make()
            if len(self._known) >= self._most:
                self._known.clear()
            self._known[key] = found
        return found
