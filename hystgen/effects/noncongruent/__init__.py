"""Plays whose loops depend on where they lie."""

from hystgen.effects.sources import Sources

SOURCES = Sources(bends=("bent.c",))
