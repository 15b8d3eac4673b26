"""What the proof of the `corners` engine takes for granted of a corner list, written into the emitted C.

Two facts are relations between numbers of the whole list, which Eva's sets of values cannot hold: the last plays of the
blocks fall strictly from corner to corner, so that there are no more corners than plays; and a sum of products, or a
way, is one of plays that can be so far apart, so that it stays below the bound that the format was chosen by. Here they
become checks at the places where they are needed: Eva takes each for true, a run stops where one is not.
"""

from __future__ import annotations

import re

from hystgen.compensator.fixed_tables import build
from hystgen.model import Model
from hystgen.plays.slots import PLAY_MAX, PLAY_MIN

BEFORE = """
#include <stdint.h>
/*@ assigns \\nothing; ensures \\false; */
extern void not_granted(int line);
#define GRANTED(condition) do { if (!(condition)) { not_granted(__LINE__); } } while (0)
#define WITHIN(x, most) GRANTED((x) >= -(most) && (x) <= (most))
"""

# What stands in the emitted C, how often, and what takes its place. The list:
PLACES = [
    (
        r"(\w+ void NAME_leave_corner\([^{]*\{\n)",
        1,
        r"\1    GRANTED(here->depth < PLAYS);\n    WITHIN(here->output, HELD);\n",
    ),
    # bisection is looked at for each number of corners on its own
    (r"(    unsigned int left = here->depth;\n    unsigned int k = here->k;\n)", 1, r"\1    /*@ split left; */\n"),
    # sums and ways
    (r"(    kink->output = NAME_begins\(.*;\n)", 1, r"\1    WITHIN(kink->output, SUM);\n"),
    (
        r"(    const int64_t way = NAME_along\(here, to\) - kink->input;\n)",
        1,
        r"\1    GRANTED(way <= WAY);\n",
    ),
    (r"(    here->output = NAME_along\(here, kink->output.*;\n)", 1, r"\1    WITHIN(here->output, SUM);\n"),
    (r"(        const int64_t moved = \(int64_t\)NAME_wide\(.*;\n)", 1, r"        GRANTED(way <= WAY);\n\1"),
    (r"(        here->output = here->rising \? here->output .*;\n)", 1, r"\1        WITHIN(here->output, SUM);\n"),
]

# Of modules without a memoryless part, whose usual sample does not look at the list
USUAL_PLACES = [
    (r"(    const uint32_t room = [^;]*;\n)", 1, r"\1    GRANTED(room <= WAY);\n"),
    (
        r"(        const int64_t w = here->rising \? here->input \+ step : here->input - step;\n)",
        1,
        r"\1        GRANTED(w >= LEAST && w <= MOST);\n",
    ),
    (
        r"(        const int64_t left = NAME_inverse_left\(on, s->slope, way\);\n)",
        1,
        r"        GRANTED(way <= WAY);\n\1",
    ),
    (r"(        here->output = here->rising \? output .*;\n)", 1, r"\1        WITHIN(here->output, SUM);\n"),
    (
        r"(        const int64_t way = \(int64_t\)self->here\.input - self->before;\n)",
        1,
        r"\1        WITHIN(way, WAY);\n",
    ),
    (r"(        self->undo\.output -= .*;\n)", 1, r"\1        WITHIN(self->undo.output, SUM);\n"),
]


def granted(text: str, model: Model, arithmetic: str, sums: int = 1) -> str:
    """The emitted C with the checks in it; `sums` divides the bound of all sums."""
    parameters, name = model.parameters, model.parameters.name
    tables, form = build(
        model.cascade, arithmetic, "corners", parameters.emit.drive_lsb, parameters.emit.output_lsb
    )
    least, most = int(tables.limits[PLAY_MIN]), int(tables.limits[PLAY_MAX])
    ends = [least, most, *map(int, tables.start)]
    way = max(max(ends) - min(ends), 2 * int(tables.threshold[-1]), *map(abs, ends))
    numbers = {
        "SUM": form.largest_sum // sums, "HELD": form.largest_held, "WAY": way, "LEAST": least, "MOST": most,
        "PLAYS": model.cascade.pi.n,
    }  # fmt: skip
    usual = USUAL_PLACES if f"{name}_inverse_look_ahead(" in text else []
    places = [*PLACES, *usual]
    for pattern, count, replacement in places:
        filled = re.sub(
            r"\b(" + "|".join(numbers) + r")\b",
            lambda found: str(numbers[found[1]]) if found[1] == "PLAYS" else f"INT64_C({numbers[found[1]]})",
            replacement.replace("NAME", name),
        )
        text, found = re.subn(pattern.replace("NAME", name), filled, text)
        assert found == count, (pattern, found)
    return BEFORE + text
