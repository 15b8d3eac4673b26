"""A mechanical mode of the stage."""

from hystgen.effects.sources import Sources

SOURCES = Sources(blocks=("mode.c",))
