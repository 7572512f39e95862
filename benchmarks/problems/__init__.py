"""Standard problems that nobody here invented, each with its reference end point: one room for each kind."""

from benchmarks.problems import circuits, detest_large, detest_small, kinetics, orbits, pollution, van_der_pol
from benchmarks.problems.problem import Problem

__all__ = ["NON_STIFF", "PROBLEMS", "STIFF", "Problem"]

DETEST = sorted((*detest_small.PROBLEMS, *detest_large.PROBLEMS), key=lambda problem: problem.name)
NON_STIFF = (*DETEST, *orbits.PROBLEMS)
STIFF = (*kinetics.PROBLEMS, *van_der_pol.PROBLEMS, *pollution.PROBLEMS, *circuits.PROBLEMS)
#: All problems by name.
PROBLEMS = {problem.name: problem for problem in (*NON_STIFF, *STIFF)}
