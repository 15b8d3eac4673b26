"""Elements in parallel with the plays that forget as their input travels: Bouc-Wen and Dahl."""

SOURCES = {"elements": ("elements.c",)}
