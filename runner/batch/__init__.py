"""Batches: the runs of a sweep, block by block, into a store that survives being stopped."""
