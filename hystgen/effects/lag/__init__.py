"""First-order lag of amplifier or averaging in front of the actuator."""

from hystgen.effects.sources import Sources

SOURCES = Sources(blocks=("lag{}.c", "exact.c", "braked{}.c"), drives=("quiet.c", "steady{}.c"))
