"""Gain that falls with the distance travelled."""

SOURCES = {"blocks": ("ageing.c",), "calls": ("calls.c",)}
