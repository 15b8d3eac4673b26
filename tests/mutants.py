"""Mutants of the run time: small faults that `verify` has to find, and those that are none.

Data to be amended with the sources: `old` has to stand in the file, once unless `count` says otherwise.
"""

from __future__ import annotations

from dataclasses import dataclass

from modelfiles import CHAINS, FILES, LED, PLAYS, STEADY, head

STEP = "c_runtime/loop_float.c"
LOOP = "c_runtime/loop.c"
CODES = "c_runtime/code_saturating.c"
FINER = "c_runtime/front_finer.c"
CORNERS = "c_runtime/corners_fixed.c"
USUAL = "c_runtime/inverse_fixed.c"
FRONT = "c_runtime/inverse_front_fixed.c"
FLOAT = "c_runtime/corners_float.c"
INVERSE = "c_runtime/inverse.c"
FLOAT_FRONT = "c_runtime/inverse_front.c"
CURVE = "c_runtime/curve.c"
CHAIN = "c_runtime/chain_corners_fixed.c"
CHAIN_FINER = "c_runtime/chain_corners_finer.c"
CHAIN_FLOAT = "c_runtime/chain_corners_float.c"
TURN = "c_runtime/chain_turn_late.c"
LAG = "c_runtime/lag_steady.c"

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
    **LED,
    "creeping": CHAINS["creeping"],
    "steady": STEADY,
    # the plays that start lowest begin to follow right at the limit
    "edge": head("edge", 1, 6) + PLAYS + "    initial_state: [0, 1.45, 1.9, 1.9, 1.9, 1.9, 1.9]\n",
    # from plays at 0, after a reset, all follow right at the limit
    "reset_low": head("reset_low", -2.75, 6) + ROUND + "    initial_state: -2\n",
    # drive codes so coarse that rounding to one leads past where a steep play starts to follow
    "coarse": head("coarse") + STEEP + "emit: {drive_lsb: 0.0371}\n",
    "coarse_listed": head("coarse_listed")
    + PLAYS
    + "    initial_state: [0, 0.3, 0.1, -0.2, 0.3, 0.5, 0.1]\nemit: {drive_lsb: 0.0371}\n",
    # the last drive code and the most that the envelope gives lie closer together than half a code
    "flat_high": head("flat_high") + FLAT.format("6") + "emit: {drive_lsb: 1.3}\n",
    "flat_low": head("flat_low") + FLAT.format("-5.7") + "emit: {drive_lsb: 1.3}\n",
    # a reset leads beyond what output codes were chosen for
    "far_low": head("far_low", 0, 1)
    + "\n  pi: {thresholds: [0, 200], weights: [1, 1], initial_state: 50}\n  output_offset: -50\n",
}


@dataclass(frozen=True)
class Mutant:
    """A change of one file, and a model with arithmetic in which it shows."""

    what: str
    file: str
    old: str
    new: str
    model: str
    arithmetic: str
    engine: str = "corners"
    count: int = 1


