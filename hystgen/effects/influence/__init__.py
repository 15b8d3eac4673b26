"""Gain and offset that follow a logged column: load, humidity, another axis."""

SOURCES = {"blocks": ("gain.c", "course.c")}
