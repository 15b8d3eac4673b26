"""Creep."""

SOURCES = {"blocks": ("creep.c",)}
