"""Exact propagation of linear models, x' = A x + B [u, 1], by the matrix exponential."""
