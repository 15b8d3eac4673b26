"""Gain that falls with the distance travelled."""

from hystgen.effects.sources import Sources

SOURCES = Sources(blocks=("ageing{}.c",), calls={"travel": ("calls.c",)})
