"""What the proof of the `corners` engine takes for granted of a corner list, written into the emitted C.

Why a list never has more corners than plays, or a sum stays below its bound, are relations between numbers of the whole
list that Eva's sets of values cannot hold. Here they become checks at the places where they are needed: Eva takes each
for true, a run stops where one is not.
"""

from __future__ import annotations

import re

from hystgen.api import Model
from hystgen.fixed import FINE, PLAY_MAX, PLAY_MIN
from hystgen.fixed_tables import build

BEFORE = """
#include <stdint.h>
/*@ assigns \\nothing; ensures \\false; */
extern void not_granted(int line);
#define GRANTED(condition) do { if (!(condition)) { not_granted(__LINE__); } } while (0)
#define WITHIN(x, most) GRANTED((x) >= -(most) && (x) <= (most))
"""

# What stands in the emitted C, how often, and what takes its place
PLACES = [
    # the bound of all sums holds, and a move has gone on from its anchor by no more than the range, twice the largest
    # threshold or the input itself
    (
        r"    return m->here\.anchor_output \+ \(\(NAME_sum_t\)m->w - m->here\.anchor\) \* t->slope\[m->here\.k\];",
        1,
        r"""    const NAME_sum_t way = (NAME_sum_t)m->w - m->here.anchor;
    NAME_sum_t sum;
    WITHIN(way, WAY);
    WITHIN(m->here.anchor_output, SUM);
    sum = m->here.anchor_output + way * t->slope[m->here.k];
    WITHIN(sum, SUM);
    return sum;""",
    ),
    # where a corner is left, a play is held by it; there are no more corners than plays
    (r"(    if \(depth > 0\) \{\n)", 1, r"\1        GRANTED(k >= 1 && k <= PLAYS && depth <= PLAYS);\n"),
    (r"(        takes_along = depth > 0 && NAME_past\()", 1, r"        GRANTED(depth <= PLAYS);\n\1"),
    (r"(    if \(takes_along\) \{\n)", 1, r"    GRANTED(depth <= PLAYS);\n\1"),
    (r"(static void NAME_leave_corner\([^{]*\{\n)", 1, r"\1    GRANTED(m->here.depth < PLAYS);\n"),
    (
        r"        here = m->here\.k > 1 \? (corner\[m->here\.depth\]\.output) : (NAME_corners_output\(t, m\));",
        1,
        r"""        if (m->here.k > 1) {
            GRANTED(m->here.depth < PLAYS);
            here = \1;
        } else {
            here = \2;
        }""",
    ),
    # no more plays follow than there are
    (r"(    p->k = \(uint_least16_t\)k;)", 3, r"    GRANTED(k <= PLAYS + 1);\n\1"),
    # a block ends beyond the play it begins with
    (
        r"(        const NAME_corner_t \*c = &corner\[(?:probe - 1|left - 1|middle)\];\n)",
        4,
        r"\1        GRANTED(c->end >= 2 && c->end <= PLAYS + 1);\n",
    ),
    # a play that follows has been held by a corner
    (
        r"    return left == 0 \|\| \(left < depth && corner\[left\]\.end == k\) \? &corner\[left\] : "
        r"&corner\[left - 1\];",
        1,
        r"""    GRANTED(depth <= PLAYS);
    if (left == 0 || (left < depth && corner[left].end == k)) {
        return &corner[left];
    }
    return &corner[left - 1];""",
    ),
    # bisection is looked at for each number of corners on its own
    (
        r"(    unsigned int low = 0;\n    unsigned int left = depth;)",
        2,
        r"    GRANTED(depth <= PLAYS);\n    /*@ split depth; */\n\1",
    ),
]

# Of modules without a memoryless part, whose usual sample does not look at the list
FAST_PLACES = [
    # the line that a move follows
    (
        r"(    int64_t last = p->next_output;\n)",
        1,
        r"""\1    const int64_t way = (int64_t)w - (int64_t)p->anchor;
    WITHIN(way, WAY);
    WITHIN(p->anchor, 2 * WAY);
    WITHIN(p->anchor_output, SUM);
""",
    ),
    (
        r"(self->output = p->anchor_output [+-] )(\(int64_t\)NAME_wide\(\(uint32_t\)slope, .*\));",
        2,
        r"GRANTED(\2 <= INT64_MAX - SUM);\n        \1\2;\n        WITHIN(self->output, SUM);",
    ),
    # between the edges there is such a line, and w goes on by less than 2^31 on it, inside the range
    (
        r"(    if \(u > self->edge\[0\] && u < self->edge\[1\]\) \{[^\n]*\n)",
        1,
        r"\1        WITHIN(self->output, SUM);\n        GRANTED(self->shift > 0);\n",
    ),
    (r"(            const int32_t step = \(int32_t\)(\(.*\));)", 1, r"            GRANTED(\2 <= INT32_MAX);\n\1"),
    (
        r"const NAME_play_t there = self->falling \? w - step : w \+ step;",
        1,
        r"""const int64_t far = self->falling ? (int64_t)w - step : (int64_t)w + step;
            GRANTED(far >= LEAST && far <= MOST);
            const NAME_play_t there = (NAME_play_t)far;""",
    ),
    (
        r"(const int64_t moved = .*\(uint32_t\))\(self->falling \? w - seen : seen - w\)\);",
        1,
        r"""const int64_t on_w = self->falling ? (int64_t)w - seen : (int64_t)seen - w;
            GRANTED(on_w >= -STEPS && on_w <= INT32_MAX);
            \1on_w);""",
    ),
    (r"(self->output = self->falling \? .*;)", 1, r"\1\n            WITHIN(self->output, SUM);"),
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
        "SUM": form.largest_sum // sums, "WAY": way, "LEAST": least, "MOST": most,
        "PLAYS": model.cascade.pi.n, "STEPS": 2 ** int(tables.limits[FINE]),
    }  # fmt: skip
    places = [*PLACES, *(FAST_PLACES if f"{name}_inverse_enter_fast" in text else [])]
    for pattern, count, replacement in places:
        filled = re.sub(
            r"\b(" + "|".join(numbers) + r")\b",
            lambda found: str(numbers[found[1]]) if found[1] in ("PLAYS", "STEPS") else f"INT64_C({numbers[found[1]]})",
            replacement.replace("NAME", name),
        )
        text, found = re.subn(pattern.replace("NAME", name), filled, text)
        assert found == count, (pattern, found)
    return BEFORE + text
