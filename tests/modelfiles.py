"""A few diverse parameter files that the tests share."""

PLAYS = """
  pi:
    thresholds: [0, 0.45, 0.9, 1.35, 1.8, 2.25, 2.7]
    weights: [0.72, 0.6, 0.48, 0.36, 0.24, 0.12, 0.012]
"""


def head(name: str, low: float = -4.0, high: float = 4.0) -> str:
    return f"hystgen: 1\nname: {name}\nunits: {{input: V, output: um}}\ninput_range: [{low}, {high}]\nmodel:"


FILES = {
    "plain": head("plain") + PLAYS,
    "listed": head("listed")
    + PLAYS
    + "    initial_state: [0, 0.3, 0.1, -0.2, 0.3, 0.5, 0.1]\n  output_offset: 1.5\n",
    "above": head("above", 0, 6) + PLAYS + "  output_offset: -0.5\n",
    "below": head("below", -6, 0) + PLAYS,
    "outside": head("outside", 1, 2.5)
    + PLAYS
    + "    initial_state: [2.5, 2.4, 2.2, 2, 1.8, 1.5, 1]\n  output_offset: -0.5\n",
    "bent": head("bent", -3, 3)
    + PLAYS
    + "  memoryless:\n    kind: dead_zone\n    thresholds: [-1.0, -0.4, 0, 0.4, 1.0]\n"
    + "    weights: [-1.1, -0.9, 4.8, -1.1, -1.1]\n",
    "curved": head("curved")
    + PLAYS
    + "  memoryless: {kind: tanh, ascending: {a0: 6, a1: 0.4, a2: 0.1, a3: 0.2}}\n",
    "two_branches": head("two_branches")
    + PLAYS
    + "  memoryless:\n    kind: tanh\n    ascending: {a0: 6, a1: 0.4, a2: 0.1, a3: 0.2}\n"
    + "    descending: {a0: 6, a1: 0.4, a2: 0.1, a3: 0.5}\n",
    "mixed": head("mixed", -2, 2)
    + PLAYS
    + "  memoryless:\n    - {kind: dead_zone, thresholds: [-1, 0, 0.4, 1], weights: [-1.1, 2.8, -0.1, 0.1]}\n"
    + "    - kind: tanh\n      ascending: {a0: 6, a1: 0.1, a2: 0.1, a3: 0.2}\n"
    + "      descending: {a0: 6, a1: 0.1, a2: 0.1, a3: 0.5}\n",
    "behind": head("behind", -1, 1.5)
    + PLAYS
    + "  memoryless:\n    - kind: tanh\n      ascending: {a0: 1, a1: 1, a2: 0, a3: 0}\n"
    + "      descending: {a0: 1, a1: 1, a2: 0, a3: 0.5}\n"
    + "    - {kind: dead_zone, thresholds: [0, 1], weights: [1, 2]}\n",
    "away": head("away", 2, 5)
    + PLAYS
    + "  memoryless: {kind: dead_zone, thresholds: [0, 1, 3], weights: [-1, 2, 0.5]}\n",
    "linear": head("linear", 0, 1) + "\n  pi: {thresholds: [0], weights: [2]}\n",
    "density": head("density", 0, 10) + '\n  pi: {density: {formula: "0.8*exp(-0.3*r)", p0: 0.7, r_max: 4, n: 40}}\n',
}

TANH = "  memoryless: {kind: tanh, ascending: {a0: 6, a1: 0.4, a2: 0.1, a3: 0.2}}\n"
BRANCHES = (
    "  memoryless:\n    kind: tanh\n    ascending: {a0: 6, a1: 0.4, a2: 0.1, a3: 0.2}\n"
    "    descending: {a0: 6, a1: 0.4, a2: 0.1, a3: 0.5}\n"
)


ALLOWED = "emit: {compensation: {noise_gain: 1.0e+4}}\n"
"""Allows a noise gain above that of any inverse here, so that all are emitted and none averages references."""


