"""Mutants of the templates and the run time: small faults that `verify` has to find, and those that are none.

Data to be amended with the sources: `old` has to stand in the file, once unless `count` says otherwise.
"""

from __future__ import annotations

from dataclasses import dataclass

from modelfiles import FILES, PLAYS, head

STEP = "templates/step.c.j2"
FAST = "templates/step_fast.c.j2"
FIND = "c_runtime/corners_find_float.c"
HALF = "c_runtime/over_slope.c"
CURVE = "c_runtime/curve.c"

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


KEPT_AT_LIMIT = (
    "        self->memory.there.k = 0; /* where the limit leads does not depend on what is asked for beyond it */\n",
    "",
)

KILLED = (
    Mutant(
        "the place that solving found is kept where the drive was limited", STEP,
        *KEPT_AT_LIMIT, "bent", "float32",
    ),
    Mutant(
        "the place at a limit is kept for another drive", STEP,
        "        self->memory.there.k = 0; /* where a limit leads, or no move, says nothing of another drive */\n",
        "        ;\n", "reset_low", "float32",
    ),
    Mutant("no shy, rising", STEP, "{{ fraction }}) - {{ shy }};", "{{ fraction }});", "coarse", "q15"),
    Mutant("no shy, falling", STEP, "{{ fraction }}) + 1 + {{ shy }};", "{{ fraction }}) + 1;", "coarse", "q15"),
    Mutant(
        "no shy at the edge of a limit", FAST,
        "    edge = self->falling ? edge - 2 * {{ shy }} : edge + 2 * {{ shy }};\n", "", "outside", "float32",
    ),
    Mutant(
        "no shy at the edge of a move", FAST,
        "self->edge[rising] = rising ? edge - {{ shy }} : edge + {{ shy }};", "self->edge[rising] = edge;",
        "listed", "float32",
    ),
    Mutant(
        "find end, corners that are left", FIND, "        *k = corner[left].end;\n        *end = *k;\n",
        "        *k = corner[left].end;\n        *end = *k + 1u;\n", "plain", "float32",
    ),
    Mutant(
        "find end, the lowest corner of the start", FIND, "                left = 0;\n                *end = *k;\n",
        "                left = 0;\n                *end = *k + 1u;\n", "listed", "float32",
    ),
    Mutant(
        "find end, two above the start within a limit", FIND,
        "        *k = corner[start + 1u].end;\n        *end = *k;\n",
        "        *k = corner[start + 1u].end;\n        *end = *k + 1u;\n", "outside", "float32",
    ),
    Mutant(
        "find end, one above the start within a limit", FIND,
        "        *k = c->end;\n        *end = *k;\n    }\n    return",
        "        *k = c->end;\n        *end = *k + 1u;\n    }\n    return", "outside", "float32",
    ),
    Mutant(
        "find end, corners of the start within a limit", FIND,
        "            *k = c->end;\n            *end = *k;\n",
        "            *k = c->end;\n            *end = *k + 1u;\n", "edge", "float32",
    ),
    Mutant(
        "find end, the lowest of them", FIND, "        *end = *k;\n        return 0;\n",
        "        *end = *k + 1u;\n        return 0;\n", "reset_low", "float32",
    ),
    Mutant("half, up", HALF, "return x >> 1;", "return (x + 1) >> 1;", "coarse_listed", "q31"),
    Mutant(
        "the low saturation code", STEP, "code < -{{ code_max }} ? -{{ code_max }} : code",
        "code < -{{ code_max }} ? -{{ code_max }} - 1 : code", "far_low", "q15",
    ),
    Mutant(
        "no saturation below", STEP, "code < -{{ code_max }} ? -{{ code_max }} : code", "code", "far_low", "q15",
    ),
    Mutant(
        "no number before the first step", STEP, "self->stepped ? self->answer : self->applied", "self->answer",
        "plain", "float32", "loop",
    ),
    Mutant(
        "no number before the first step, fast", FAST, "        self->answer = self->applied;\n", "", "plain",
        "float32",
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
        "rounding below is limited", CURVE, "*limited = w < e->least && w < e->envelope_least;",
        "*limited = w < e->envelope_least;", "flat_low", "q15",
    ),
)  # fmt: skip

NOTHING_NEW = ("            self->memory.there.k = 0; /* it found nothing new */\n", "            ;\n")
DOWN = ("return x >> 1;", "return x / 2;")

# No record can find these, for the reasons given; a difference would show that a reason is wrong.
EQUIVALENT = (
    # In fixed point `there` is taken for a drive only where `hystgen_foretold` finds that it holds for that drive: the
    # same direction, plays up to k-1 reached, play k not passed. Such a place gives the plays the values that the
    # search would; at the very activation of play k the two may count it differently, and its state is the same. Sums
    # of whole numbers do not depend on which of the places stands for a memory, as `loop`, which has none, shows. Of
    # floating point this is not so: there the place's line begins where rounding has put the answer (KILLED).
    *(
        Mutant("the place that solving found is kept where the drive was limited", STEP, *KEPT_AT_LIMIT, name, bits)
        for name, bits in (
            ("outside", "q15"), ("edge", "q31"), ("bent", "q31"), ("two_branches", "q15"), ("behind", "q31"),
        )
    ),
    # A fast move that began with the plays that followed already: `there` is a copy of `here`. If it holds for the
    # drive committed, it is taken, and is `here`; if not, or if it was cleared, the search begins at a copy of `here`.
    *(
        Mutant("a place that is known already is kept", STEP, *NOTHING_NEW, name, bits)
        for name, bits in (
            ("plain", "q15"), ("coarse_listed", "q31"), ("plain", "float32"), ("edge", "float32"),
            ("outside", "float64"),
        )
    ),
    # `half` is taken of ways from what a corner holds to where a move ends. A corner that is left or entered lies on
    # the way, behind the end or at it, so that no way is negative, and of others both roundings are the same.
    *(
        Mutant("half, towards zero", HALF, *DOWN, name, bits)
        for name, bits in (("coarse_listed", "q31"), ("bent", "q31"), ("listed", "q31"), ("plain", "q15"))
    ),
)  # fmt: skip
