"""What proofs take for granted, written into the emitted C: of a corner list, and of the states of effects.

Two facts are relations between numbers of the whole list, which Eva's sets of values cannot hold: the last plays of the
blocks fall strictly from corner to corner, so that there are no more corners than plays; and a sum of products, or a
way, is one of plays that can be so far apart, so that it stays below the bound that the format was chosen by. Here they
become checks at the places where they are needed: Eva takes each for true, a run stops where one is not.
"""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import NDArray

from hystgen.compensator.chain.layout import Compiled
from hystgen.compensator.fixed_tables import build
from hystgen.effects.lag import fixed as lag
from hystgen.effects.thermal import fixed as thermal
from hystgen.effects.thermal.compensator import FRICTION_PLAYS
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


# In models with effects: what states stay within, and relations between two numbers. Eva's sets of values widen a state
# until it overflows, and keep no relation. Where each fact comes from:
# SIGNAL   the range analysis that the formats were chosen by, for what goes from block to block
# CREEP    a state of creep is its weight times a mean of all inputs with no share below 0; `creep.guard` leaves 49 bits
#          and those dropped for the sum of all states, and a bit more is for rounding
# PART, WHOLE, GAINED   the clock of a drift counts a parabola over its samples exactly: `clock`
# RISE     own heat adds no more in a sample than the warmest temperature loses, which has RISE_BITS; a bit more is for
#          rounding
# RUBBED   a play that rubs stays between the drives that it has seen
# AMOUNT   so that none goes farther than from one to the other in a step; the first n odd numbers are n^2 in all
# INVERSE  a step of Newton's from x is `x (2 - g x)`, at most 1/g, and a gain is at least 1/2; 2 are for rounding
# PLAY     a viscous play goes towards one that its input drags along, so that it stays between the start memory and the
#          input's ends; one that would come too near to another stops in between
# INPUT    halves lie between the ends that a search begins with
# DRAWN    a play that its input draws along, at once or by a dashpot, ends between where it was and that input, and so
#          does an input that counts as standing still on its way
# ASKED    what is asked of a lag, a third of the size that its states were given room for at most
# MOVED    what is asked of a lag in front of two branches moves from end to end of the drives at most
# COARSE   numbers that a lead is searched with are cut off there, and the search begins with a size and a lead above it
# LOST     what rounding to whole numbers leaves
# PLAYS    the format was chosen by the sum of all plays, of which those that stay are a part
# REST     what rounding to a code leaves of a drive at a limited rate, at most half of one
CLOCK = (
    r"    GRANTED(self->part >= 0 && self->part < PART);\n"
    r"    WITHIN(self->whole, WHOLE);\n    WITHIN(self->gained, GAINED);\n"
)
STATES = [
    (r"(int64_t NAME_creep_rest\([^{]*\{\n)", r"\1    WITHIN(x, SIGNAL);\n"),
    (r"(    return self->ahead;)", r"    WITHIN(self->ahead, SIGNAL);\n\1"),
    (r"(int64_t NAME_creep_absorb\([^{]*\{\n)", r"\1    WITHIN(x, SIGNAL);\n    WITHIN(self->before, SIGNAL);\n"),
    (r"(int64_t NAME_creep_solve\([^{]*\{\n)",
     r"\1    WITHIN(y, SIGNAL);\n    WITHIN(self->before, SIGNAL);\n    WITHIN(self->ahead, SIGNAL);\n"),
    (r"(        const NAME_creep_term_t \*term = [^;]*;\n)", r"\1        WITHIN(state[i].next, CREEP);\n"),
    (r"(        const int64_t settled =[^;]*;\n)", r"\1        WITHIN(settled, CREEP);\n"),
    (r"(        (now|next) \+= state\[i\]\.next;\n)", r"\1        WITHIN(\2, CREEP);\n"),
    (r"(    self->ahead = direct \+ NAME_nearest\(next, t->bits\);\n)",
     r"\1    WITHIN(self->ahead, SIGNAL);\n    WITHIN(y, SIGNAL);\n"),
    (r"    return (NAME_nearest\((?:self->high - NAME_lag_scaled[^;]*|reached), t->bits\));",
     r"    const int64_t arrives = \1;\n    WITHIN(arrives, DRIVE);\n    return arrives;"),
    (r"(int64_t NAME_lag_absorb\([^{]*\{\n)",
     r"\1    WITHIN(self->high, LAG);\n    WITHIN(self->asked, LAG);\n    WITHIN(self->lead, LAG);\n"),
    (r"(int64_t NAME_lag_solve\([^{]*\{\n)",
     r"\1    WITHIN(self->high, LAG);\n    WITHIN(self->wanted, LAG);\n"),
    (r"(int64_t NAME_lag_exact_(?:absorb|solve)\([^{]*\{\n)", r"\1    WITHIN(self->next, LAG);\n"),
    (r"((?:bool|int64_t) NAME_braked_(?:room|along)\([^{]*\{\n)",
     r"\1    WITHIN(self->earlier, ASKED);\n    WITHIN(self->lag.asked, ASKED);\n    WITHIN(self->lag.wanted, LAG);\n"
     r"    WITHIN(self->lag.high, LAG);\n"),
    (r"(int64_t NAME_steady_(?:solve|kept)\([^{]*\{\n)",
     r"\1    WITHIN(lag->asked, ASKED);\n    WITHIN(lag->high, LAG);\n    WITHIN(self->moved, MOVED);\n"),
    (r"(int64_t NAME_steady_braked\([^{]*\{\n)",
     r"\1    WITHIN(braked->earlier, ASKED);\n    WITHIN(braked->lag.wanted, LAG);\n"),
    (r"(        const int32_t middle = low \+ [^;]*;\n)",
     r"        GRANTED(low >= 0 && low <= high && high <= COARSE);\n\1        GRANTED(middle <= COARSE);\n"),
    (r"(int64_t NAME_mode_absorb\([^{]*\{\n)",
     r"\1    WITHIN(x, SIGNAL);\n    WITHIN(self->before, SIGNAL);\n    WITHIN(self->off, MODE);\n"
     r"    WITHIN(self->rate, MODE);\n"),
    (r"(    const int64_t change = \(int64_t\)sample\[[^;]*;\n)    return ([^;]*);",
     r"\1    const int64_t between = \2;\n    WITHIN(between, CODE);\n    return (NAME_reach_t)between;"),
    (r"(        const int64_t part = self->part[^;]*;\n)", CLOCK + r"\1"),
    (r"(    const int64_t more = \(t->slope[^;]*;\n)", CLOCK + r"\1"),
    (r"(        inverse = \(inverse \* more \+ half\)[^;]*;\n)",
     r"\1        GRANTED(inverse > 0 && inverse <= INVERSE);\n"),
    (r"(    const int64_t size = NAME_nearest\(amount[^;]*;\n)",
     r"    GRANTED(self->rise >= 0 && self->rise < RISE);\n\1"),
    (r"(    const int64_t way = NAME_heat_square\(v\)[^;]*;\n)",
     r"    WITHIN(v, CODE);\n    WITHIN(before, CODE);\n\1"),
    (r"(            to = x \+ r;\n        \}\n)", r"\1        WITHIN(to, RUBBED);\n"),
    (r"(        amount \+= [^;]*;\n)", r"\1        GRANTED(amount >= 0 && amount <= AMOUNT);\n"),
    (r"(NAME_sum_t NAME_\w+_displaced\([^{]*\{\n)", r"\1    WITHIN(y, SIGNAL);\n"),
    (r"            return \(NAME_play_t\)(low|high);\n",
     r"            WITHIN(\1, PLAY);\n            return (NAME_play_t)\1;\n"),
    (r"(    const NAME_play_t left = ramp->rest \+ more;\n)", r"    WITHIN(ramp->rest, REST);\n\1"),
    (r"(    return \(NAME_play_t\)rest;\n)", r"    WITHIN(rest, PLAY);\n\1"),
    (r"(        const int64_t z = play\[i\] \+ NAME_times[^;]*;\n)", r"\1        WITHIN(z, PLAY);\n"),
    (r"(void NAME_put\([^{]*\{\n)", r"\1    WITHIN(z, PLAY);\n"),
    (r"(            NAME_move\(i, self->play, x, w\);\n)", r"\1            WITHIN(self->play[i], PLAY);\n"),
    (r"(        self->staying (?:-=|= sum -) [^;]*;\n)", r"\1        WITHIN(self->staying, PLAYS);\n"),
    (r"(    NAME_sum_t sum = [^;]* self->staying;\n)", r"\1    WITHIN(sum, PLAYS);\n"),
    (r"(        sum \+= [^;]* NAME_bent\(i, NAME_resting\([^;]*;\n)", r"\1        WITHIN(sum, PLAYS);\n"),
    (r"(    const NAME_bump_t \*c = &NAME_bump\[)(NAME_bump_of\[i\])(\];\n)",  # curve by curve
     r"    const unsigned int which = \2;\n    /*@ split which; */\n\1which\3"),
    (r"(    const NAME_sum_t lost = [^;]*;\n)", r"\1    WITHIN(lost, LOST);\n"),
    (r"(        next = search->low \+ [^;]*;\n)", r"\1        WITHIN(next, INPUT);\n"),
    (r"    return \(NAME_play_t\)\((w > play \? [^;]*|(?:play\[i\]|x) \+\s+NAME_[^;]*)\);\n",
     r"    const int64_t drawn = \1;\n    WITHIN(drawn, DRAWN);\n    return (NAME_play_t)drawn;\n"),
    # no facts, but where Eva is to stop widening, and what it is to look at case by case
    (r"(    for \(bits = \w+; bits > 0; bits /= 2u\) \{\n)", r"    /*@ loop unroll 6; */\n\1"),
    (r"(        const bool before = inside < ([^;]*);\n)", r"        /*@ split inside < \2; */\n\1"),
]  # fmt: skip


