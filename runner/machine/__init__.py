"""Everything that speaks to numba and LLVM: records and addresses, compiled functions and their cache, sums, LAPACK."""
