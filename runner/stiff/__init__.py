"""Stiff methods: numerical differentiation formulas (ode15s), Rosenbrock methods, and the linear algebra they need."""
