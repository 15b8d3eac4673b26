"""What an effect is worth, and which of several similar ones is taken.

Held-out errors decide first, with fitted ones as a witness. The numbers, and the reasons for them, are in `acceptance`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hystgen import effects
from hystgen.diagnosis.data.items import Item, rms
from hystgen.diagnosis.search import acceptance
from hystgen.diagnosis.search.acceptance import apart, is_noise
from hystgen.diagnosis.search.fits import Fitted
from hystgen.diagnosis.search.screening import Records, Tried
from hystgen.identification.uncertainty import correlation_time

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Merit:
    """What an effect is worth: the rms that it removes from held-out and from fitted records, and how sure that is."""

    removed: float
    fitted: float
    remaining: float
    """share of the held-out rms that is left"""
    p_value: float

    def worth(self, gap: float, records: Records) -> bool:
        """Whether it removes a share of the gap, or of the error before it, that deserves a name."""
        of_gap = acceptance.NAME_SHARE
        return (
            self.removed >= of_gap * gap
            or self.fitted >= of_gap * records.gap
            or self.remaining <= acceptance.NEARLY_ALL
        )


def merit_of(now: Fitted, best: Tried, records: Records, least: float | None = None) -> Merit | None:
    """What a tried effect is worth, or None.

    None where chance explains the difference, where too little is removed to stand out of the noise, where hardly any
    of it is in the records that its numbers come from, and where records of one loop alone do not support a name.

    `least`: what has to be removed, as a multiple of the remaining error or the noise; by default the number of a first
    or a further effect.
    """
    if not _supported(now, best, records):
        return None
    errors = _without_merit(now, best, records.held)
    equal = rms(errors)
    if not removes(now, best, records, least):
        return None
    p_value = difference(errors, best.errors)
    if p_value > acceptance.P_REPEATED:
        return None
    without, fitted = _without_merit(now, best, records.to_fit), best.fitted.errors(records.to_fit)
    sure = p_value <= acceptance.P_SURE or difference(without, fitted) <= acceptance.P_SURE
    explained, unexplained = apart(rms(without), rms(fitted)), rms(fitted)
    if not sure or explained < acceptance.SEEN_IN_FIT * max(records.noise, unexplained):
        return None
    return Merit(apart(equal, best.held_out), explained, best.held_out / equal, p_value)


def removes(now: Fitted, best: Tried, records: Records, least: float | None = None) -> bool:
    """Whether enough is removed from held-out records on equal terms, by chance or not; `least` as in `merit_of`."""
    if least is None:
        least = _least(now)
    removed = apart(rms(_without_merit(now, best, records.held)), best.held_out)
    return removed >= least * max(records.noise, best.held_out)


def _least(now: Fitted) -> float:
    return acceptance.FIRST_REMOVES if now.bare else acceptance.FURTHER_REMOVES


def leaves_enough(now: Fitted, records: Records) -> bool:
    """Whether an effect that removed all but the noise of the held-out error could have a name."""
    return records.residual(now) > acceptance.above_noise(_least(now)) * records.noise


def _without_merit(now: Fitted, best: Tried, items: Sequence[Item]) -> list[Array]:
    """Errors of a hypothesis with the start states and offset that an effect leaves free, which must not be its merit.

    Or with those that it leaves free itself, if the error is then smaller: leaving less free is no merit either.
    """
    return min(now.errors(items, best.fitted), now.errors(items), key=rms)


def simplest_first(tried: Sequence[Tried], records: Records) -> list[Tried]:
    """All that were tried: the best and those about as good first, of these the ones with fewer numbers first.

    About as good: with the same start states free, held-out records find them no worse, whatever more the best explains
    of the fitted ones (between two shapes of one effect each has its own free states, which are part of the effect); or
    held-out records find them within a few per cent, and fitted ones no worse, or worse by chance, or by less than an
    effect is worth where a number of the best is at an end of its range.
    Between equal numbers of numbers all records decide, or the order of the catalogue where these hardly differ: a lag,
    which every amplifier has, before a delay. What leaves far more of the fitted records than another is not the best
    because of a small lead on held-out ones, which may consist mostly of what yet another effect leaves there.
    """
    if not tried:
        return []
    best, held, to_fit = tried[0], records.held, records.to_fit
    about_as_good = [each for each in tried if each.held_out <= (1.0 + acceptance.ALIKE) * best.held_out]
    closest = min(about_as_good, key=lambda each: each.fitted.rms)
    of_best = rms(best.fitted.errors(to_fit, closest.fitted))
    if rms(closest.fitted.errors(to_fit)) <= acceptance.FAR_LESS * of_best:
        best = closest
    enough, fitted = (1.0 + acceptance.BETTER) * best.held_out, best.fitted.errors(to_fit)
    less = rms(fitted)

    def as_good(errors: list[Array], more: float) -> bool:
        return (
            more <= less
            or difference(errors, fitted) > acceptance.P_SURE
            or (_at_an_end(best.fitted) and no_worse(more, less, records.noise))
        )

    near, others = [(best.numbers(held), _everywhere(best, best, records), best)], []
    for each in tried:
        if each is best:
            continue
        like = None if each.name == best.name else best.fitted
        residual = rms(each.fitted.errors(held, like))
        if residual > enough:
            others.append(each)
            continue
        errors = each.fitted.errors(to_fit, like)
        more = rms(errors)
        if less > acceptance.FAR_LESS * more and (residual <= best.held_out or as_good(errors, more)):
            near.append((each.numbers(held), _everywhere(each, best, records), each))
        else:
            others.append(each)
    least = {n: min(everywhere for number, everywhere, _ in near if number == n) for n, *_ in near}

    def order(one: tuple[int, float, Tried]) -> tuple[int, float, int]:
        number, everywhere, each = one
        return number, max(everywhere, (1.0 + acceptance.EQUAL) * least[number]), place(each.name)

    return [*(each for *_, each in sorted(near, key=order)), *others]


def place(name: str) -> int:
    """Place in the catalogue, with the user's own effects behind it."""
    return effects.CATALOGUE.index(name) if name in effects.CATALOGUE else len(effects.CATALOGUE)


