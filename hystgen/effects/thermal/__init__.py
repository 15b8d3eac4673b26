"""Gain and offset that follow a temperature."""

from hystgen.effects.sources import Sources

SOURCES = Sources(blocks=("heat.c", "gain{}.c", "friction.c"))
