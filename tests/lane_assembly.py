"""The assembly of loops over lanes, and of others."""

import llvmlite.binding
import pytest
from numba import njit

from qddot.runner.machine.compiled import ARITHMETIC
from qddot.runner.machine.lane_loop import LaneCompiler
from qddot.runner.machine.memory import LEAN

FEATURES = llvmlite.binding.get_host_cpu_features()
needs_avx = pytest.mark.skipif(not FEATURES.get("avx"), reason="this machine has no AVX")
PACKED, SCALAR = r"v(mul|fn?m\w*)pd\s.*%[yz]mm", r"v(add|mul|div|fn?m\w*)sd"


def fresh(function, signature, pipeline=LaneCompiler):
    """The assembly of a function compiled as lane loops are, or by another pipeline, past the cache."""
    options = {**ARITHMETIC, "pipeline_class": pipeline, **LEAN}
    return next(iter(njit(signature, **options)(function).inspect_asm().values()))
