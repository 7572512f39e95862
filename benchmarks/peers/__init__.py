"""Other tools over the same cases, a file for each.

A file imports its tool at the top and is itself imported where it is first used, so that a tool that is not installed
stops no other. `one(case)` and `many(case)` prepare the first run or all runs of a case, and give a function that takes
a relative tolerance and gives the run: a call of no arguments that gives the final states (runs, 2n).
"""

from collections.abc import Callable
from importlib import import_module
from typing import Any

#: Threads of every batch, of ours too.
THREADS = 2


def peer(file: str, name: str, *settings: Any) -> Callable[[Any], Any]:
    """The function of this name in a file of this folder, called with a case and the settings; imported only then."""
    return lambda case: getattr(import_module(f"benchmarks.peers.{file}"), name)(case, *settings)
