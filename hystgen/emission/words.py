"""The words of the emitted C, explained once at the top of each file that uses them."""

from __future__ import annotations

import re
import textwrap

from hystgen.emission.text import WIDTH

_CORNERS = "_corner_t"
"""What only the corner engine names."""

WORDS = (
    ("play", r"\bplays?\b",
     "holds its value until its input is a threshold away, and then follows at that distance"),
    ("move", _CORNERS,
     "what the input does from one turning point to the next: it rises, or it falls. Lengths are taken along the move, "
     "so that a falling one is a rising one with all signs changed"),
    ("corner", _CORNERS,
     "a turning point that some plays still hold their values from; corners are a stack, the newest one on top"),
    ("block", _CORNERS,
     "the plays that one corner holds: those with larger thresholds than the corner above it has, up to its `top`"),
    ("way", _CORNERS, "how far the input has gone from a turning point"),
    ("reach", _CORNERS,
     "how far the output has gone from there; a reach_t also holds inputs and drives beyond every code"),
    ("segment", _CORNERS, "the curve of output over input from where one more play follows to where the next does"),
    ("pass", r"\bpass\[",
     "the input at which a move has taken a whole block along: the corner is passed, and forgotten"),
    ("kink", r"\bkink\b", "a place along the move where another play begins to follow"),
    ("effect", r"_(?:creep|lag|gain|mode|heat|ageing|clock)_\w*table",
     "a block of the chain from drive to displacement. rest: it has settled at an input; absorb: one sample passes "
     "through it; solve: the input that gives an output now; resting: the one that gives it at rest"),
    ("pending", r"\bpending\b",
     "the drive answered last: part of the memory only when the next call absorbs it, or the drive committed in its "
     "place"),
)  # fmt: skip
"""A word, what a text has that uses it, and what it means."""


def overview(text: str) -> str:
    """A comment with the words that a C text uses; nothing for a text that uses none."""
    found = [f"{word}: {meaning}" for word, sign, meaning in WORDS if re.search(sign, text)]
    if not found:
        return ""
    lines = [line for each in found for line in textwrap.wrap(
        f"{each}.", WIDTH, initial_indent="   ", subsequent_indent="       ", break_on_hyphens=False
    )]  # fmt: skip
    return "\n".join(["/* Words of this file", "", *lines, "*/", ""])
