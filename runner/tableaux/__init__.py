"""Runge-Kutta methods as pages of a book: what a tableau is, and in `pages` one file a method, called by its name."""