def chain(name: str, *effects: str, front: str = "", compensate: str = "") -> str:
    """A model with effects, sampled at 1 kHz; `compensate`: effects to compensate although nothing measures them."""
    asked = f"emit: {{compensation: {{compensate: [{compensate}]}}}}\n" if compensate else ""
    return (
        head(name) + PLAYS + front + "  output_offset: 0.5\n  effects:\n"
        + "".join(f"    - {{{effect}}}\n" for effect in effects) + "sample_time: 1.0e-3\n" + asked
    )  # fmt: skip


CREEP = "name: creep, time_constants: [0.01, 0.1, 300], weights: [0.02, 0.03, 0.05]"
CHAINS = {
    "creeping": chain("creeping", CREEP),
    "logarithmic": chain("logarithmic", "name: creep, shape: logarithmic, per_decade: 0.02, t0: 0.1, t_min: 1.0e-3, "
                         "t_max: 1.0e4", front=TANH),
    "lagging": chain("lagging", "name: lag, time_constant: 0.01", "name: saturation, level: 12", CREEP, front=BRANCHES),
    "quick": chain("quick", "name: lag, time_constant: 2.0e-4", "name: slew_limit, rate: 500, falling_rate: 300",
                   "name: saturation, shape: stops, lower: -5, upper: 4, give: 0.2"),
    "warm": chain("warm", "name: thermal, gain_per_degree: -0.002, offset_per_degree: 0.01",
                  "name: saturation, shape: hard, level: 9"),
    "aged": chain("aged", "name: ageing, loss: 0.02, travel: 50", front=BRANCHES),
    "worn": chain("worn", "name: ageing, shape: exponentials, losses: [0.02, 0.03], travels: [10, 200]", CREEP),
    "viscous": chain("viscous", "name: rate_dependence, shape: relaxation, time_constant: 5.0e-3",
                     "name: noncongruent, coefficients: [[0.05, -0.01], [0.02], [0.01], [0.05], [0.05], [0.05]]"),
    "dashpot": chain("dashpot", "name: rate_dependence, shape: relaxation, time_constant: 5.0e-3, exponent: 2.5"),
    "soft_dashpot": chain("soft_dashpot", "name: rate_dependence, shape: relaxation, time_constant: 2.0e-3, "
                          "exponent: 0.5", "name: noncongruent, shape: centre, amplitude: 0.4, centre: 1, width: 2",
                          CREEP, front=TANH),
    "relaxing": chain("relaxing", "name: rate_dependence, shape: relaxation, time_constant: 5.0e-3", front=BRANCHES),
    "dilated": chain("dilated", "name: rate_dependence, betas: [1.0e-4, 1.0e-4, 1.0e-4, 2.0e-4, 2.0e-4, 2.0e-4]",
                     "name: noncongruent, shape: centre, amplitude: 0.4, centre: 1, width: 2", front=TANH),
    "wider": chain("wider", "name: rate_dependence, betas: [1.0e-4, 1.0e-4, 1.0e-4, 3.0e-4, 3.0e-4, 3.0e-4]", CREEP),
    "bumpy": chain("bumpy", "name: noncongruent, shape: centre, amplitude: -0.3, centre: -1, width: 1.5"),
    "forgetful": chain("forgetful", "name: bouc_wen, weights: [-0.2, 0.1], widths: [2, 0.7], exponent: 1.6, "
                       "balance: 1.3", CREEP),
    "gliding": chain("gliding", "name: bouc_wen, shape: dahl, weights: [-0.15], widths: [1]",
                     "name: rate_dependence, shape: relaxation, time_constant: 5.0e-3",
                     "name: noncongruent, shape: centre, amplitude: 0.4, centre: 1, width: 2", front=TANH),
    "sloping": chain("sloping", "name: bouc_wen, shape: duhem, weights: [-0.2, 0.1], widths: [2, 0.7], "
                     "tilts: [-0.06, 0.08]"),
    "viscous_twin": chain("viscous_twin", "name: rate_dependence, betas: [5.0e-3, 5.0e-3, 5.0e-3, 0, 0, 0]"),
    "straight": chain("straight", "name: resonance, frequency: 20, damping: 0.1", "name: lag, time_constant: 3.0e-3",
                      CREEP).replace(PLAYS, "\n  pi: {thresholds: [0], weights: [2]}\n") + ALLOWED,
    "drifting": chain("drifting", "name: drift, shape: curved, rate: 0.05, change: 0.01", CREEP,
                      "name: saturation, level: 15, centre: 4", compensate="drift"),
    "drifting_late": chain("drifting_late", "name: drift, rate: -0.08", "name: delay, time: 2.6e-3", CREEP,
                           compensate="drift"),
    "heated": chain("heated", "name: thermal, source: self_heating, time_constant: 0.5, heating: 0.05, "
                    "gain_per_degree: -0.02, offset_per_degree: 0.1", CREEP, compensate="self_heating"),
    "rubbed": chain("rubbed", "name: thermal, source: hysteresis, time_constant: 0.5, heating: 0.02, reach: 3, "
                    "gain_per_degree: -0.02, offset_per_degree: 0.1", compensate="self_heating"),
    "late": chain("late", "name: delay, time: 2.6e-3", "name: resonance, frequency: 30, damping: 0.05", CREEP),
    "everything": chain("everything", CREEP, "name: lag, time_constant: 0.01", "name: delay, time: 2.0e-3",
                        "name: resonance, frequency: 40, damping: 0.3", "name: saturation, level: 15",
                        "name: slew_limit, rate: 3000", "name: ageing, loss: 0.01, travel: 100",
                        "name: thermal, gain_per_degree: 0.001", front=BRANCHES) + ALLOWED,
}  # fmt: skip
"""Models with effects: every block, in each of its kinds. Those of INVERSE_ALONE are emitted as an inverse only."""

