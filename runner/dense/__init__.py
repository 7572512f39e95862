"""A run between its saved points, by its method's dense output."""
