"""Facts that the proofs assume about corner lists and states of effects, written into the emitted C as checks.

Two of them relate numbers of the whole list, which Eva's value sets cannot express. The last plays of the blocks fall
strictly from corner to corner, so there are no more corners than plays. And plays can only be so far apart, so sums of
products and ways of the input stay below the bound that the format was chosen by. Each check stands where the fact is
needed: Eva assumes it, and a run stops where it fails.
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

BEFORE = """
#include <stdint.h>
/*@ assigns \\nothing; ensures \\false; */
extern void not_granted(int line);
#define GRANTED(condition) do { if (!(condition)) { not_granted(__LINE__); } } while (0)
#define WITHIN(x, most) GRANTED((x) >= -(most) && (x) <= (most))
"""

# Pattern in the emitted C, number of occurrences, and replacement. The list of corners:
PLACES = [
    (
        r"(\w+ void NAME_leave_corner\([^{]*\{\n)",
        1,
        r"\1    GRANTED(here->depth < PLAYS);\n    WITHIN(here->output, HELD);\n",
    ),
    # Eva analyses the bisection separately for each number of corners
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

# Modules without a memoryless part, whose usual sample does not read the list
USUAL_PLACES = [
    (r"(    const uint32_t room = [^;]*;\n)", 1, r"\1    GRANTED(room <= WAY);\n"),
    (
        r"(        const int64_t w = here->rising \? here->input \+ step : here->input - step;\n)",
        1,
        r"\1        GRANTED(w >= LEAST && w <= MOST);\n",
    ),
    (
        r"(        const int64_t left = (?:NAME_inverse_left\(on, s->slope, way\)|on - [^;]*\(s->slope, way\));\n)",
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
    """The emitted C with the checks added; `sums` divides the bound of all sums."""
    parameters, name = model.parameters, model.parameters.name
    tables, form = build(
        model.cascade, arithmetic, "corners", parameters.emit.drive_lsb, parameters.emit.output_lsb
    )
    least, most = int(tables.limits.play.low[0]), int(tables.limits.play.high[0])
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


# In models with effects: bounds of states, and relations between two numbers. Eva's value sets widen a state until it
# overflows, and keep no relations. The reason for each bound:
# SIGNAL   signals between blocks stay in the range that the formats were chosen by
# CREEP    a state of creep is its weight times a weighted mean of all inputs, with no negative share; `creep.guard`
#          leaves 49 bits and the dropped ones for the sum of all states, plus one bit for rounding
# PART, WHOLE, GAINED   the clock of a drift counts a parabola over its samples exactly: `clock`
# RISE     self-heating adds no more in a sample than the highest temperature loses, which has RISE_BITS; one more bit
#          is for rounding
# RUBBED   a rubbing play stays between the extreme drives that it has seen
# AMOUNT   hence it moves by at most the distance of those drives in a step; the first n odd numbers add up to n^2
# INVERSE  a Newton step from x is `x (2 - g x)`, at most 1/g, and a gain is at least 1/2; 2 are for rounding
# PLAY     a viscous play moves towards the play without viscosity, so it stays between the start memory and the ends
#          of the input; a play that would come too near to another stops in between
# INPUT    a search stays between the ends that it begins with
# DRAWN    a play drawn by its input, at once or by a dashpot, ends between its old position and that input, and so
#          does an input that counts as standing still on its way
# ASKED    the drive asked of a lag is at most a third of the size that its states have room for
# MOVED    the drive asked of a lag in front of two branches moves at most from one end of the drives to the other
# COARSE   numbers in the search for a lead are limited to this, and the search begins with a size and a lead above it
# LOST     remainder of rounding to whole numbers
# PLAYS    the format has room for the sum of all plays, and the sum of those that stay is a part of it
# REST     remainder of rounding a rate-limited drive to a code, at most half a code
CLOCK = (
    r"    GRANTED(self->part >= 0 && self->part < PART);\n"
    r"    WITHIN(self->whole, WHOLE);\n    WITHIN(self->gained, GAINED);\n"
)
STATES = [
    (r"(NAME_sum_t NAME_creep_rest\([^{]*\{\n)", r"\1    WITHIN(x, SIGNAL);\n"),
    (r"(    return self->ahead;)", r"    WITHIN(self->ahead, SIGNAL);\n\1"),
    (r"(NAME_sum_t NAME_creep_absorb\([^{]*\{\n)", r"\1    WITHIN(x, SIGNAL);\n    WITHIN(self->before, SIGNAL);\n"),
    (r"(NAME_sum_t NAME_inverse_wanted\([^{]*\{\n)(?=[^}]*self->creep_1\.before \+)",
     r"\1    WITHIN(y, SIGNAL);\n    WITHIN(self->creep_1.before, SIGNAL);\n"
     r"    WITHIN(self->creep_1.ahead, SIGNAL);\n"),
    (r"(        const NAME_creep_term_t \*term = [^;]*;\n)", r"\1        WITHIN(state[i].next, CREEP);\n"),
    (r"(        const NAME_sum_t settled =[^;]*;\n)", r"\1        WITHIN(settled, CREEP);\n"),
    (r"(        (now|next) \+= state\[i\]\.next;\n)", r"\1        WITHIN(\2, CREEP);\n"),
    (r"(    self->ahead = direct \+ NAME_nearest\(next, t->bits\);\n)",
     r"\1    WITHIN(self->ahead, SIGNAL);\n    WITHIN(y, SIGNAL);\n"),
    (r"    return (NAME_nearest\(self->high - NAME_lag_scaled[^;]*|NAME_nearest\(reached, t->bits\));",
     r"    const int64_t arrives = \1;\n    WITHIN(arrives, DRIVE);\n    return arrives;"),
    (r"(NAME_sum_t NAME_lag_absorb\([^{]*\{\n)",
     r"\1    WITHIN(self->high, LAG);\n    WITHIN(self->asked, LAG);\n    WITHIN(self->lead, LAG);\n"),
    (r"(NAME_sum_t NAME_lag_solve\([^{]*\{\n)",
     r"\1    WITHIN(self->high, LAG);\n    WITHIN(self->wanted, LAG);\n"),
    (r"(int64_t NAME_lag_exact_(?:absorb|solve)\([^{]*\{\n)", r"\1    WITHIN(self->next, LAG);\n"),
    (r"((?:bool|int64_t) NAME_braked_(?:room|along)\([^{]*\{\n)",
     r"\1    WITHIN(self->earlier, ASKED);\n    WITHIN(self->lag.asked, ASKED);\n    WITHIN(self->lag.wanted, LAG);\n"
     r"    WITHIN(self->lag.high, LAG);\n"),
    (r"(NAME_sum_t NAME_steady_(?:solve|kept)\([^{]*\{\n)",
     r"\1    WITHIN(lag->asked, ASKED);\n    WITHIN(lag->high, LAG);\n    WITHIN(self->moved, MOVED);\n"),
    (r"(NAME_sum_t NAME_steady_braked\([^{]*\{\n)",
     r"\1    WITHIN(braked->earlier, ASKED);\n    WITHIN(braked->lag.wanted, LAG);\n"),
    (r"(        const int32_t middle = low \+ [^;]*;\n)",
     r"        GRANTED(low >= 0 && low <= high && high <= COARSE);\n\1        GRANTED(middle <= COARSE);\n"),
    (r"(NAME_sum_t NAME_mode_absorb\([^{]*\{\n)",
     r"\1    WITHIN(x, SIGNAL);\n    WITHIN(self->before, SIGNAL);\n    WITHIN(self->off, MODE);\n"
     r"    WITHIN(self->rate, MODE);\n"),
    (r"(    const NAME_sum_t change = \(NAME_sum_t\)sample\[[^;]*;\n)    return ([^;]*);",
     r"\1    const int64_t between = \2;\n    WITHIN(between, CODE);\n    return (NAME_reach_t)between;"),
    (r"(        const int64_t part = self->part[^;]*;\n)", CLOCK + r"\1"),
    (r"(    const int64_t more = \(t->slope[^;]*;\n)", CLOCK + r"\1"),
    (r"(        inverse = NAME_gain_product\(inverse,[^;]*;\n)",
     r"\1        GRANTED(inverse > 0 && inverse <= INVERSE);\n"),
    (r"(    const NAME_sum_t size = NAME_nearest\(amount[^;]*;\n)",
     r"    GRANTED(self->high >= 0 && self->high < RISE);\n\1"),
    (r"(    const NAME_sum_t way = NAME_heat_square\(v\)[^;]*;\n)",
     r"    WITHIN(v, CODE);\n    WITHIN(before, CODE);\n\1"),
    (r"            state\[i\]\.at = \(int32_t\)\((x [-+] r)\);\n",
     r"            const int64_t to = \1;\n            WITHIN(to, RUBBED);\n            state[i].at = (int32_t)to;\n"),
    (r"(        amount \+= [^;]*;\n)", r"\1        GRANTED(amount >= 0 && amount <= AMOUNT);\n"),
    (r"(NAME_sum_t NAME_\w+_displaced\([^{]*\{\n)", r"\1    WITHIN(y, SIGNAL);\n"),
    (r"            return \(NAME_play_t\)(low|high);\n",
     r"            WITHIN(\1, PLAY);\n            return (NAME_play_t)\1;\n"),
    (r"(    const NAME_play_t left = ramp->rest \+ more;\n)", r"    WITHIN(ramp->rest, REST);\n\1"),
    (r"(    return \(NAME_play_t\)rest;\n)", r"    WITHIN(rest, PLAY);\n\1"),
    (r"(        const int64_t z = play\[i\] \+ NAME_times[^;]*;\n)", r"\1        WITHIN(z, PLAY);\n"),
    (r"(void NAME_put\([^{]*\{\n)", r"\1    WITHIN(z, PLAY);\n"),
    (r"(            \(void\)NAME_move\(i, self->play, x, w\);\n)", r"\1            WITHIN(self->play[i], PLAY);\n"),
    (r"(        self->staying (?:-=|= sum -) [^;]*;\n)", r"\1        WITHIN(self->staying, PLAYS);\n"),
    (r"(    NAME_sum_t sum = [^;]* self->staying;\n)", r"\1    WITHIN(sum, PLAYS);\n"),
    (r"(        sum \+= [^;]* NAME_bent\(i, NAME_resting\([^;]*;\n)", r"\1        WITHIN(sum, PLAYS);\n"),
    (r"(    const uint16_t curve = NAME_bump_of\[i\];\n)", r"\1    /*@ split curve; */\n"),  # curve by curve
    (r"(    const NAME_sum_t lost = [^;]*;\n)", r"\1    WITHIN(lost, LOST);\n"),
    (r"(    search->prior = search->input;\n)", r"    WITHIN(next, INPUT);\n\1"),
    (r"    return \(NAME_play_t\)\((w > play \? [^;]*|(?:play\[i\]|x) \+\s+NAME_[^;]*)\);\n",
     r"    const int64_t drawn = \1;\n    WITHIN(drawn, DRAWN);\n    return (NAME_play_t)drawn;\n"),
    # not facts: where Eva should stop widening, and what it should analyse case by case
    (r"(    for \(i = 0; i < t->n; \+\+i\) \{\n        const NAME_sum_t r)", r"    /*@ loop unroll 17; */\n\1"),
    (r"(    for \(bits = \w+; bits > 0; bits /= 2u\) \{\n)", r"    /*@ loop unroll 6; */\n\1"),
    (r"(        const bool before = inside < ([^;]*);\n)", r"        /*@ split inside < \2; */\n\1"),
]  # fmt: skip


def clock(table: tuple[int, ...]) -> dict[str, int]:
    """Largest counts of a clock with this table: those of a parabola over its samples, at its turn and at its end."""
    slope, change, samples, _, bits, *_ = table
    turn = -slope // change if change else 0
    counts = [samples, *(n for n in range(turn, turn + 3) if 0 <= n <= samples)]
    farthest = max(abs(slope * n + change * (n * (n - 1) // 2)) for n in counts)
    return {"PART": 2**bits, "WHOLE": (farthest >> bits) + 1, "GAINED": abs(change) * samples}


def granted_states(text: str, compiled: Compiled, name: str, wrong: str = "") -> str:
    """The emitted C of a model with effects with the checks that its blocks need; `wrong` names a bound to divide by
    64."""
    t, codes = compiled.tables, compiled.codes
    assert codes is not None

    def most(dropped: NDArray[np.int64], bits: int) -> int:
        return 2 ** (bits + int(np.max(dropped, initial=0)))

    ends = [int(t.plays.limits.play.low[0]), int(t.plays.limits.play.high[0]), *t.plays.start.tolist()]
    drive = max(map(abs, t.plays.limits.drive[0].tolist())) * 2 ** int(t.number.arriving_bits[0])
    led = most(t.of("lag").led.drop, 50)
    rubbed = int(t.limits.code_max[0]) * most(t.of("heat").friction.bits, 0)
    numbers = {
        "SIGNAL": codes.largest, "CODE": int(t.limits.code_max[0]),
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
