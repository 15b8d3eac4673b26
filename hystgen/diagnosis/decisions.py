"""What an effect is good for, and which of several that are about as good is taken.

Each stands by errors over held-out records first, with fitted ones as a witness.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hystgen import effects
from hystgen.diagnosis import structure as fits
from hystgen.diagnosis.structure import Fitted, Item
from hystgen.diagnosis.trials import Records, Tried
from hystgen.identification.uncertainty import correlation_time

Array = NDArray[np.float64]

SHARE = 0.07
"""What an effect removes has an rms of at least this share of the refitted gap, of the records that judge or of those
that were fitted, or it gets no name: the one may be ruled by edges that the other hardly has.

What a right name in a wrong shape leaves to a second one, and no better shape takes, is up to 5 % on tuning cases.
"""

NEARLY_ALL = 0.25
"""Or it leaves at most so much of the error before it: beside a far larger effect that share may be out of reach."""

ABOVE_NOISE, FURTHER = 0.6, 1.0
"""The part that it removes has an rms of at least so many times what is left, or the noise if that is more; of a model
that has a front or effects already the second: what a right name in a wrong shape leaves to another is less."""

SURE, REPEATED = 1e-3, 0.05
"""Largest p-value of the difference in held-out error; or of that where the fitted records show it with the first."""

SEEN = 0.25
"""And so many times what is left, or the noise, from fitted records: what it does to others alone may be another's."""

UNSURE, DIFFERENT = 0.25, 0.01
"""Effects cannot be told apart within this share of the held-out rms, unless chance explains the difference with a
lower probability than that."""

SIMPLER = 0.05
"""A shape with fewer numbers is taken for one whose held-out rms is better by less than this share."""

FAR_LESS = 0.5
"""An error over fitted records is far less than another from this share of it on."""

EQUAL = 0.005
"""Errors that differ by less than this share are equal."""

MOSTLY = 0.5
"""Of records of one loop alone, passed again and again, whatever leaves at most this share of what is no noise may be
what is missing, and what leaves more is not named: two functions, up and down, tell no more than that the shape of one
effect is the handier. Where they were fitted at one speed, no second one is named either: its shape may have left it.
"""

FAR_ABOVE = 2.0
"""An error so many times as large as the noise is no noise, whatever it goes with: noise that is not white exceeds its
floor by less. What leaves more of records of one loop alone is not named either: a right name in a wrong shape leaves
it as well as a wrong name, and no other loop tells which of the two it was."""

def _above_noise(removed: float) -> float:
    """An error over the noise, where noise and so many times as much are in it."""
    return math.sqrt(1.0 + removed**2)


AT_FLOOR = _above_noise(ABOVE_NOISE)
"""A held-out error within this factor of the noise leaves hardly anything to explain."""


@dataclass(frozen=True)
class Merit:
    """What an effect is good for: the rms of what it removes of held-out records and of fitted ones, and how sure the
    difference is."""

    removed: float
    fitted: float
    left: float
    """share of the held-out rms that it leaves"""
    p_value: float

    def worth(self, gap: float, records: Records) -> bool:
        """Whether it is a share of the gap, or of what was left of it, that deserves a name."""
        return self.removed >= SHARE * gap or self.fitted >= SHARE * records.gap or self.left <= NEARLY_ALL


def merit_of(now: Fitted, best: Tried, records: Records, least: float | None = None) -> Merit | None:
    """None where chance explains the difference, or what is removed is too little to be told from the noise, or all but
    nothing of it is in the records that its numbers are from, or where records of one loop alone do not support a name.

    `least`: how many times what is left, or the noise, has to be removed; by default as `ABOVE_NOISE` says.
    """
    if not _supported(now, best, records):
        return None
    errors = _without_merit(now, best, records.held)
    equal = fits.rms(errors)
    if not removes(now, best, records, least):
        return None
    p_value = difference(errors, best.errors)
    if p_value > REPEATED:
        return None
    without, fitted = _without_merit(now, best, records.to_fit), best.fitted.errors(records.to_fit)
    sure = p_value <= SURE or difference(without, fitted) <= SURE
    explained, unexplained = apart(fits.rms(without), fits.rms(fitted)), fits.rms(fitted)
    if not sure or explained < SEEN * max(records.noise, unexplained):
        return None
    return Merit(apart(equal, best.held_out), explained, best.held_out / equal, p_value)


