"""Dead time in front of the actuator."""
