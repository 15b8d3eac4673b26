"""First-order lag of amplifier or averaging in front of the actuator."""

SOURCES = {"blocks": ("lag{}.c", "exact.c", "braked{}.c"), "drives": ("quiet.c", "steady{}.c")}