def removes(now: Fitted, best: Tried, records: Records, least: float | None = None) -> bool:
    """Whether it removes enough of held-out records on equal terms, by chance or not; `least` as in `merit_of`."""
    if least is None:
        least = _least(now)
    removed = apart(fits.rms(_without_merit(now, best, records.held)), best.held_out)
    return removed >= least * max(records.noise, best.held_out)


def _least(now: Fitted) -> float:
    return ABOVE_NOISE if now.bare else FURTHER


def leaves_enough(now: Fitted, records: Records) -> bool:
    """Whether so much of held-out records is left that what removes all but the noise of it may have a name."""
    return records.left(now) > _above_noise(_least(now)) * records.noise


def _without_merit(now: Fitted, best: Tried, items: Sequence[Item]) -> list[Array]:
    """Errors of a hypothesis with what an effect leaves free in a record, which must not count as its merit.

    Or with what it leaves free itself, if that is more: less is no merit either.
    """
    return min(now.errors(items, best.fitted), now.errors(items), key=fits.rms)


def simplest_first(tried: Sequence[Tried], records: Records) -> list[Tried]:
    """All, the best and those about as good before the others, and of these the ones of fewer numbers first.

    About as good: where all leave the same free in every record, held-out records find them no worse, whatever more the
    best explains of those it was fitted to (what one shape of an effect leaves free is part of that effect: between two
    shapes of it each has its own); or they find them alike within a few per cent, and fitted ones no worse, or
    by chance, or by less than an effect is where the best has come to the end of what one of its numbers may be.
    Between equal numbers of numbers all records decide, or the catalogue's order where they find hardly any difference:
    a lag, which every amplifier has, before a delay. What leaves far more of the fitted records than another is not
    the best for a small lead on held-out ones, which may hold little more than what yet another effect leaves there.
    """
    if not tried:
        return []
    best, held, to_fit = tried[0], records.held, records.to_fit
    about_as_good = [each for each in tried if each.held_out <= (1.0 + UNSURE) * best.held_out]
    closest = min(about_as_good, key=lambda each: each.fitted.rms)
    if fits.rms(closest.fitted.errors(to_fit)) <= FAR_LESS * fits.rms(best.fitted.errors(to_fit, closest.fitted)):
        best = closest
    enough, fitted = (1.0 + SIMPLER) * best.held_out, best.fitted.errors(to_fit)
    less = fits.rms(fitted)

    def as_good(errors: list[Array], more: float) -> bool:
        return (
            more <= less
            or difference(errors, fitted) > SURE
            or (_at_an_end(best.fitted) and no_worse(more, less, records.noise))
        )

    near, others = [(best.numbers(held), _everywhere(best, best, records), best)], []
    for each in tried:
        if each is best:
            continue
        like = None if each.name == best.name else best.fitted
        left = fits.rms(each.fitted.errors(held, like))
        if left > enough:
            others.append(each)
            continue
        errors = each.fitted.errors(to_fit, like)
        more = fits.rms(errors)
        if less > FAR_LESS * more and (left <= best.held_out or as_good(errors, more)):
            near.append((each.numbers(held), _everywhere(each, best, records), each))
        else:
            others.append(each)
    least = {n: min(everywhere for number, everywhere, _ in near if number == n) for n, *_ in near}

    def order(one: tuple[int, float, Tried]) -> tuple[int, float, int]:
        number, everywhere, each = one
        return number, max(everywhere, (1.0 + EQUAL) * least[number]), place(each.name)

    return [*(each for *_, each in sorted(near, key=order)), *others]


def place(name: str) -> int:
    """Place in the catalogue, user's own effects behind it."""
    return effects.CATALOGUE.index(name) if name in effects.CATALOGUE else len(effects.CATALOGUE)


