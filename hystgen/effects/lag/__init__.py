"""First-order lag of amplifier or averaging in front of the actuator."""

SOURCES = {"blocks": ("lag.c", "exact.c"), "drives": ("braked.c", "quiet.c", "steady.c")}