LED = {"led": chain("led", "name: lag, time_constant: 0.01", "name: creep, time_constants: [0.1], weights: [0.05]")}
"""A model whose signal in front of the plays has in q31 more bits than their input, which matters to engine corners."""

BRAKED = chain("braked", "name: lag, time_constant: 0.01", "name: slew_limit, rate: 500, falling_rate: 300")
"""A lag behind a slew limit, braked so that it does not overshoot."""

STEADY = chain("steady", "name: lag, time_constant: 0.01", "name: slew_limit, rate: 500, falling_rate: 300",
               front=BRANCHES)  # fmt: skip
"""The same in front of two branches, where the lag must never reverse."""

CALM = chain(
    "calm", CREEP, "name: lag, time_constant: 0.01", "name: slew_limit, rate: 3000", "name: delay, time: 2.0e-3"
) + "emit: {compensation: {quiet: true, noise_gain: 1000}}\n"
"""A model whose drive stands still at rest, with a braked lag and a preview."""

NOTCHED = {
    "notched": chain("notched", "name: resonance, frequency: 60, damping: 0.05", "name: lag, time_constant: 0.01")
    + "emit: {compensation: {resonance: notch, noise_gain: 20}}\n"
}
"""A notch, and averages that limit the noise gain, both over past references only."""

INVERSE_ALONE = ("viscous_twin",)

CODED = {
    "coded": head("coded") + PLAYS + "emit: {converter: {reference: {bits: 12, range: [-9, 9], "
    "coding: twos-complement}, drive: {bits: 8, range: [-5, 5.1], coding: offset-binary}}}\n"
}
"""A model whose references come from a converter and whose drives go to one."""

PUSHED = chain(
    "pushed",
    "name: influence, column: load, offset: 0.05, gain: -0.01, reference: 2, time_constant: 0.02, range: [-10, 20]",
    "name: influence, column: v_y, offset: 0.03, curve: [0.001, -0.0002], reference: 0, range: [-5, 5],"
    " plays: {thresholds: [1, 2], weights: [0.02, 0.01]}",
)
"""Two columns, one behind a lag, one along a curve and with plays."""

SERVICE = "sample_time: 1.0e-3\nemit: {health: {window: 64, band: 0.5}, degauss: {}}\n"
SERVED = {
    name: head(name, -6, 5) + PLAYS + rest + SERVICE
    for name, rest in (("served", ""), ("served_bent", TANH))
} | {"served_moved": CHAINS["dashpot"] + "emit: {health: {window: 64, band: 0.5}}\n"}
"""Models whose error is watched and whose memory can be erased, and one whose plays an effect moves."""