def _at_an_end(fitted: Fitted) -> bool:
    """Whether a number is the least or the most that it may be."""
    low, high = fitted.structure.bounds
    return bool(np.any((fitted.shape <= low) | (fitted.shape >= high)))


def _everywhere(each: Tried, best: Tried, records: Records) -> float:
    """rms error over all records, with what the best leaves free in them."""
    return fits.rms(each.fitted.errors([*records.to_fit, *records.held], best.fitted))


def alike(other: Tried, best: Tried, noise: float) -> bool:
    """Whether the records leave open which of two effects it is.

    What one explains more than the other has to be as much as makes an effect worth a name, and no chance.
    """
    if no_worse(other.held_out, best.held_out, noise):
        return True
    return other.held_out <= (1.0 + UNSURE) * best.held_out and difference(other.errors, best.errors) > DIFFERENT


def rivals(best: Tried, tried: Sequence[Tried], records: Records) -> list[Tried]:
    """Effects of other names that cannot be told from the one that is taken, the best one first."""
    return [each for each in tried if each.name != best.name and alike(each, best, records.noise)]


def left_open(now: Fitted, best: Tried, tried: Sequence[Tried], records: Records) -> list[str]:
    """Names of those that cannot be told from the one that is taken, by fitted records neither."""
    least = best.fitted.rms
    others = [each for each in rivals(best, tried, records) if no_worse(each.fitted.rms, least, records.noise)]
    if records.one_loop:
        others += [each for each in tried if each.name != best.name and _explains_most(now, each, records)]
        if best.held_out > AT_FLOOR * records.noise:  # what fitted records tell is not borne out by others
            others += [
                each
                for each in tried
                if each.name != best.name and takes_most(each.fitted.rms, now.rms, records.noise)
            ]
    return list(dict.fromkeys(each.name for each in others))


def _explains_most(now: Fitted, tried: Tried, records: Records) -> bool:
    """Whether held-out records find it to leave hardly half of the error that is no noise."""
    return takes_most(tried.held_out, records.left(now), records.noise)


def takes_most(left: float, gap: float, noise: float) -> bool:
    """Whether what is left is hardly half of a gap, noise apart."""
    return apart(left, noise) <= MOSTLY * apart(gap, noise)


def bear_two(records: Records) -> bool:
    """Whether records may support a second name, or one beside what a model has already."""
    return not (records.one_loop and records.one_speed)


def borne_out(left: float, records: Records) -> bool:
    """Whether what is left in the end is little enough for the names that were found."""
    return not records.one_loop or left <= FAR_ABOVE * records.noise


def _supported(now: Fitted, best: Tried, records: Records) -> bool:
    """Whether records that may tell as little as those of one loop alone support a name."""
    return not records.one_loop or ((now.bare or bear_two(records)) and _explains_most(now, best, records))


def apart(more: float, less: float) -> float:
    """rms of what one error has that another has not."""
    return math.sqrt(max(more**2 - less**2, 0.0))


def no_worse(left: float, least: float, noise: float) -> bool:
    """Whether an error is so little above the least that the rest would be no effect."""
    return apart(left, least) < ABOVE_NOISE * max(noise, least)


def difference(before: Sequence[Array], after: Sequence[Array]) -> float:
    """One-sided p-value of smaller squared errors after than before, over blocks longer than the errors remember.

    Wilcoxon's signed-rank test: what an effect explains may sit in a few events, so that the mean alone is no measure.
    """
    from scipy.stats import wilcoxon

    gains = []
    for a, b in zip(before, after, strict=True):
        known = np.isfinite(a) & np.isfinite(b)
        gain = a[known] ** 2 - b[known] ** 2
        if len(gain) < 4:
            continue
        size = int(min(max(1, round(2.0 * correlation_time(gain))), max(1, len(gain) // 20)))
        edges = np.arange(0, len(gain) - size + 1, size)
        gains.append(np.add.reduceat(gain[: edges[-1] + size], edges) / size)
    blocks = np.concatenate(gains) if gains else np.empty(0)
    if len(blocks) < 6 or not np.any(blocks):
        return 1.0
    return float(wilcoxon(blocks, alternative="greater").pvalue)
