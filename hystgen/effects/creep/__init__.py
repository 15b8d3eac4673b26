"""Creep."""

from hystgen.effects.sources import Sources

SOURCES = Sources(blocks=("creep{}.c",))
