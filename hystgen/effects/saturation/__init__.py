"""Saturation behind the plays; one in front of them is a stage of `model.memoryless`."""

from hystgen.effects.sources import Sources

SOURCES = Sources(fixed=("stops.c",))
