"""A mechanical mode of the stage."""

SOURCES = {"blocks": ("mode.c",)}
