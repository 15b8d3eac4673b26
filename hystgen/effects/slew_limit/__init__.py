"""Limited slew rate of the amplifier."""

SOURCES = {"limits": ("slewed.c",), "brake": ("brake.c",)}
