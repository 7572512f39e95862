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
#: By what is imported: what is installed, where that has another name.
_INSTALLED = {"sksundae": "scikit-sundae"}


def peer(file: str, name: str, *settings: Any) -> Callable[[Any], Any]:
    """The function of this name in a file of this folder, called with a case and the settings; imported only then.

    Called where a tool is missing it raises ModuleNotFoundError, which says what to install.
    """

    def prepare(case: Any) -> Any:
        try:
            home = import_module(f"benchmarks.peers.{file}")
        except ModuleNotFoundError as error:
            tool = (error.name or file).partition(".")[0]
            raise ModuleNotFoundError(f"{error.msg}: pip install {_INSTALLED.get(tool, tool)}", name=tool) from error
        return getattr(home, name)(case, *settings)

    return prepare
