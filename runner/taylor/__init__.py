"""Taylor's method: the series of the solution to high order at every step, from recurrences; see docs/taylor.md."""
