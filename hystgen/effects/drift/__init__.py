"""Drift of the output with session time."""
