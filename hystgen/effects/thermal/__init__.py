"""Gain and offset that follow a temperature."""

SOURCES = {"blocks": ("heat.c", "friction.c")}
