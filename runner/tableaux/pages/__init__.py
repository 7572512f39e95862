"""One explicit Runge-Kutta method a file, METHOD, found by the file's name: a ButcherTableau, or an EmbeddedPair."""