def _at_an_end(fitted: Fitted) -> bool:
    """Whether a number is at an end of its range."""
    low, high = fitted.structure.bounds
    return bool(np.any((fitted.shape <= low) | (fitted.shape >= high)))


def _everywhere(each: Tried, best: Tried, records: Records) -> float:
    """rms error over all records, with the start states free that the best leaves free."""
    return rms(each.fitted.errors([*records.to_fit, *records.held], best.fitted))


def alike(other: Tried, best: Tried, noise: float) -> bool:
    """Whether the records leave open which of two effects it is.

    What one explains more than the other has to be as much as makes an effect worth a name, and no chance.
    """
    if no_worse(other.held_out, best.held_out, noise):
        return True
    near = other.held_out <= (1.0 + acceptance.ALIKE) * best.held_out
    return near and difference(other.errors, best.errors) > acceptance.P_DIFFERENT


def rivals(best: Tried, tried: Sequence[Tried], records: Records) -> list[Tried]:
    """Effects of other names that held-out records cannot separate from the accepted one, the best one first."""
    return [each for each in tried if each.name != best.name and alike(each, best, records.noise)]


def left_open(now: Fitted, best: Tried, tried: Sequence[Tried], records: Records) -> list[str]:
    """Names of those that fitted records cannot separate from the accepted one either."""
    least = best.fitted.rms
    others = [each for each in rivals(best, tried, records) if no_worse(each.fitted.rms, least, records.noise)]
    if records.one_loop:
        others += [each for each in tried if each.name != best.name and _explains_most(now, each, records)]
        if not is_noise(best.held_out, records.noise):  # held-out records do not confirm what fitted ones show
            others += [
                each
                for each in tried
                if each.name != best.name and takes_most(each.fitted.rms, now.rms, records.noise)
            ]
    return list(dict.fromkeys(each.name for each in others))


def _explains_most(now: Fitted, tried: Tried, records: Records) -> bool:
    """Whether it removes most of the held-out error above the noise."""
    return takes_most(tried.held_out, records.residual(now), records.noise)


def takes_most(residual: float, gap: float, noise: float) -> bool:
    """Whether a residual is a small part of a gap, both without the noise."""
    return apart(residual, noise) <= acceptance.MOST_OF_GAP * apart(gap, noise)


def bear_two(records: Records) -> bool:
    """Whether records can support a second name, or one beside an effect that a model has already."""
    return not (records.one_loop and records.one_speed)


def borne_out(residual: float, records: Records) -> bool:
    """Whether the final residual is small enough for the names that were found."""
    return not records.one_loop or residual <= acceptance.FAR_ABOVE_NOISE * records.noise


def _supported(now: Fitted, best: Tried, records: Records) -> bool:
    """Whether the records support a name, even if they are of one loop alone."""
    return not records.one_loop or ((now.bare or bear_two(records)) and _explains_most(now, best, records))


def no_worse(residual: float, least: float, noise: float) -> bool:
    """Whether an error is so close above the least one that the difference would not be an effect."""
    return apart(residual, least) < acceptance.FIRST_REMOVES * max(noise, least)


def difference(before: Sequence[Array], after: Sequence[Array]) -> float:
    """One-sided p-value of smaller squared errors after than before, over blocks longer than the errors' memory.

    Wilcoxon's signed-rank test: an effect may show in a few events, so that the mean alone is no measure.
    """
    from scipy.stats import wilcoxon

    gains = []
    for a, b in zip(before, after, strict=True):
        known = np.isfinite(a) & np.isfinite(b)
        gain = a[known] ** 2 - b[known] ** 2
        if len(gain) < 4:
            continue
        memory = round(acceptance.BLOCK_MEMORIES * correlation_time(gain))
        size = int(min(max(1, memory), max(1, len(gain) // acceptance.BLOCKS)))
        edges = np.arange(0, len(gain) - size + 1, size)
        gains.append(np.add.reduceat(gain[: edges[-1] + size], edges) / size)
    blocks = np.concatenate(gains) if gains else np.empty(0)
    if len(blocks) < 6 or not np.any(blocks):
        return 1.0
    return float(wilcoxon(blocks, alternative="greater").pvalue)