def clock(table: tuple[int, ...]) -> dict[str, int]:
    """What a clock with this table counts to at most: a parabola over its samples, where it turns and where it ends."""
    slope, change, samples, _, bits, *_ = table
    turn = -slope // change if change else 0
    counts = [samples, *(n for n in range(turn, turn + 3) if 0 <= n <= samples)]
    farthest = max(abs(slope * n + change * (n * (n - 1) // 2)) for n in counts)
    return {"PART": 2**bits, "WHOLE": (farthest >> bits) + 1, "GAINED": abs(change) * samples}


def granted_states(text: str, compiled: Compiled, name: str, wrong: str = "") -> str:
    """The emitted C of a model with effects with the checks in it that its blocks need; `wrong`: a number of which a
    64th is taken."""
    t, codes = compiled.tables, compiled.codes
    assert codes is not None

    def most(dropped: NDArray[np.int64], bits: int) -> int:
        return 2 ** (bits + int(np.max(dropped, initial=0)))

    ends = [*t.plays.limits[[PLAY_MIN, PLAY_MAX]].tolist(), *t.plays.start.tolist()]
    drive = max(map(abs, t.plays.limits[:2].tolist())) * 2 ** int(t.number.arriving_bits[0])
    led = most(t.of("lag").led.drop, 50)
    rubbed = int(t.limits[CODE_MAX]) * most(t.of("heat").friction.bits, 0)
    numbers = {
        "SIGNAL": codes.largest, "CODE": int(t.limits[CODE_MAX]),
        "DRIVE": drive,
        "CREEP": most(t.of("creep").block.drop, 50) - 1, "LAG": led, "ASKED": led // 3,
        "COARSE": lag.COARSE, "MOVED": 2 * drive + 2, "MODE": most(t.of("mode").drop, 50),
        **(clock(t.of("clock")[0].tolist()) if t.number_of("clock") else {}),
        "RISE": 2 ** (thermal.RISE_BITS + 1), "INVERSE": 2 * thermal.ONE + 2, "PLAY": max(map(abs, ends)),
        "RUBBED": rubbed, "AMOUNT": 2 * rubbed * FRICTION_PLAYS**2,
        "INPUT": int(t.moving.farthest), "LOST": 2 ** int(t.moving.yield_bits) // 2,
        "PLAYS": (int(t.number.largest_level[0]) + 1) << int(t.number.level_drop[0]), "REST": 2**29,
        "DRAWN": max(int(t.moving.farthest), *map(abs, ends)),
    }  # fmt: skip
    if wrong:
        numbers[wrong] //= 64
    for pattern, replacement in STATES:
        filled = re.sub(
            r"\b(" + "|".join(numbers) + r")\b", lambda found: f"INT64_C({numbers[found[1]]})",
            replacement.replace("NAME", name),
        )  # fmt: skip
        text = re.sub(pattern.replace("NAME", name), filled, text)
    return BEFORE + text