KILLED = (
    Mutant("a limit keeps no status", USUAL, "if (self->bits == 0) {", "if (self->bits < 8u) {", "outside", "q31"),
    Mutant(
        "a usual step is not taken back, float", INVERSE,
        "if (self->before < m->here.input || self->before > m->here.input) {",
        "if (self->before < m->here.input) {",
        "plain", "float32",
    ),
    Mutant(
        "a block beyond the limit is passed", FLOAT,
        "s->reach > room ? HYSTGEN_REAL_MAX",
        "s->reach > room + room ? HYSTGEN_REAL_MAX",
        "above", "float32",
    ),
    Mutant(
        "the limit is met late", FLOAT,
        "if (t->segment[c->top].reach > room) {",
        "if (t->segment[c->top].reach > room + room) {",
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
        "    if (back) {\n        cap = x;\n    } else if (t->range[on] < cap) {",
        "    if (t->range[on] < cap) {",
        "listed", "float32",
    ),
    Mutant(
        "an answer steps back", FLOAT,
        "    m->here.output = back ? m->here.output : output;\n",
        "    m->here.output = output;\n",
        "listed", "float32",
    ),
    Mutant(
        "a line leads back where plays follow", INVERSE,
        "    } else if (m->here.k == 0) {\n        same =",
        "    } else {\n        same =",
        "plain", "float32",
    ),
    Mutant(
        "a line leads back where plays follow, forward", FLOAT,
        "    } else if (m->here.k == 0) {\n        same =",
        "    } else {\n        same =",
        "plain", "float32",
    ),
    Mutant(
        "a line leads back beyond the range", FLOAT,
        "k == 0 && from <= t->range[other] ? m->from",
        "k == 0 ? m->from",
        "outside", "float32",
    ),
    Mutant(
        "no number behind a commit keeps the commit", INVERSE,
        "if (self->stepped && self->committed) {",
        "if (self->stepped && !self->committed) {",
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
        "if (m->here.depth > 1u && x >= c->pass[on]) {",
        "if (m->here.depth > 1u && x > c->pass[on]) {",
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
        "a committed drive answers the same reference", USUAL, "if (!self->repeat || u != self->reference)",
        "if (u != self->reference)", "plain", "q31",
    ),
    Mutant(
        "the same behind a memoryless part", FRONT, "if (!self->repeat || u != self->reference)",
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
        "no number before the first step", STEP, "self->stepped ? self->answer : self->drive", "self->answer",
        "plain", "float32", "loop",
    ),
    Mutant(
        "a committed drive answers the same reference, loop", LOOP, "    self->repeat = false;\n    self->pending = v;",
        "    self->pending = v;", "plain", "q31", "loop",
    ),
    Mutant(
        "what is pending stays out of the memory", LOOP, "hystgen_inverse_absorb(self, self->pending);",
        "self->drive = self->pending;", "plain", "float32", "loop",
    ),
    Mutant(
        "the limit of a reference counts as the reference", LOOP, "self->reference = u;", "self->reference = level;",
        "plain", "float32", "loop",
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
        "if (!self->sought || !hystgen_inverse_moved(self, w)) {", "if (!hystgen_inverse_moved(self, w)) {",
        "led", "q31",
    ),
    Mutant(
        "with effects, a kink counts as sought for good", CHAIN,
        "    self->sought = false;\n    return hystgen_inverse_started(self);",
        "    return hystgen_inverse_started(self);",
        "led", "q31",
    ),
    Mutant(
        "a finer solution takes the slope behind the kink", CHAIN_FINER,
        "self->kink.output = x - 1;",
        "self->kink.output = x;",
        "led", "q31",
    ),
    Mutant(
        "what was solved for is not taken back", CHAIN_FLOAT, "hystgen_copy_place(&m->here, &self->undo);\n", "",
        "creeping", "float32",
    ),
    Mutant(
        "a line that was taken back leads on", CHAIN_FLOAT, "        hystgen_forget_line(m);\n", "",
        "creeping", "float32",
    ),
)  # fmt: skip

# No record can find these, for the reasons given; a difference would show that a reason is wrong.
EQUIVALENT = (
    # The limit is a drive code itself: nothing before it is rounded to one beyond.
    *(
        Mutant(
            "the limit's edge without shy", USUAL, "((next < last ? next : last) >> HYSTGEN_FRACTION) - HYSTGEN_SHY;",
            "next < last ? (next >> HYSTGEN_FRACTION) - HYSTGEN_SHY : last >> HYSTGEN_FRACTION;", name, bits,
        )
        for name, bits in (("coarse", "q15"), ("edge", "q15"), ("above", "q31"))
    ),
    # A corner that is not passed lies beyond the place: where its own play begins to follow is not reached either.
    *(
        Mutant(
            "the last play of an open corner is searched for too", CORNERS, "unsigned int last = top->top - 1u;",
            "unsigned int last = top->top;", name, bits,
        )
        for name, bits in (("plain", "q31"), ("listed", "q15"))
    ),
    # Segments meet at a kink: either of them leads on from there.
    *(
        Mutant(
            "at a kink the play above does not follow yet", CORNERS, "                on >= (by_output",
            "                on > (by_output", name, bits,
        )
        for name, bits in (("plain", "q31"), ("coarse", "q15"))
    ),
    # Where the same plays are known to follow, a search finds that they do.
    *(
        Mutant(
            "no step is known to have the same plays", CORNERS, "    if (to < next) {",
            "    if (to < next && next < 0 && next > 0) {", name, bits,
        )
        for name, bits in (("two_branches", "q31"), ("bent", "q15"))
    ),
    # That a drive is where solving has put it saves a search, which would find the same place.
    *(
        Mutant(
            "every drive is searched for", CORNERS, "if (moved < 0 || kink->output",
            "if (moved < 0 || moved >= 0 || kink->output", name, bits,
        )
        for name, bits in (("outside", "q15"), ("listed", "q31"), ("two_branches", "q15"))
    ),
)  # fmt: skip
