"""Mutants of the run time: small faults that `verify` has to find, and equivalent mutants.

Change them together with the sources: `old` must occur in the file, once unless `count` says otherwise.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

from modelfiles import BRAKED, CALM, CHAINS, CODED, FILES, LED, PLAYS, STEADY, head

ALONE = "hystgen/effects/slew_limit/slewed.c"
CODES = "c_runtime/compensator/code.c"
CONVERTER = "c_runtime/compensator/converter.c"
FINER = "c_runtime/front/front.c"
CORNERS = "c_runtime/plays/corners_fixed.c"
USUAL = "c_runtime/compensator/corners/inverse_fixed.c"
FRONT = "c_runtime/compensator/corners/inverse_front_fixed.c"
FLOAT = "c_runtime/plays/corners_float.c"
INVERSE = "c_runtime/compensator/corners/inverse.c"
FLOAT_FRONT = "c_runtime/compensator/corners/inverse_front.c"
CURVE = "c_runtime/front/curve.c"
CHAIN = "c_runtime/compensator/chain/corners_fixed.c"
CHAIN_FINER = "c_runtime/compensator/chain/refined_input.c"
CHAIN_FLOAT = "c_runtime/compensator/chain/corners_float.c"
TURN = "c_runtime/compensator/drive.c"
LAG = "hystgen/effects/lag/steady.c"

ROUND = """
  pi:
    thresholds: [0, 0.5, 1, 1.5, 2, 2.5, 2.75]
    weights: [0.72, 0.6, 0.48, 0.36, 0.24, 0.12, 0.012]
"""
STEEP = """
  pi:
    thresholds: [0, 0.45, 0.9, 1.35]
    weights: [0.05, 0.5, 1.5, 0.3]
