"""CyRK: its C++ solver over our generated right-hand side, jitted."""

from collections.abc import Callable

from CyRK import nb_diffeq_addr, nbsolve2_ivp

from benchmarks.cases.case import Case, Floats, Run, in_parts
from benchmarks.peers import compiled


def one(case: Case, method: str) -> Callable[[float], Run]:
    """The first run."""
    derivative, numbers = compiled.by_pointers(case), compiled.numbers(case)[0]

    def function(dy, t, y, args):
        derivative(t, y, args, dy)

    address = nb_diffeq_addr(function)
    by_peak = {peak: numbers[part] for part, (_, peak) in enumerate(case.parts)}

    def at(tolerance: float) -> Run:
        settings = {"method": method, "rtol": tolerance, "atol": tolerance * case.atol}

        def advance(x: Floats, t: float, until: float, peak: float) -> Floats:
            result = nbsolve2_ivp(address, (t, until), x, args=by_peak[peak], **settings)
            if not result.success:
                raise RuntimeError("CyRK failed")
            return result.y[:, -1].copy()

        return in_parts(case, advance)

    return at
