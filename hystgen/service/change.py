"""Since when sessions differ from earlier ones: a test of change whose false-alarm rate is calibrated, not tuned."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from hystgen.parameters.schema import Residual
from hystgen.service.sessions import DIRECTIONS, SHAPE, ServiceSession

Array = NDArray[np.float64]

SEED = 0
"""Seed of the draws that calibrate the test, so that the same records give the same result."""

RESOLUTION = 20
"""Draws beyond the threshold that a healthy set leaves on average; the stated rate is then known to a fifth of itself
(1 sd)."""

CHUNK = 2**22
"""[numbers] Draws at a time, which bounds memory at 32 MB."""

FEWEST = 3
"""[sessions] Fewest that can show a change among themselves: two means and one scatter."""

MISFIT_TURNS = 4.0
"""[fractions of the drive range] A model's misfit changes by its own size over a quarter of the range: if the sessions
after a change use other drives than those before, that much of the misfit may look like a change."""


OTHER_MOTIONS = 2.0
"""[times the residual of identification] What a healthy unit's model may miss in motions of another kind than those it
was identified with. Of 300 healthy units, 2 miss more in one session, up to 2.6 times, and none in half of its
sessions. Set by: python -m benchmarks.service healthy, column `missed`, seeds 0 to 299."""


@dataclass(frozen=True)
class Change:
    """A possible change along one direction.

    `first`: index of the first changed session; `size`: the change (relative; in s for a lag); `worth`: its rms effect
    on the motion, output units; `sure`: standard deviation of `size`; `p_value`: probability of one so clear in a
    healthy set, over all directions and sessions; `against`: `earlier sessions` or `identification`; `refused`: why it
    is no evidence, although it is clear; empty if it is.
    """

    direction: str
    first: int
    size: float
    worth: float
    sure: float
    p_value: float
    against: str
    refused: str = ""

    @property
    def interval(self) -> tuple[float, float]:
        """95 % interval of `size`, for normal scatter."""
        return self.size - 1.96 * self.sure, self.size + 1.96 * self.sure

    def sentence(self) -> str:
        """The change in words."""
        low, high = self.interval
        if self.direction == SHAPE:
            return f"its deviation in {DIRECTIONS[SHAPE]} grew {amount(SHAPE, self.size)}"
        return f"{DIRECTIONS[self.direction]} changed by {amount(self.direction, self.size)} (95 %: " \
            f"{amount(self.direction, low)} to {amount(self.direction, high)})"


def amount(direction: str, size: float) -> str:
    """A change along a direction: in s for a lag, else relative."""
    if direction == SHAPE:
        return f"{math.exp(min(size, 99.0)):.3g} times"
    return f"{1e3 * size:+.3g} ms" if direction == "rate" else f"{100.0 * size:+.3g} %"


def largest_residual(stated: Residual | None, false_alarms: float) -> float | None:
    """The largest rms residual that identification may have left: the end of the interval of its estimate from a finite
    number of independent samples, one-sided with error probability `false_alarms`."""
    from scipy.stats import chi2

    if stated is None:
        return None
    return float(stated.rms * math.sqrt(stated.samples / chi2.ppf(false_alarms, stated.samples)))


def find(sessions: Sequence[ServiceSession], residual: float | None, false_alarms: float) -> list[Change]:
    """Possible changes, at most one per direction and comparison: those that are evidence at this rate first, the
    directions in the order of their effect on the motion and each with its earliest session first, then the others.

    Every direction is tested twice: among the sessions, and against `residual`, the rms residual that identification
    left (output units), if that is known. The smallest p-value counts, times the number of tests (Bonferroni).
    """
    names = [name for name in DIRECTIONS if all(name in each.seen for each in sessions)]
    made = [] if len(sessions) < FEWEST else [
        found for name in names if (found := _among(sessions, name, residual, false_alarms / len(names))) is not None
    ]
    if residual is not None:
        made += [_beyond(sessions, name, residual, false_alarms / len(names)) for name in names]
    tests = len(made)
    final = [replace(each, p_value=min(1.0, tests * each.p_value)) for each in made]

    def shown(each: Change) -> bool:
        return not each.refused and each.p_value <= false_alarms

    effect = dict.fromkeys(names, 0.0)
    for each in filter(shown, final):  # a direction other than the shape is named if it makes up most of the power
        worth = math.sqrt(0.5) * each.worth if each.direction == SHAPE else each.worth
        effect[each.direction] = max(effect[each.direction], worth)

    def place(each: Change) -> tuple[float, ...]:
        if shown(each):
            return 0.0, -effect[each.direction], each.first
        return 1.0 + bool(each.refused), each.p_value, each.first

    return sorted(final, key=place)


def _columns(sessions: Sequence[ServiceSession], name: str) -> tuple[Array, Array, Array]:
    """Sizes, parts and standard deviations of a direction over the sessions (K,)."""
    table = np.array([[s.seen[name].size, s.seen[name].part, s.seen[name].sure] for s in sessions])
    return table[:, 0], table[:, 1], table[:, 2]


def _between(size: Array, part: Array, sure: Array) -> float:
    """Variance of the parts between sessions beyond that within (DerSimonian and Laird, Controlled Clin. Trials 1986,
    for a regression through zero)."""
    w = 1.0 / np.maximum(sure, 1e-300) ** 2
    slope = float(w * size @ part) / float(w * size @ size)
    excess = float(w @ (part - slope * size) ** 2) - (len(part) - 1)
    weight = float(np.sum(w) - (w**2 * size @ size) / (w * size @ size))
    return max(0.0, excess / weight) if weight > 0.0 else 0.0  # 0 if one session outweighs all others


def _among(sessions: Sequence[ServiceSession], name: str, residual: float | None, rate: float) -> Change | None:
    """The clearest change of a direction from one session to the next.

    The parts are a regression on the sizes whose slope changes once; their scatter is that between the sessions. The
    statistic is the largest |t| over all sessions at which it may change, and its distribution in a healthy set is
    drawn, exact for normal scatter since |t| does not depend on its size (Barnard 1963; Dufour 2006).
    """
    size, part, sure = _columns(sessions, name)
    number = len(part)
    root = 1.0 / np.sqrt(_between(size, part, sure) + sure**2 + 1e-300)
    line = size * root
    line /= np.linalg.norm(line)
    steps = np.tril(np.ones((number, number)))[:, 1:] * (size * root)[:, None]
    steps -= np.outer(line, line @ steps)
    lengths = np.linalg.norm(steps, axis=0)
    unit = steps / np.maximum(lengths, 1e-300)

    def squares(x: Array) -> Array:
        """(draws, K - 1) squares of t for each session at which the slope may change."""
        along = (x @ unit) ** 2
        left = np.sum(x**2, axis=1) - (x @ line) ** 2
        rest = np.maximum(left[:, None] - along, 1e-12 * left[:, None] + 1e-300)
        return np.asarray(along / rest * (number - 2))

    own = squares((part * root)[None, :])[0]
    k = int(np.argmax(own))
    draws = math.ceil(RESOLUTION / rate)
    random, beyond, left = np.random.default_rng(SEED), 0, draws
    while left:
        now = min(left, CHUNK // number)
        beyond += int(np.count_nonzero(np.max(squares(random.standard_normal((now, number))), axis=1) >= own[k]))
        left -= now
    change = float((part * root) @ unit[:, k]) / max(float(lengths[k]), 1e-300)
    spread = abs(change) / math.sqrt(float(own[k])) if own[k] > 0.0 else math.inf
    worth = abs(change) * float(np.sqrt(np.mean(size[k + 1 :] ** 2)))
    if name == SHAPE:
        worth = math.exp(float(np.mean(part[k + 1 :]))) if change > 0.0 else 0.0
    misfit = residual if residual is not None else float(np.sqrt(np.mean([s.rms**2 for s in sessions[: k + 1]])))
    other = min(1.0, MISFIT_TURNS * _gap(sessions[: k + 1], sessions[k + 1 :])) * misfit
    refused = "" if worth > other else (
        f"the drives from {sessions[k + 1].name} on differ from those before, which may explain it"
    )
    if name == SHAPE and (change < 0.0 or not _follows_motion(sessions[k + 1 :], rate)):
        beyond, refused = draws, ""  # a smaller deviation, or more noise, is no change of the unit
    p = (1 + beyond) / (1 + draws)
    return Change(name, k + 1, change, worth, spread, p, "earlier sessions", refused)


def _follows_motion(sessions: Sequence[ServiceSession], rate: float) -> bool:
    """Whether the deviation of sessions follows the motion, rather than being noise, with error probability `rate`."""
    from scipy.stats import chi2

    found = [each.explained for each in sessions]
    squares = sum((part / max(spread, 1e-300)) ** 2 for part, _, spread in found)
    return bool(squares > chi2.ppf(1.0 - rate, sum(number for _, number, _ in found)))


def _gap(before: Sequence[ServiceSession], after: Sequence[ServiceSession]) -> float:
    """How far apart two groups are in the use of the drive: 0 if they overlap, 1 for a whole drive range or a factor
    of e in speed."""
    one, other = np.array([s.use for s in before]), np.array([s.use for s in after])
    reach = max(float(max(one[:, 1].max(), other[:, 1].max()) - min(one[:, 0].min(), other[:, 0].min())), 1e-300)
    scale = np.array([reach, reach, 1.0])
    apart = np.maximum(other.min(axis=0) - one.max(axis=0), one.min(axis=0) - other.max(axis=0))
    return float(np.max(np.maximum(apart, 0.0) / scale))


def _beyond(sessions: Sequence[ServiceSession], name: str, residual: float, rate: float) -> Change:
    """The clearest change that exceeds what the model missed on the records it was fitted to.

    A healthy unit's model misses no more in service than `OTHER_MOTIONS` times the whole residual of identification,
    so a part is evidence as far as it exceeds that by more than its own standard deviations. A change stays: at least
    half of the sessions from the first changed one on have to show it, and that one itself (twice the median p-value,
    which is valid whatever the dependence: Rueger, Metrika 25, 1978), times the number of sessions.
    """
    from scipy.special import ndtr

    if name == SHAPE:
        size, part = np.ones(len(sessions)), np.array([each.structured for each in sessions])
        sure = np.array([each.explained[2] for each in sessions])
    else:
        size, part, sure = _columns(sessions, name)
    p = 2.0 * ndtr(-np.maximum(np.abs(part) - OTHER_MOTIONS * residual, 0.0) / np.maximum(sure, 1e-300))
    number = len(p)
    lasting = [max(float(p[k]), 2.0 * float(np.sort(p[k:])[(number - k) // 2])) for k in range(number - 1)]
    whole = number * np.array([*lasting, p[-1]])
    best = min(1.0, float(np.min(whole)))
    k = int(np.argmax(whole <= max(best, rate)))
    change = float(size[k:] @ part[k:]) / float(size[k:] @ size[k:])
    worth = abs(change) * float(np.sqrt(np.mean(size[k:] ** 2)))
    if name == SHAPE:
        change, sure = math.log(max(change, 1e-300) / residual), sure / np.maximum(part, 1e-300)
    return Change(name, k, change, worth, float(np.max(sure[k:] / size[k:])), best, "identification")
