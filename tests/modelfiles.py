"""Parameter files that the tests share: few and diverse."""

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
