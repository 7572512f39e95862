"""Elementary functions that a loop over lanes can hold: no branches, no calls, so that LLVM turns them into vectors.

They stand in for those of `math`, by the same names, where a kernel is compiled for lanes (see `kernel`). fdlibm: Sun
Microsystems, Freely Distributable LIBM (1993), K. C. Ng. Errors in units in the last place (ulp) are what
tests/test_elementary.py measures against mpmath. Zeros have no sign here.
"""

import math
from typing import Any

from qddot.runner.machine.angles import acos, asin, atan, atan2, cos, sin, tan
from qddot.runner.machine.exponentials import cosh, exp, log, pow, sinh, tanh

#: What stands for `math` in lanes: functions of ours, and what are instructions or numbers already.
FORMS: dict[str, Any] = {
    **{function.__name__: function for function in (sin, cos, tan, exp, log, pow, tanh, sinh, cosh)},
    **{function.__name__: function for function in (atan, atan2, asin, acos)},
    **{name: getattr(math, name) for name in ("sqrt", "pi", "e", "nan", "inf")},
}
