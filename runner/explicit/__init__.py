"""Explicit Runge-Kutta methods: tableaux, fixed-step marching, adaptive steps and their control."""
