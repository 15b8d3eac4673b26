"""Gain and offset that follow a temperature."""

SOURCES = {"blocks": ("heat.c", "gain.c", "friction.c")}
