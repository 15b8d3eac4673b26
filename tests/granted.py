"""What proofs take for granted, written into the emitted C: of a corner list, and of the states of effects.

Two facts are relations between numbers of the whole list, which Eva's sets of values cannot hold: the last plays of the
blocks fall strictly from corner to corner, so that there are no more corners than plays; and a sum of products, or a
way, is one of plays that can be so far apart, so that it stays below the bound that the format was chosen by. Here they
become checks at the places where they are needed: Eva takes each for true, a run stops where one is not.
"""

from __future__ import annotations

import re

from hystgen.compensator.chain.layout import ARRIVING_BITS, Compiled
from hystgen.compensator.fixed_tables import build
from hystgen.effects.creep import fixed as creep
from hystgen.effects.lag import fixed as lag
from hystgen.effects.resonance import fixed as resonance
from hystgen.model import Model
from hystgen.plays.slots import CODE_MAX, PLAY_MAX, PLAY_MIN

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


# In models with effects: what states of filters stay within, by the range analysis that their formats were chosen by,
# and a drive between two others. Eva's sets of values widen a filter's state until it overflows.
STATES = [
    (r"(int64_t NAME_creep_rest\([^{]*\{\n)", r"\1    WITHIN(x, SIGNAL);\n"),
    (r"(    return self->ahead;)", r"    WITHIN(self->ahead, SIGNAL);\n\1"),
    (r"(int64_t NAME_creep_absorb\([^{]*\{\n)", r"\1    WITHIN(x, SIGNAL);\n    WITHIN(self->before, SIGNAL);\n"),
    (r"(int64_t NAME_creep_solve\([^{]*\{\n)",
     r"\1    WITHIN(y, SIGNAL);\n    WITHIN(self->before, SIGNAL);\n    WITHIN(self->ahead, SIGNAL);\n"),
    (r"(        const NAME_creep_term_t \*term = [^\n]*\n)", r"\1        WITHIN(state[i].next, CREEP);\n"),
    (r"    return direct \+ now;",
     r"    const int64_t y = direct + now;\n    WITHIN(self->ahead, SIGNAL);\n    WITHIN(y, SIGNAL);\n    return y;"),
    (r"    return (NAME_nearest\((?:self->high - NAME_lag_scaled[^;]*|reached), t->bits\));",
     r"    const int64_t arrives = \1;\n    WITHIN(arrives, DRIVE);\n    return arrives;"),
    (r"(int64_t NAME_lag_absorb\([^{]*\{\n)",
     r"\1    WITHIN(self->high, LAG);\n    WITHIN(self->asked, LAG);\n    WITHIN(self->lead, LAG);\n"),
    (r"(int64_t NAME_lag_solve\([^{]*\{\n)",
     r"\1    WITHIN(self->high, LAG);\n    WITHIN(self->wanted, LAG);\n"),
    (r"(int64_t NAME_lag_exact_(?:absorb|solve)\([^{]*\{\n)", r"\1    WITHIN(self->next, LAG);\n"),
    (r"(int64_t NAME_mode_absorb\([^{]*\{\n)",
     r"\1    WITHIN(x, SIGNAL);\n    WITHIN(self->before, SIGNAL);\n    WITHIN(self->off, MODE);\n"
     r"    WITHIN(self->rate, MODE);\n"),
    (r"(    const int64_t change = \(int64_t\)sample\[[^\n]*\n)    return ([^;]*);",
     r"\1    const int64_t between = \2;\n    WITHIN(between, CODE);\n    return (NAME_reach_t)between;"),
]  # fmt: skip


def granted_states(text: str, compiled: Compiled, name: str) -> str:
    """The emitted C of a model with effects with the checks in it that its blocks need."""
    t, codes = compiled.tables, compiled.codes
    assert codes is not None

    def most(rows: list[list[int]], place: int, bits: int) -> int:
        return 2 ** (bits + max((int(row[place]) for row in rows), default=0))

    numbers = {
        "SIGNAL": codes.largest, "CODE": int(t.limits[CODE_MAX]),
        "DRIVE": max(map(abs, t.plays.limits[:2].tolist())) * 2 ** int(t.number[ARRIVING_BITS]),
        "CREEP": most(t.creep.block.tolist(), creep.DROP, 49), "LAG": most(t.lag.block.tolist(), lag.DROP, 50),
        "MODE": most(t.mode.tolist(), resonance.DROP, 50),
    }  # fmt: skip
    for pattern, replacement in STATES:
        filled = re.sub(
            r"\b(" + "|".join(numbers) + r")\b", lambda found: f"INT64_C({numbers[found[1]]})",
            replacement.replace("NAME", name),
        )  # fmt: skip
        text = re.sub(pattern.replace("NAME", name), filled, text)
    return BEFORE + text
