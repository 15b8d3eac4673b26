"""First-order lag of amplifier or averaging in front of the actuator."""
