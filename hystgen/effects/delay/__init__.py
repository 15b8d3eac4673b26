"""Dead time in front of the actuator."""

SOURCES = {"blocks": ("delay.c", "preview.c"), "limits": ("forward.c",)}
