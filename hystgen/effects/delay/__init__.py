"""Dead time in front of the actuator."""

from hystgen.effects.sources import Sources

SOURCES = Sources(blocks=("delay.c", "preview.c"), limits=("forward.c",))
