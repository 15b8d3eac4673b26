"""Effects that the user knows to be there: fitted whatever the records say, and judged by the rules for names."""

from __future__ import annotations

import itertools
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np

from hystgen import effects
from hystgen.basics.problems import nearest, printable
from hystgen.diagnosis.search import acceptance, fits, ranges, screening, selection
from hystgen.diagnosis.search.fits import Fitted
from hystgen.diagnosis.search.screening import Option, Records, Tried
from hystgen.diagnosis.search.selection import EXTENDED, Found, Merit, Outcome, Ranked, Refusal
from hystgen.effects.base import Effect
from hystgen.identification.pi import IdentificationError


def check(names: Sequence[str], user: Sequence[type[Effect]], there: Collection[str]) -> None:
    """Raise ValueError, with one message, for a name that is not an effect, is repeated, or is already in the model.

    `user`: the user's own effects; `there`: names of what the nominal model contains.
    """
    known = [*effects.CATALOGUE, effects.BEND, *dict.fromkeys(map(screening.name_of, user))]
    strange = [name for name in names if name not in known]
    if strange:
        close = nearest(strange[0], known)
        hint = close and f" ({close})"
        said = ", ".join(f'"{printable(name)}"' for name in strange)
        raise ValueError(f"there is no effect {said}{hint}; the effects are {', '.join(known)}")
    if doubled := [name for name in names if names.count(name) > 1]:
        raise ValueError(f"{doubled[0]} is named twice among the known effects; name it once")
    if both := [name for name in names if name in there]:
        raise ValueError(
            f"the model already has {' and '.join(both)}, which a diagnosis refits and keeps; leave "
            f"{'it' if len(both) == 1 else 'them'} out of the known effects"
        )


@dataclass(frozen=True)
class Known:
    """The refitted model `plain`, and `fitted`, the same with the known effects; `chosen`: the shape of each, by name,
    in the user's order; `rankings`: all shapes that were fitted, effect by effect."""

    plain: Fitted
    fitted: Fitted
    chosen: dict[str, Tried]
    rankings: tuple[tuple[Ranked, ...], ...] = ()


def added(now: Fitted, names: Sequence[str], records: Records) -> Known:
    """The refitted model with these effects added one by one, each in the shape that the rules for names prefer.

    The shapes of all but the last were chosen while later effects were missing, so they are chosen again with all
    others in place. Raises IdentificationError for an effect that cannot be fitted from these records.
    """
    plain, chosen, tried = now, dict[str, Tried](), dict[str, list[Tried]]()
    for name in names:
        chosen[name], tried[name] = _best(now, name, records)
        now = chosen[name].fitted
    for name in names[:-1]:
        less = selection.without_refit(now, name, records)  # a refit could move the others' parameters far
        if less is None:
            continue
        other, shapes = _best(less, name, records)
        if selection.better(other.fitted, now, [*records.to_fit, *records.held]):
            chosen[name], tried[name], now = other, shapes, other.fitted
    rankings = tuple(
        tuple(Ranked(each, None if each is chosen[name] else Refusal("other")) for each in tried[name])
        for name in names
    )
    return Known(plain, now, chosen, rankings)


def _best(now: Fitted, name: str, records: Records) -> tuple[Tried, list[Tried]]:
    """The preferred shape of an effect beside a hypothesis, and all its shapes that were fitted."""

    def belongs(option: Option) -> bool:
        return option.name == name or (option.front and name in effects.FRONTS)

    if name in effects.CATALOGUE:
        missing = sorted(set(effects.shapes(name)[0].columns) - records.known.columns)
        if missing:
            raise IdentificationError(
                f"{name} cannot be fitted: not every record has a column {missing[0]}; say which one it is with "
                f"--columns {missing[0]}=NAME, or leave out {name}"
            )
        if effects.shapes(name)[0].timed and not records.known.timed:
            raise IdentificationError(
                f"{name} cannot be fitted: not every record has a time; give --sample-time, or leave out {name}"
            )
    tried = records.extensions(now, belongs, whatever=True)
    tried = [each for each in tried if name in each.names] or [each for each in tried if name == effects.BEND]
    if not tried:
        raise IdentificationError(
            f"{name} cannot be fitted: none of its shapes can be tried on these records; leave it out, or record "
            "the drives that hystgen diagnose --plan writes"
        )
    best = selection.simplest_first(tried, records)[0]
    marked = tuple(replace(part, known=part.known or part.name == name) for part in best.fitted.structure.parts)
    best = replace(best, fitted=replace(best.fitted, structure=replace(best.fitted.structure, parts=marked)))
    return best, [best, *(each for each in tried if each.option is not best.option)]


def complete(outcome: Outcome, records: Records) -> Outcome:
    """The outcome of a search that named nothing, with the known effects fitted to all samples."""
    if outcome.found:
        return outcome
    now = outcome.fitted
    return replace(outcome, fitted=fits.fit(now.structure, records.full, now.shape, now.weights))


def judged(outcome: Outcome, known: Known, records: Records, wild: Refusal | None) -> Outcome:
    """The outcome with the known effects before those found, each with the reason why no search would name it, or None.

    Each is judged with all others in place, as the search judges effects beside each other; then all together, as
    `borne_out` does. `wild`: a refusal due to their inverse.
    """
    final, names = outcome.fitted, list(known.chosen)
    together = selection.borne_out(final, known.plain, records) or wild
    gap = records.residual(known.plain)
    last = outcome.found[0].before if outcome.found else records.residual(final)
    left = [gap, *_between(known, names, records), last]
    found = []
    for name, (before, after) in zip(names, itertools.pairwise(left), strict=True):
        tried = known.chosen[name]
        refused: Refusal | None = Refusal("little", 0.0, acceptance.FIRST_REMOVES * records.noise)
        p_value = 1.0
        without = selection.without_effect(final, name, records)
        if without is not None:
            errors = final.errors(records.held)
            here = replace(tried, fitted=_at_the_end(final, name), held_out=records.residual(final), errors=errors)
            merit = selection.judged(without, here, records, acceptance.FIRST_REMOVES)
            p_value = selection.chance(without, here, records)
            refused = merit if isinstance(merit, Refusal) else together
            if isinstance(merit, Merit) and not merit.worth(gap, records):
                refused = Refusal("small", merit.removed / gap, acceptance.NAME_SHARE)
        found.append(Found(name, tried.option.label, before, after, p_value, (), True, refused))
    ends = ranges.ends(final, None, acceptance.is_noise(records.residual(final), records.noise))
    return replace(
        outcome, refitted=known.plain, found=(*found, *outcome.found), rankings=(*known.rankings, *outcome.rankings),
        ends=outcome.ends or ends, written=EXTENDED,
    )


def _between(known: Known, names: Sequence[str], records: Records) -> list[float]:
    """Held-out rms before each of the known effects except the first, in their order."""
    now, found = known.fitted, list[float]()
    for name in names[:0:-1]:
        now = selection.without_effect(now, name, records) or now
        found.append(records.residual(now))
    return found[::-1]


def _at_the_end(now: Fitted, name: str) -> Fitted:
    """The same hypothesis with an effect's part last, where the rules look for the effect in question."""
    front, numbers = now.structure.pieces(now.shape)
    parts = sorted(zip(now.structure.parts, numbers, strict=True), key=lambda pair: pair[0].name == name)
    shape = [front, *(x for _, x in parts)]
    return replace(
        now, structure=replace(now.structure, parts=tuple(part for part, _ in parts)), shape=np.concatenate(shape)
    )