"""
FLAT = PLAYS + "    initial_state: {}\n  memoryless: {{kind: tanh, ascending: {{a0: 6, a1: 1, a2: 0.1, a3: 0.2}}}}\n"

MODELS = {
    **FILES,
    **CHAINS,
    **LED,
    "steady": STEADY,
    "braked": BRAKED,
    "calm": CALM,
    **CODED,
    # the plays that start lowest begin to follow right at the limit
    "edge": head("edge", 1, 6) + PLAYS + "    initial_state: [0, 1.45, 1.9, 1.9, 1.9, 1.9, 1.9]\n",
    # from plays at 0, after a reset, all follow right at the limit
    "reset_low": head("reset_low", -2.75, 6) + ROUND + "    initial_state: -2\n",
    # drive codes so coarse that rounding skips the place where a steep play starts to follow
    "coarse": head("coarse") + STEEP + "emit: {drive_lsb: 0.0371}\n",
    "coarse_listed": head("coarse_listed")
    + PLAYS
    + "    initial_state: [0, 0.3, 0.1, -0.2, 0.3, 0.5, 0.1]\nemit: {drive_lsb: 0.0371}\n",
    # the last drive code and the largest output of the envelope lie less than half a code apart
    "flat_high": head("flat_high") + FLAT.format("6") + "emit: {drive_lsb: 1.3}\n",
    "flat_low": head("flat_low") + FLAT.format("-5.7") + "emit: {drive_lsb: 1.3}\n",
    # a reset leads beyond the range of the output codes, in the second model only at high drives
    "far_low": head("far_low", 0, 1)
    + "\n  pi: {thresholds: [0, 200], weights: [1, 1], initial_state: 50}\n  output_offset: -50\n",
    "near_high": head("near_high", 0, 10)
    + "\n  pi: {thresholds: [0, 200], weights: [1, 1], initial_state: -5}\n  output_offset: 5\n",
}


@dataclass(frozen=True)
class Mutant:
    """A change of one file, and a model and an arithmetic in which it shows."""

    what: str
    file: str
    old: str
    new: str
    model: str
    arithmetic: str
    engine: str = "corners"
    count: int = 1


KILLED = (
    Mutant(
        "a code of the drive is not committed", CONVERTER,
        "    hystgen_inverse_commit(self, hystgen_clamp_drive(hystgen_drive_from_code(sent)));\n",
        "    hystgen_inverse_commit(self, drive);\n",
        "coded", "float32",
    ),
    Mutant(
        "a drive's code is cut off", CONVERTER,
        "    return part + part < 1 ? whole : whole + 1;", "    return whole;",
        "coded", "float32",
    ),
    Mutant(
        "a code beyond the converter's is used", CONVERTER,
        "    return above > most ? most : above;", "    return above;",
        "coded", "q15",
    ),
    Mutant(
        "a drive's code beyond the range is committed as it is", CONVERTER,
        "hystgen_clamp_drive(hystgen_drive_from_code(sent))", "hystgen_drive_from_code(sent)",
        "coded", "float32",
    ),
    Mutant("a limit keeps no status", USUAL, "if (self->bits == 0) {", "if (self->bits < 8u) {", "outside", "q31"),
    Mutant(
        "a usual step is not taken back, float", INVERSE,
        "if (self->before < m->here.input || self->before > m->here.input) {",
        "if (self->before < m->here.input) {",
        "plain", "float32",
    ),
    Mutant(
        "a block beyond the limit is passed", FLOAT,
        "hystgen_above(s->reach, room) ?",
        "hystgen_above(s->reach, room + room) ?",
        "above", "float32",
    ),
    Mutant(
        "the limit is met late", FLOAT,
        "hystgen_above(t->segment[c->top].reach, t->inside[on] - start);",
        "hystgen_above(t->segment[c->top].reach, 2 * (t->inside[on] - start));",
        "above", "float32",
    ),
    Mutant(
        "a move that stops is looked for among ways alone", FLOAT,
        "> hystgen_order(middle->reach)",
        "> hystgen_order(middle->way)",
        "above", "float32",
    ),
    Mutant(
        "a turn keeps the limit", FLOAT,
        "    m->here.rising = !m->here.rising;\n    m->limited = false;\n",
        "    m->here.rising = !m->here.rising;\n",
        "above", "float32",
    ),
    Mutant(
        "a step back by rounding goes on", FLOAT,
        "        cap = input;\n",
        "",
        "listed", "float32",
    ),
    Mutant(
        "an answer steps back", FLOAT,
        "        cap = input;\n",
        "        m->here.output = hystgen_along(m, y);\n",
        "listed", "float32",
    ),
    Mutant(
        "a line leads back where plays follow", INVERSE,
        "    } else if (m->here.k == 0) {",
        "    } else {",
        "plain", "float32",
    ),
    Mutant(
        "a line leads back where plays follow, forward", FLOAT,
        "    if (within && (on || m->here.k == 0)) {",
        "    if (within) {",
        "plain", "float32",
    ),
    Mutant(
        "a line leads back beyond the range", FLOAT,
        "k == 0 && !hystgen_above(from, t->range[other]) ?",
        "k == 0 ?",
        "outside", "float32",
    ),
    Mutant(
        "no number behind a commit keeps the commit", INVERSE,
        "HYSTGEN_STATUS_HELD && self->stepped && self->committed) {",
        "HYSTGEN_STATUS_HELD && self->stepped && !self->committed) {",
        "plain", "float32",
    ),
    Mutant(
        "the same behind a front", FLOAT_FRONT,
        "self->stepped && self->committed ? self->returned : self->drive",
        "self->drive",
        "bent", "float32",
    ),
    Mutant(
        "the plays do not go to a clamped drive", FLOAT_FRONT,
        "if (clamped || (inside <= self->drive && inside >= self->drive)) {",
        "if (inside <= self->drive && inside >= self->drive) {",
        "curved", "float32",
    ),
    Mutant(
        "plays of a start list are all left by rising moves", FLOAT,
        "m->here.rising = k <= start->risen;",
        "m->here.rising = true;",
        "below", "float32",
    ),
    Mutant(
        "a corner is passed only beyond it", FLOAT,
        "if (kept > 0 && !hystgen_above(corner[kept].pass[on], x)) {",
        "if (kept > 0 && hystgen_above(x, corner[kept].pass[on])) {",
        "plain", "float32",
    ),
    Mutant("no shy", USUAL, ">> HYSTGEN_FRACTION) - HYSTGEN_SHY;", ">> HYSTGEN_FRACTION);", "coarse", "q15"),
    Mutant(
        "a kink inside a block is not counted from", CORNERS, "c = k > before ? top : c;",
        "c = k > before ? c : c;",
        "plain", "q31",
    ),
    Mutant(
        "a corner of the same direction is passed too late", CORNERS, "here->rising ? 0 : whole);",
        "here->rising ? whole : whole);", "plain", "q31",
    ),
    Mutant(
        "a committed drive answers the same reference", USUAL, "if (!self->repeated || u != self->reference)",
        "if (u != self->reference)", "plain", "q31",
    ),
    Mutant(
        "the same behind a memoryless part", FRONT, "if (!self->repeated || u != self->reference)",
        "if (u != self->reference)", "curved", "q15",
    ),
    Mutant(
        "a usual step is not taken back", USUAL, "    if (self->usual) {", "    if (self->usual && v > 0) {",
        "plain", "q15",
    ),
    Mutant(
        "where plays follow is kept behind a commit", FRONT, "    self->next = -HYSTGEN_FAR;\n    hystgen_move",
        "    hystgen_move", "two_branches", "q31",
    ),
    Mutant(
        "the low saturation code", CODES, "return (hystgen_real_t)-HYSTGEN_CODE_MAX;",
        "return (hystgen_real_t)(-HYSTGEN_CODE_MAX - 1);", "far_low", "q15",
    ),
    Mutant(
        "halves of codes are rounded up on either side of 0", FINER, " - (w < 0 ? 1 : 0)) >>", ") >>", "listed", "q15",
    ),
    Mutant(
        "no saturation below", CODES, "return (hystgen_real_t)-HYSTGEN_CODE_MAX;",
        "return (hystgen_real_t)code;", "far_low", "q15",
    ),
    Mutant(
        "no number before the first step", ALONE, "self->stepped ? self->answer : self->drive", "self->answer",
        "plain", "float32", "loop",
    ),
    Mutant(
        "a committed drive answers the same reference, loop", "c_runtime/compensator/chain/chain_calls.c",
        "    self->repeated = false;\n    self->pending = inside;", "    self->pending = inside;",
        "plain", "q31", "loop",
    ),
    Mutant(
        "what is pending stays out of the memory", "c_runtime/compensator/chain/chain.c",
        "hystgen_operator_absorb(self, self->pending);", "self->drive = self->pending;", "plain", "float32", "loop",
    ),
    Mutant(
        "the limit of a reference counts as the reference", ALONE, "self->reference = u;",
        "self->reference = hystgen_inverse_clamp(u);", "plain", "float32", "loop",
    ),
    Mutant(
        "an envelope limits nothing above", CURVE, "*limited = w > e->most && w > e->envelope_most;",
        "*limited = false;", "flat_high", "q15",
    ),
    Mutant(
        "what lies above the drives is all limited", CURVE, "*limited = w > e->most && w > e->envelope_most;",
        "*limited = w > e->most;", "two_branches", "q15",
    ),
    Mutant(
        "rounding above is limited", CURVE, "*limited = w > e->most && w > e->envelope_most;",
        "*limited = w > e->envelope_most;", "flat_high", "q15",
    ),
    Mutant(
        "an envelope limits nothing below", CURVE, "*limited = w < e->least && w < e->envelope_least;",
        "*limited = false;", "flat_low", "q15",
    ),
    Mutant(
        "what lies below the drives is all limited", CURVE, "*limited = w < e->least && w < e->envelope_least;",
        "*limited = w < e->least;", "two_branches", "q15",
    ),
    Mutant(
        "a drive behind a lag turns at once", TURN,
        "return back - HYSTGEN_HOLD > hystgen_inverse_missed(way < 0 ? -way : way);",
        "return back > HYSTGEN_HOLD + hystgen_inverse_missed(way - way);",
        "steady", "float32", "loop",
    ),
    Mutant(
        "a step is led in full", LAG, "twice < 0 ? 0 : twice;", "way > twice ? way : twice;",
        "steady", "float32", "loop",
    ),
    Mutant(
        "a brake forgets what the drive before was short of", LAG, "    braked->lag.wanted -= missed;\n",
        "    (void)missed;\n", "steady", "float32", "loop",
    ),
    Mutant(
        "rounding below is limited", CURVE, "*limited = w < e->least && w < e->envelope_least;",
        "*limited = w < e->envelope_least;", "flat_low", "q15",
    ),
    Mutant(
        "with effects, plays go on from a kink that was not sought", CHAIN,
        "if (!self->sought || !hystgen_operator_moved(self, w)) {", "if (!hystgen_operator_moved(self, w)) {",
        "led", "q31",
    ),
    Mutant(
        "with effects, a kink counts as sought for good", CHAIN,
        "    self->sought = false;\n#endif\n    self->level", "#endif\n    self->level",
        "led", "q31",
    ),
    Mutant(
        "a finer solution takes the slope behind the kink", CHAIN_FINER,
        "self->kink.output = x - 1;",
        "self->kink.output = x;",
        "led", "q31",
    ),
    Mutant(
        "a kink that a finer solution was rounded to is kept", CHAIN_FINER,
        "x <= self->kink.input", "x < self->kink.input",
        "led", "q31",
    ),
    Mutant(
        "what was solved for is not taken back", CHAIN_FLOAT, "            hystgen_take_back(m, &self->undo);\n", "",
        "creeping", "float32",
    ),
    Mutant(
        "a line that was taken back leads on", FLOAT, "? 1 : -1);\n    hystgen_forget_line(m);\n", "? 1 : -1);\n",
        "creeping", "float32",
    ),
    Mutant(
        "the line of a solution leads back beyond its last kink", CHAIN_FLOAT,
        "k > self->undo.k ? m->start : self->undo.output", "self->undo.output", "led", "float32",
    ),
    Mutant(
        "the line of a solution leads back beyond a corner", CHAIN_FLOAT, " || m->here.depth != self->undo.depth", "",
        "led", "float32",
    ),
    Mutant(
        "the line of a solution leads on beyond a kink", CHAIN_FLOAT, "m->here.rising ? h >= m->next : h <= m->next",
        "false", "led", "float32",
    ),
)  # fmt: skip


def _of_loop(what: str, file: str, old: str, new: str, model: str, arithmetic: str, count: int = 1) -> Mutant:
    """A mutant of a file of the run time, in engine loop."""
    folder = "hystgen" if file.startswith("effects/") else "c_runtime"
    return Mutant(what, f"{folder}/{file}", old, new, model, arithmetic, "loop", count)


# At least one mutant of each file that models with effects are made of
OF_EFFECTS = tuple(itertools.starmap(_of_loop, (
    ("a limited output code drops status", "compensator/code.c", "*status |= ", "*status = ", "quick", "q31"),
    ("travel loses the remainder", "effects/ageing/ageing.c", "self->low = change - (next - high);",
     "self->low = change - change;", "worn", "float32"),
    ("a set travel keeps an old remainder", "effects/ageing/ageing.c", "    self->low = 0;\n", "", "worn", "float32"),
    ("a set gain lasts for one move", "effects/ageing/ageing.c",
     "self->own = false;", "self->own = true;", "worn", "float32"),
    ("a travel below 0 is taken", "effects/ageing/ageing.c",
     "    if (travel < 0) {", "    if (travel < travel) {", "worn", "float32"),
    ("travel counts rising drives alone, fixed", "effects/ageing/ageing.c", "way >= 0 ? way : -way",
     "way >= 0 ? way : 0", "worn", "q31"),
    ("a limited gain is not told, fixed", "effects/ageing/ageing.c",
     "return self->gain < given || self->gain > given;", "return self->own;", "worn", "q31"),
    ("a bump is off its centre", "effects/noncongruent/bent.c",
     "z - HYSTGEN_CENTRE", "z + HYSTGEN_CENTRE", "dilated", "float32"),
    ("a curve bends to the other side, fixed", "effects/noncongruent/bent.c",
     "return z + hystgen_nearest", "return z - hystgen_nearest", "bumpy", "q31"),
    ("a polynomial loses a term", "effects/noncongruent/bent.c", "k > 0; --k", "k > 1; --k", "viscous", "float32"),
    ("a lead in good time is cut", "effects/lag/braked.c", "        return lead;\n",
     "        return size;\n", "braked", "float32"),
    ("the brake finds no lead", "effects/lag/braked.c", "low = middle;", "high = middle;", "braked", "float32"),
    ("the brake finds no lead, fixed", "effects/lag/braked.c",
     "low = middle;", "high = middle;", "braked", "q31"),
    ("a limited offset is not told", "compensator/chain/settings.c",
     "= -HYSTGEN_FARTHEST_OFFSET;\n        self->status |= HYSTGEN_STATUS_LIMITED_SETTING;\n",
     "= -HYSTGEN_FARTHEST_OFFSET;\n", "creeping", "float32"),
    ("a settled actuator keeps moving", "compensator/chain/settings.c",
     "    self->moving = false;\n", "", "creeping", "q31"),
    ("a reference that is no number is forgotten", "compensator/chain/chain_calls.c",
     "    hystgen_inverse_repeat(self);\n", "", "late", "float32"),
    ("a set offset leaves the clock running", "compensator/chain/settings.c",
     "        hystgen_operator_clock_start(self);\n", "", "drifting", "float32"),
    ("a rising drive is not slewed", "effects/slew_limit/slewed.c",
     "        if (v > ramp->drive ||", "        if (v > v ||", "quick", "float32"),
    ("the clock stands", "effects/drift/clock.c", "self->low + 1", "self->low + 0", "drifting", "float32"),
    ("drift is not foreseen", "effects/drift/clock.c",
     "(self->low + ahead)", "(self->low + 0 * ahead)", "drifting_late", "float32"),
    ("the rate of drift does not change, fixed", "effects/drift/clock.c", "self->gained += t->change;",
     "self->gained += 0;", "drifting", "q31"),
    ("a settled state of creep keeps its remainder", "effects/creep/creep.c", "        state[i].low = 0;\n",
     "", "creeping", "float32"),
    ("creep does not see the drive come, fixed", "effects/creep/creep.c", "hystgen_times(change, &term->late)",
     "hystgen_times(0 * change, &term->late)", "creeping", "q31"),
    ("the ring is one place short", "effects/delay/delay.c", "oldest + 1u <", "oldest + 2u <", "late", "float32"),
    ("a delay is whole samples", "effects/delay/delay.c", "hystgen_times(change,",
     "hystgen_times(0 * change,", "late", "float32"),
    ("all plays rub alike", "effects/thermal/friction.c", "        odd += 2;\n", "", "rubbed", "float32"),
    ("friction begins anew in every sample", "effects/thermal/friction.c", "self->begun = true;",
     "self->begun = false;", "rubbed", "float32"),
    ("all plays rub alike, fixed", "effects/thermal/friction.c", "        odd += 2;\n", "", "rubbed", "q31"),
    ("a temperature moves no offset", "effects/influence/gain.c",
     "self->offset = hystgen_times(above, &t->offset_per_unit);", "self->offset = 0 * above;", "warm", "float32"),
    ("a limited temperature is not told", "effects/influence/gain.c", "*limited = inside < given ||",
     "*limited = inside < t->lowest ||", "warm", "float32"),
    ("a gain is followed with one Newton step less", "effects/gains.c", "i < turns; ++i",
     "i + 1u < turns; ++i", "heated", "q31"),
    ("heat loses the remainder", "effects/thermal/heat.c", "self->low = change - (warm - high);",
     "self->low = 0;", "heated", "float32"),
    ("heat does not leave", "effects/thermal/heat.c", "- t->rate * high", "+ t->rate * high", "heated", "float32"),
    ("heat has no sign, fixed", "effects/thermal/heat.c", "v >= 0 ? square : -square",
     "v >= 0 ? square : square", "heated", "q31"),
    ("a lag loses the remainder", "effects/lag/lag.c", "self->low = more - change;",
     "self->low = 0;", "lagging", "float32"),
    ("a lag at rest is still asked for another output", "effects/lag/lag.c",
     "    self->asked = x;\n", "", "lagging", "float32"),
    ("a lag at rest is still led, fixed", "effects/lag/lag.c", "    self->lead = 0;\n", "", "led", "q31"),
    ("an exact lag forgets its last drive", "effects/lag/exact.c", "    self->before = v;\n    return self->reached;",
     "    return self->reached;", "quick", "float32"),
    ("an exact lag forgets its last drive, fixed", "effects/lag/exact.c",
     "    self->before = v;\n    return hystgen_nearest", "    return hystgen_nearest", "quick", "q31"),
    ("a lag leads back in front of two branches, fixed", "effects/lag/steady.c", "    self->rises = rises;\n",
     "    self->rises = !rises;\n", "steady", "q31"),
    ("a mode at rest still swings", "effects/resonance/mode.c", "    self->rate = 0;\n", "", "late", "float32"),
    ("a mode at rest still swings, fixed", "effects/resonance/mode.c", "    self->rate = 0;\n", "", "late", "q31"),
    ("a dashpot yields to one side alone", "effects/rate_dependence/dashpot.c",
     "*move = x < 0 ? lost - gained", "*move = x < 0 ? lost + gained", "dashpot", "float32"),
    ("a settled play keeps its remainder", "effects/rate_dependence/dashpot.c", "    *lost = 0;\n",
     "    *lost = *lost;\n", "dashpot", "float32"),
    ("thresholds grow with rising drives alone", "effects/rate_dependence/moved.c",
     "w > x ? w - x : x - w;", "w > x ? w - x : 0;", "dilated", "float32"),
    ("a bent play that leaves still counts among those that stay, fixed", "compensator/chain/moving_plays.c",
     "staying -=\n            (hystgen_sum_t)", "staying -=\n            0 * (hystgen_sum_t)", "bumpy", "q31"),
    ("plays never move", "compensator/chain/moving_plays.c",
     "play[i] = hystgen_reached(i, play, x, w)", "play[i] = play[i] + 0 * w", "dilated", "float32"),
    ("plays stand still while their input does", "effects/rate_dependence/moved.c", "            play[i] = rest;\n",
     "", "viscous", "float32"),
    ("the line of references stands", "effects/delay/preview.c", "line[i + 1u] : x", "line[i] : x", "late", "float32"),
    ("a reference is repeated that was never given", "effects/delay/preview.c", "    if (*filled) {",
     "    if (*filled || HYSTGEN_TAPS > 0u) {", "late", "float32"),
    ("a preview loses its last tap", "effects/delay/preview.c",
     "i = 1; i < HYSTGEN_TAPS", "i = 1; i + 1u < HYSTGEN_TAPS", "late", "float32"),
    ("a preview loses its last tap, fixed", "effects/delay/preview.c", "i = 1; i < HYSTGEN_TAPS",
     "i = 1; i + 1u < HYSTGEN_TAPS", "late", "q31"),
    ("equal references are not counted", "effects/lag/quiet.c", "        ++self->equal;\n",
     "        (void)self->equal;\n", "calm", "float32"),
    ("a kept drive jumps", "effects/lag/quiet.c", "? last : a;", "? a : a;", "calm", "float32"),
    ("relaxing plays gain nothing", "effects/rate_dependence/relaxing.c",
     "HYSTGEN_LATE *", "0 *", "relaxing", "float32"),
    ("a play is stretched to one side alone", "effects/rate_dependence/stretch.c",
     "        return x + r;\n", "        return 0;\n", "relaxing", "float32"),
    ("the wrong part of a search is kept", "compensator/chain/moving_search.c", "        if (left > 0) {",
     "        if (left < 0) {", "dilated", "float32"),
    ("a search ends as it got there", "compensator/chain/moving_search.c",
     "at->input + left * HYSTGEN_RATE", "at->input", "dilated", "float32"),
    ("a search begins with the sum's own slope", "compensator/chain/moving_search.c",
     "self->search.slope = at.steady", "self->search.slope = at.slope", "dilated", "float32"),
    ("a sum takes a play too many to stay", "compensator/chain/moving_search.c",
     "hystgen_with_staying(i, self", "hystgen_with_staying(i + 1u, self", "bumpy", "float32"),
    ("a search ends at the farther neighbour, fixed", "compensator/chain/moving_search.c",
     "self->search.short_of > self->search.over", "self->search.short_of < self->search.over", "dilated", "q31"),
    ("the wrong part of a search is kept, fixed", "compensator/chain/moving_search.c", "found < search->total) {",
     "found > search->total) {", "dilated", "q31"),
    ("stops give on one side alone", "effects/maps.c", "inside = t->lower;", "inside = x;", "quick", "q31"),
    ("what yields is looked up one place low", "effects/rate_dependence/yield.c", "high = before ? middle : high;",
     "high = middle;", "dashpot", "float32", 2),
    ("a piece of what yields begins elsewhere, fixed", "effects/rate_dependence/yield.c", "(inside - piece->begin)",
     "(inside + piece->begin)", "dashpot", "q31"),
    ("what a brake is short of is nothing", "effects/slew_limit/brake.c", "reachable ? v - reachable : reachable - v",
     "reachable ? v - reachable : reachable - reachable", "braked", "float32"),
    ("a brake acts on the first drive", "effects/slew_limit/brake.c",
     "    if (!self->moving) {", "    if (self->moving) {", "braked", "float32"),
    ("a quiet drive is braked", "effects/slew_limit/brake.c", "hystgen_quiet_still(&self->quiet)",
     "!hystgen_quiet_still(&self->quiet)", "calm", "float32"),
    ("a kept branch is not kept", "effects/slew_limit/brake.c", "hystgen_drive_signal(self->applied)",
     "hystgen_drive_signal(v)", "steady", "float32"),
    ("the slew limit has one rate", "effects/slew_limit/slewed.c", "-HYSTGEN_SLEW_FALLING, -HYSTGEN_SLEW_FALLING_REST",
     "-HYSTGEN_SLEW_RISING, -HYSTGEN_SLEW_RISING_REST", "braked", "float32"),
    ("the slew limit has one rate, fixed", "effects/slew_limit/slewed.c",
     "-HYSTGEN_SLEW_FALLING, -HYSTGEN_SLEW_FALLING_REST", "-HYSTGEN_SLEW_RISING, -HYSTGEN_SLEW_RISING_REST", "quick",
     "q31"),
    ("settled drives wait", "effects/delay/forward.c",
     "    if (self->moving) {", "    if (sizeof self->waiting > 0) {", "late", "float32"),
    ("the finer input goes the other way", "compensator/chain/refined_input.c",
     "left < 0 ? whole - more", "left > 0 ? whole - more", "led", "q31"),
    ("a reset keeps the plays", "compensator/chain/chain_start.c",
     "    hystgen_loop_rest(&hystgen_model_tables, self->play, 0);\n", "", "creeping", "float32"),
    ("an init keeps the settings", "compensator/chain/chain_start.c",
     "    hystgen_operator_settings_init(self);\n", "", "warm", "float32"),
    ("a bent play is not bent anew", "compensator/chain/moving_plays.c",
     "play[i] < before || play[i] > before", "play[i] < before", "dilated", "float32"),
    ("plays stay, inverse", "compensator/chain/plays.c", "hystgen_loop_absorb(&hystgen_model_tables, self->play, w);",
     "hystgen_loop_absorb(&hystgen_model_tables, self->play, self->play[0] + 0 * w);", "creeping", "float32"),
    ("viscous plays are solved for as plain ones", "effects/rate_dependence/relaxing.c",
     "self->moving ? hystgen_relaxing_input(self->play, hystgen_asked(h))",
     "!self->moving ? hystgen_relaxing_input(self->play, hystgen_asked(h))", "relaxing", "float32"),
    ("plays are solved for against their direction", "plays/loop_solve.c", "output >= here", "output < here",
     "creeping", "float32"),
    ("plays rest where they are", "compensator/chain/moving_plays.c", "play[i], w, hystgen_model_tables",
     "play[i], play[0] + 0 * w, hystgen_model_tables", "dilated", "float32"),
    ("plays behind a bend stay", "effects/rate_dependence/moved.c", "(play[i], w, hystgen_widened",
     "(play[i], x + 0 * w, hystgen_widened", "bumpy", "float32"),
    ("a bend goes on past its end", "effects/maps.c", "inside = c->least;", "inside = c->most;",
     "lagging", "q31"),
    ("a product loses its lower part", "arithmetic/factors.c", "(((int64_t)low * f->mantissa) >> HYSTGEN_LOW_PART)",
     "(((int64_t)low * 0) >> HYSTGEN_LOW_PART)", "creeping", "q31"),
    ("a quotient is rounded down", "arithmetic/division.c", "((uint32_t)quotient >> (shift - 1u) & 1u)",
     "((uint32_t)quotient >> (shift - 1u) & 0u)", "led", "q31"),
    ("the memory goes before the answer", "compensator/chain/chain.c",
     "    self->has_pending = true;\n", "", "creeping", "float32"),
    ("a limited travel is not told", "effects/ageing/calls.c",
     "hystgen_ageing_set_travel(&hystgen_ageing_1, &self->ageing_1, travel)) {",
     "hystgen_ageing_set_travel(&hystgen_ageing_1, &self->ageing_1, travel) && travel < 0) {", "worn", "float32"),
    ("a drive that turns is not sought again", "compensator/drive.c", "hystgen_front_inverse(w, !up, &limited",
     "hystgen_front_inverse(w, up, &limited", "aged", "float32"),
    ("relaxing plays move back, fixed", "effects/rate_dependence/relaxing.c",
     "z + left", "z - left", "relaxing", "q31"),
    ("a delay is whole samples, fixed", "effects/delay/delay.c",
     "v + (hystgen_reach_t)", "v + 0 * (hystgen_reach_t)", "late", "q31"),
    ("an element loses its remainder", "effects/bouc_wen/elements.c",
     "? 0 : whole - high - low;", "? 0 : 0 * high;", "forgetful", "float32"),
    ("an element keeps z at rest", "effects/bouc_wen/elements.c", "    e->s = 0;\n", "", "gliding", "float32"),
    ("an element moves as on another piece", "effects/bouc_wen/elements.c",
     "slope) - e->level;", "slope) - piece->level;", "forgetful", "float32"),
    ("an element's curve goes on straight", "effects/bouc_wen/elements.c",
     "e->c[k - 1u] + hystgen_piece_part(e->c[k], h);", "e->c[k - 1u] + hystgen_piece_part(0 * e->c[k], h);", "gliding",
     "float32"),
    ("an element does not turn, fixed", "effects/bouc_wen/elements.c", "e->s = -whole;", "e->s = whole;", "forgetful",
     "q31"),
    ("an element keeps z at rest, fixed", "effects/bouc_wen/elements.c", "    e->s = 0;\n", "", "gliding", "q15"),
    ("an element's slope is its mean slope, fixed", "effects/bouc_wen/elements.c",
     "hystgen_piece_part(steep, h) + (mean", "hystgen_piece_part(0 * steep, h) + (mean", "forgetful", "q31"),
    ("an element's piece begins elsewhere, fixed", "effects/bouc_wen/elements.c",
     "e->place = piece->begin + x;", "e->place = piece->begin;", "gliding", "q31"),
    *(each for arithmetic, at in (("float32", "value + e->lean * x;"), ("q31", "+ hystgen_by_slope(x, e->lean);"))
      for each in (
        ("a tilted element's lean does not turn", "effects/bouc_wen/elements.c",
         "e->lean = -e->lean;", "e->lean = e->lean;", "sloping", arithmetic),
        ("a tilted element departs as a level one", "effects/bouc_wen/elements.c",
         "e->s - hystgen_by_slope(x, hystgen_tilt[j].lean)", "e->s - 0 * x", "sloping", arithmetic),
        ("a tilted element's curve is level", "effects/bouc_wen/elements.c",
         "    e->c[0] = e->c[0] + e->lean;\n", "", "sloping", arithmetic),
        ("a tilted element's next piece is level", "effects/bouc_wen/elements.c",
         at, at.replace("lean", "lean * 0"), "sloping", arithmetic),
        ("a tilted element rests as a level one", "effects/bouc_wen/elements.c",
         "    e->s = hystgen_by_slope(HYSTGEN_WIDTH, e->lean);\n", "", "sloping", arithmetic),
        ("the limit of tilted elements is 0", "compensator/chain/moving_plays.c",
         "(self->upward ? HYSTGEN_BASE : -HYSTGEN_BASE);" if arithmetic == "float32"
         else "self->upward ? HYSTGEN_BASE : -HYSTGEN_BASE;", "0;", "sloping", arithmetic),
      )),
    ("elements turn once", "compensator/chain/moving_plays.c",
     "self->upward = !self->upward;", "self->upward = self->upward && !self->moving;", "forgetful", "float32"),
    ("the sum of elements to which a search has led is forgotten", "compensator/chain/moving_plays.c",
     "        self->level = self->asked;\n", "", "forgetful", "float32"),
    ("the slope of elements before a turn counts behind it, fixed", "compensator/chain/moving_plays.c",
     "    self->slope = 0;\n    self->departs", "    self->departs", "forgetful", "q31"),
    ("elements are straight behind a turn, fixed", "compensator/chain/moving_plays.c",
     "    self->departs = true;\n", "    self->departs = false;\n", "gliding", "q31"),
    ("a search for elements lands from afar", "compensator/chain/moving_search.c",
     "left < HYSTGEN_SMOOTH && left > -HYSTGEN_SMOOTH", "left < HYSTGEN_SMOOTH", "forgetful", "float32"),
    ("a search for elements lands behind the place where a play starts", "compensator/chain/moving_search.c",
     "(first > HYSTGEN_N_PLAYS || !hystgen_tried(self, at, first))", "first > 0", "forgetful", "float32"),
    ("elements turn with the slope of a rise", "compensator/chain/moving_search.c",
     "slope + hystgen_element_weight[j]", "slope - hystgen_element_weight[j]", "forgetful", "float32"),
    ("the sum where a search for elements lands is that before, fixed", "compensator/chain/moving_search.c",
     "        self->search.found += gained;\n", "", "forgetful", "q31"),
)))  # fmt: skip

# No record can find these, for the reasons given; if one does, the reason is wrong.
EQUIVALENT = (
    # The limit is itself a drive code, so no drive below it is rounded to a code beyond.
    *(
        Mutant(
            "the limit's edge without shy", USUAL, "((next < last ? next : last) >> HYSTGEN_FRACTION) - HYSTGEN_SHY;",
            "next < last ? (next >> HYSTGEN_FRACTION) - HYSTGEN_SHY : last >> HYSTGEN_FRACTION;", name, bits,
        )
        for name, bits in (("coarse", "q15"), ("edge", "q15"), ("above", "q31"))
    ),
    # The corner was not passed, so the place where its own play begins to follow is not reached either.
    *(
        Mutant(
            "the last play of an open corner is searched for too", CORNERS, "unsigned int last = top->top - 1u;",
            "unsigned int last = top->top;", name, bits,
        )
        for name, bits in (("plain", "q31"), ("listed", "q15"))
    ),
    # Two segments meet at a kink, and either gives the same answer there.
    *(
        Mutant(
            "at a kink the play above does not follow yet", CORNERS, "                on >= (by_output",
            "                on > (by_output", name, bits,
        )
        for name, bits in (("plain", "q31"), ("coarse", "q15"))
    ),
    # The shortcut for a step with the same plays gives what a search would find.
    *(
        Mutant(
            "no step is known to have the same plays", CORNERS, "    if (to < next) {",
            "    if (to < next && next < 0 && next > 0) {", name, bits,
        )
        for name, bits in (("two_branches", "q31"), ("bent", "q15"))
    ),
    # Reusing the place where solving has put a drive saves a search that would find the same place.
    *(
        Mutant(
            "every drive is searched for", CORNERS, "if (moved < 0 || kink->output",
            "if (moved < 0 || moved >= 0 || kink->output", name, bits,
        )
        for name, bits in (("outside", "q15"), ("listed", "q31"), ("two_branches", "q15"))
    ),
    # At rest every place of the ring holds the same drive.
    _of_loop("the ring begins elsewhere", "effects/delay/delay.c", "*oldest = 0;", "*oldest = 1u;", "late", "float32"),
    # Past the last piece the travel no longer changes, and every move is cut off again.
    _of_loop("a cut move leaves all of it", "effects/ageing/ageing.c",
             "        change = next - high;\n", "", "worn", "float32"),
    # The temperature is already limited to the range in which the gain is inside its limits.
    _of_loop(
        "a limited gain is not told", "effects/influence/gain.c",
        "return self->gain < wanted || self->gain > wanted;", "return false;", "warm", "float32",
    ),
    # The direction is found before it is first used.
    _of_loop("a lag at rest falls", "effects/lag/steady.c",
             "self->rises = true;", "self->rises = false;", "steady", "float32"),
    # Without held steps every drive is either solved for or settled.
    _of_loop(
        "a lead is used twice, fixed", "effects/lag/lag.c",
        "    self->lead -= hystgen_lag_scaled(t, change, &t->rate);\n", "", "led", "q31",
    ),
)  # fmt: skip

# Places where setting a status bit equals adding it, since no other bit can be set before. A limited reference has a
# drive inside the range, so no envelope limits it again; and in a forward operator in fixed point whose outputs are all
# codes, the limit of the drive is the only bit.
NO_DRIVE = "self->bits |= HYSTGEN_STATUS_DOMAIN;"
LIMITED_DRIVE = ("forward_step", "self->status |= HYSTGEN_STATUS_INPUT_CLAMPED;")

# Models that together add status bits at every place where the run time does, except in chain_fixed.c
STICKY: list[tuple[str, str, str, set[tuple[str, str]]]] = [
    ("outside", "float32", "corners", set()),
    ("near_high", "q15", "corners", set()),
    ("near_high", "q15", "loop", set()),
    ("two_branches", "float32", "corners", set()),
    ("two_branches", "q15", "corners", {LIMITED_DRIVE, ("inverse_step", NO_DRIVE)}),
    ("two_branches", "float32", "loop", {("inverse_drive", NO_DRIVE)}),
    ("two_branches", "q15", "loop", {LIMITED_DRIVE, ("inverse_drive", NO_DRIVE)}),
    ("curved", "float32", "loop", {("inverse_drive", NO_DRIVE)}),
    ("everything", "float32", "loop", set()),
]
