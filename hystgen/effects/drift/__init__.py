"""Drift of the output with session time."""

SOURCES = {"blocks": ("clock.c",)}
