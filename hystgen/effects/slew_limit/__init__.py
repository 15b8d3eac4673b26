"""Limited slew rate of the amplifier."""
