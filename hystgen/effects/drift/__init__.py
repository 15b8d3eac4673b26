"""Drift of the output with session time."""

from hystgen.effects.sources import Sources

SOURCES = Sources(blocks=("clock.c",))
