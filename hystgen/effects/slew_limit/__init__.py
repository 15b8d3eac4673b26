"""Limited slew rate of the amplifier."""

from hystgen.effects.sources import Sources

SOURCES = Sources(limits=("slewed.c",), brake=("brake.c",))
