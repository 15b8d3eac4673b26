"""Plays that depend on the rate of their input."""

SOURCES = {
    "play": ("moved.c",),
    "dilated": ("moved.c",),
    "relaxing": ("stretch.c", "moved.c"),
    "dashpot": ("yield.c", "dashpot.c"),
    "relaxing alone": ("stretch.c", "relaxing.c"),
}
