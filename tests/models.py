"""The models that tests are given one after the other, with their kernels and random points; fixtures of `conftest`."""

import importlib
from functools import cache
from types import ModuleType

import numpy as np
import pytest

from qddot.codegen.sources import shipped, shipped_names
from qddot.model.system import System
from qddot.runner.ranges import expanded

#: A shipped model by its name: nothing changes it, so that tests of it share the one that was read and checked first.
shipped_once = cache(shipped)

#: Shipped models that independent programs know whole; those with internal states have tests of their own, and so have
#: those with constraints, whose kernels call functions of the runner.
CONSTRAINED = ("four_bar",)
MODELS = tuple(name for name in shipped_names() if name not in CONSTRAINED and not shipped_once(name).states)


@pytest.fixture(params=MODELS)
def name(request):
    return request.param


@pytest.fixture
def system(name) -> System:
    return shipped_once(name)


@pytest.fixture
def kernels(name) -> ModuleType:
    """The generated module; `py_func` of a kernel runs it without the compiler."""
    return importlib.import_module(f"qddot.generated.{name}")


@pytest.fixture
def points(name, kernels):
    """Random points of a model: (t, x, u, p, c); parameters positive, coordinates of all signs."""
    return _points(name, kernels)


@cache
def _points(name, kernels):
    system = shipped_once(name)
    rng = np.random.default_rng(7)
    found = []
    for _ in range(100):
        defaults = np.array([parameter.default for parameter in system.parameters])
        p = np.where(defaults == 0, 0.3, defaults) * rng.uniform(0.7, 1.3, len(defaults))
        c = np.empty(len(p) + len(expanded(kernels.CONSTANT)))
        kernels.constants.py_func(p, c)
        x = rng.uniform(-1.5, 1.5, 2 * kernels.COORDINATES)
        time, u = rng.uniform(0, 10), rng.uniform(-1, 1, len(expanded(kernels.INPUT)))
        for each in (x, u, p, c):  # tests share them
            each.flags.writeable = False
        found.append((time, x, u, p, c))
    return found
