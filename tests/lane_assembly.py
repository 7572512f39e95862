"""The assembly of loops over lanes."""

import llvmlite.binding
import pytest
from numba import njit

from qddot.runner.machine.compiled import ARITHMETIC
from qddot.runner.machine.lane_loop import LaneCompiler
from qddot.runner.machine.memory import LEAN

FEATURES = llvmlite.binding.get_host_cpu_features()
needs_avx = pytest.mark.skipif(not FEATURES.get("avx"), reason="this machine has no AVX")
PACKED, SCALAR = r"v(mul|fn?m\w*)pd\s.*%[yz]mm", r"v(add|mul|div|fn?m\w*)sd"


def fresh(function, signature):
    """A function compiled as lane loops are, past the cache, whose assembly can be read."""
    options = {**ARITHMETIC, "pipeline_class": LaneCompiler, **LEAN}
    return next(iter(njit(signature, **options)(function).inspect_asm().values()))
