"""Plays whose loops depend on where they lie."""

SOURCES = {"bends": ("bent.c",)}
