"""Plays that depend on the rate of their input."""

from hystgen.effects.sources import Sources

SOURCES = Sources(
    moves={
        "play": ("moved.c",),
        "dilated": ("moved.c",),
        "relaxing": ("stretch.c", "moved.c"),
        "dashpot": ("yield.c", "dashpot.c"),
    },
    scanned={"relaxing": ("stretch.c", "relaxing.c", "relaxing_plays.c")},
)
