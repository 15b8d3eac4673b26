"""Blocks of a user's own effects: their parameters, and their gains for signals and errors.

Such a block is linear, so calling its functions with unit states and inputs gives its matrices: forwards
`s <- A s + B x`, `y = C s + D x` by absorb, and backwards from y to x by solve followed by absorb. Sums over all
later samples are bounded mode by mode, `sum |C A^k B| <= sum |c_j b_j|/(1 - |lambda_j|)` in the eigenvectors of A, or
by sums of powers of A, whichever is smaller; only by powers if two modes coincide.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from hystgen.basics.jit import Answer, Scalar, jit
from hystgen.basics.structures import firsts
from hystgen.effects import own
from hystgen.effects.base import Array, Effect, Place
from hystgen.effects.kinds import Constants, OwnBlock
from hystgen.effects.part import Margin, One, Realized, Responses, Verbs
from hystgen.plays.slots import Counts, Reals

Glue = tuple[Answer, Answer, Answer]
"""The functions that connect an arithmetic to blocks: product, and conversions of a signal into a block and back."""

SAME = 1e-9
"""Largest relative difference between two answers of a block that counts as rounding: with time constants of up to a
million samples, a difference of states loses six digits."""


class OwnTables(NamedTuple):
    """Blocks on one side of the plays. `number` (m,): parameters, in fixed point an `own_fixed.FixedNumber`, those of
    block j from `first[j]` (k + 1) on; `place` (k + 1): where the memory of each block begins; `bits` (k,): bits of a
    block's signals below the chain's, in fixed point."""

    first: Counts
    number: Reals
    place: Counts
    bits: Counts


@dataclass(frozen=True)
class System:
    """The linear system `s <- a s + b x`, `y = c s + d x` with a state (n,)."""

    a: Array
    b: Array
    c: Array
    d: float

    def _modes(self) -> tuple[NDArray[np.complex128], ...] | None:
        """The reciprocal of each mode's loss per sample, the eigenvectors, and their inverse.

        None if two modes coincide, since the eigenvectors then do not span the states.
        """
        values, vectors = np.linalg.eig(self.a)
        if np.linalg.matrix_rank(vectors) < len(values):
            return None
        with np.errstate(divide="ignore"):
            return 1.0 / np.maximum(1.0 - np.abs(values), 0.0), vectors, np.linalg.inv(vectors)

    def _sums(self) -> Array:
        """A bound (n, n) on `sum |A^k|`, which `S + S |A^m|` extends to twice as many powers."""
        power, total = self.a, np.eye(len(self.b))
        with np.errstate(over="ignore", invalid="ignore"):
            while not np.max(np.sum(np.abs(power), axis=1), initial=0.0) <= 0.5:
                total = total + total @ np.abs(power)
                power = power @ power
                if not np.all(np.isfinite(total)):  # a mode does not decay
                    return np.full_like(total, math.inf)
        return total @ np.linalg.inv(np.eye(len(self.b)) - np.abs(power))

    @property
    def radius(self) -> float:
        """Spectral radius: the fraction of a disturbance that remains from one sample to the next in the long run."""
        return float(np.max(np.abs(np.linalg.eigvals(self.a)), initial=0.0))

    def states(self) -> Array:
        """Largest states (n,) for inputs of magnitude at most 1."""
        bound = self._sums() @ np.abs(self.b)
        if (modes := self._modes()) is not None:
            lost, vectors, back = modes
            bound = np.minimum(bound, np.abs(vectors) @ (np.abs(back @ self.b) * lost))
        return np.asarray(bound)

    def after(self) -> Array:
        """Sum (n,) of the output's absolute changes after one disturbance of each state."""
        bound = np.abs(self.c) @ self._sums()
        if (modes := self._modes()) is not None:
            lost, vectors, back = modes
            bound = np.minimum(bound, (np.abs(self.c @ vectors) * lost) @ np.abs(back))
        return np.asarray(bound)

    def once(self) -> Array:
        """Largest change (n,) of the output at any later sample after one disturbance of each state."""
        bound = self.after()
        if (modes := self._modes()) is not None:
            _, vectors, back = modes
            bound = np.minimum(bound, np.abs(self.c @ vectors) @ np.abs(back))
        return bound

    def before(self) -> float:
        """Largest output caused by earlier inputs of magnitude at most 1."""
        bound = float(self.after() @ np.abs(self.b))
        if (modes := self._modes()) is not None:
            lost, vectors, back = modes
            bound = min(bound, float(np.sum(np.abs(self.c @ vectors) * np.abs(back @ self.b) * lost)))
        return bound

    @property
    def largest(self) -> float:
        """Largest output for inputs of magnitude at most 1."""
        return abs(self.d) + self.before()

    def response(self, z: NDArray[np.complex128]) -> NDArray[np.complex128]:
        """Responses (N,) at `z` (N,), the factor z^-1 of a delay by one sample."""
        states = np.linalg.solve(np.eye(len(self.b)) - z[:, None, None] * self.a, self.b[:, None])[:, :, 0]
        return np.asarray(self.d + z * (states @ self.c))


@dataclass(frozen=True)
class Linear(One):
    """A block at one step length: its systems in both directions, gain at rest, and states (n,) at rest at input 1."""

    effect: Effect
    numbers: Array
    forward: System
    backward: System
    rest: float
    settled: Array

    @property
    def exact(self) -> bool:
        """Whether solve returns the input for which absorb returns the requested output."""
        f, b = self.forward, self.backward
        return abs(b.d * f.d - 1.0) <= SAME and bool(np.all(np.abs(b.c + b.d * f.c) <= SAME * (1.0 + np.abs(f.c))))

    @property
    def lead(self) -> float:
        """Largest gain of its inverse."""
        return max(self.backward.largest, 1.0)

    @property
    def growth(self) -> float:
        """Largest output for inputs of magnitude at most 1."""
        return self.forward.largest

    def solved(self, error: float, size: float, u: float, same: bool) -> float:  # noqa: ARG002  as in every block
        """Error of the input solved for, given an error of the output."""
        return self.passed(error) + self.rounding(size, u)[1]

    def led(self, error: float, drive: float, u: float, same: bool, turning: bool) -> float:  # noqa: ARG002
        """As `solved`, in front of the plays."""
        return self.solved(error, drive, u, same)

    def seen(self) -> float:
        """Factor by which states that see the block's input amplify an error of that input."""
        return self.passed(0.0, 1.0)

    @property
    def misses(self) -> bool:
        """Whether the signal that arrives can differ from the one solved for."""
        return True

    @property
    def ringing(self) -> Array:
        """Frequencies (k,) in rad per sample at which its inverse can ring."""
        return np.asarray(np.abs(np.angle(np.linalg.eigvals(self.backward.a))))

    def respond(self, z: NDArray[np.complex128], found: Responses) -> Responses:
        """Responses with this block added behind the others."""
        found = found._replace(rest=found.rest * self.rest)
        if not self.exact:
            return found._replace(led=found.led * self.backward.response(z))
        return found._replace(passed=found.passed * self.forward.response(z), direct=found.direct * self.forward.d)

    @property
    def fineness(self) -> float:
        """Bits of accuracy that its lead costs a signal in front of the plays."""
        return math.log2(2.0 * self.backward.largest)

    def at_rest(self, x: float) -> float:
        """The settled output for an input."""
        return x * self.rest

    def grown(self, size: float, margin: Margin) -> float:
        """Largest output for inputs of magnitude up to `size`."""
        return size * self.forward.largest * margin.slack + 1.0

    def asked(self, given: float, asked: float, margin: Margin) -> float:
        """Largest input from solve or resting for outputs of magnitude up to `asked`, after inputs up to `given`."""
        now, before = abs(self.forward.d), self.forward.before()
        return max((asked + before * given) / now, asked / self.rest) * margin.slack + 1.0

    def sizes(self) -> Array:
        """Largest states (n,) for inputs of magnitude at most 1, starting from rest at such an input."""
        return self.forward.states() + np.abs(self.settled)

    def rounding(self, size: float, u: float) -> tuple[float, float]:
        """Roundings of the output for inputs up to `size`, and of the inverse's answer for an exact output."""
        shares = self._shares(u)
        sizes = [Rounded(each, 0.0, u) for each in (size * self.sizes()).tolist()]
        state = np.array(sizes, dtype=object)
        y = _apply(self.effect, "absorb", shares, state, Rounded(size, 0.0, u))
        lost = np.array([each.error for each in state])
        begun = np.array(sizes, dtype=object)
        _apply(self.effect, "rest", shares, begun, Rounded(size, 0.0, u))
        started = self.forward.once() @ np.array([each.error for each in begun])
        forward = y.error + float(self.forward.after() @ lost + started)
        asked = Rounded(self.forward.largest * size, 0.0, u)
        x = _apply(self.effect, "solve", shares, np.array(sizes, dtype=object), asked)
        return forward, self.passed(forward, x.error)

    def passed(self, error: float, own: float = 0.0) -> float:
        """Error of the input for an error of the output, and for roundings `own` of solve.

        A limit can pass an input error on in part or not at all. A single state then lies between its values for these
        two cases. If earlier inputs count less in an output than the present one, input errors contract. If solve
        returns the input for which absorb returns the output, an input error acts like an error of the requested
        output, scaled by the weight of the present input.
        """
        forward, back = self.forward, self.backward
        before, now = forward.before(), abs(forward.d)
        if not self.exact:
            return back.largest * error + own * (1.0 + back.largest * forward.largest)
        error += now * own
        contracting = error / (now - before) if before < now else math.inf
        return min(back.largest * error, contracting)

    def _shares(self, u: float) -> NDArray[np.object_]:
        return np.array([Rounded(abs(each), u * abs(each), u) for each in self.numbers.tolist()], dtype=object)


@dataclass(frozen=True)
class Rounded:
    """A number of magnitude up to `size`, within `error` of its exact value; each operation rounds by `u`."""

    size: float
    error: float
    u: float

    def _made(self, size: float, error: float) -> Rounded:
        return Rounded(size, error + self.u * (size + error), self.u)

    def __add__(self, other: Rounded) -> Rounded:
        return self._made(self.size + other.size, self.error + other.error)

    def __mul__(self, other: Rounded) -> Rounded:
        error = self.error * other.size + other.error * self.size + self.error * other.error
        return self._made(self.size * other.size, error)

    def __neg__(self) -> Rounded:
        return self

    __sub__ = __add__


def _apply(effect: Effect, verb: str, *given: object) -> Any:
    assert effect.block is not None
    return getattr(effect.block, verb)(*given)


def linear(effect: Effect, seconds: float) -> Linear:
    """The block of an effect at steps of `seconds`. Raises EffectsError if its functions fail or cannot become C."""
    assert effect.block is not None
    own.check(type(effect))
    one, n = own.Instance(effect), len(effect.block.state)
    one.advance(seconds)
    systems = []
    for back in (False, True):
        found = []
        for j in range(n + 1):
            one.state[:] = 0.0
            one.state[:n] = np.eye(n + 1)[j, :n]
            x = float(j == n)
            if back:
                x = answer = one.solve(x)
                one.absorb(x)
            else:
                answer = one.absorb(x)
            found.append((one.state.copy(), answer))
        states, outputs = np.array([s for s, _ in found]).T, np.array([y for _, y in found])
        systems.append(System(states[:, :n], states[:, n], outputs[:n], float(outputs[n])))
    rest = one.rest(1.0)
    return Linear(effect, one.table, systems[0], systems[1], rest, one.state.copy())


def problems(effect: Effect, seconds: float, fixed: bool) -> Iterator[str]:
    """Reasons why the C cannot include an effect's block, in fixed or floating point."""
    assert effect.block is not None
    one = linear(effect, seconds)
    if not _adds_up(one, seconds):
        yield "its block is not linear: the answer to a sum is not the sum of the answers"
        return
    instance = own.Instance(effect)
    instance.advance(seconds)
    settled = instance.rest(2.0)
    before = instance.state.copy()
    instance.advance(2.0 * seconds)
    stays = abs(instance.absorb(2.0) - settled) <= SAME * max(abs(settled), 1.0)
    if not stays or np.max(np.abs(instance.state - before)) > SAME * max(1.0, float(np.max(np.abs(before)))):
        yield (
            "its block does not stay at rest: after rest, absorb of the same input must return the same output, "
            "at steps of any length"
        )
    elif abs(instance.resting(settled) - 2.0) > SAME:
        yield f"resting({settled:g}) is {instance.resting(settled):g}, but rest(2) is {settled:g}; they must be inverse"
    elif one.rest <= 0.0:
        yield f"its output at rest is {one.rest:g} times its input, but the inverse needs a positive factor"
    elif max(one.forward.radius, one.backward.radius) >= 1.0:
        where, radius = max(("its block", one.forward.radius), ("its inverse", one.backward.radius), key=lambda e: e[1])
        yield f"{where} keeps {radius:.6g} of a disturbance from one sample to the next, but a disturbance must decay"
    elif effect.place is Place.DRIVE and (abs(one.rest - 1.0) > SAME or one.forward.largest > 1.0 + SAME):
        yield (
            f"in front of the plays a block must pass a drive at rest unchanged and not overshoot; this one passes "
            f"{one.rest:g} of it at rest and up to {one.forward.largest:g} on the way"
        )
    elif fixed and not one.exact:
        yield (
            "its solve does not return the input for which absorb returns the requested output, which the formats of "
            "fixed point rely on; use float32"
        )
    elif fixed and not _stays_for_solve(effect, seconds):
        yield "its solve changes the memory, but fixed point bounds only what absorb and rest do; leave that to absorb"


def _stays_for_solve(effect: Effect, seconds: float) -> bool:
    """Whether solve leaves the memory unchanged."""
    instance = own.Instance(effect)
    instance.advance(seconds)
    before = np.random.default_rng(0).normal(size=len(instance.state))
    instance.state[:] = before
    instance.solve(1.0)
    return bool(np.all(instance.state == before))


def _adds_up(one: Linear, seconds: float) -> bool:
    """Whether a block is linear: it answers random states and inputs like the system made of its unit responses."""
    rng = np.random.default_rng(0)
    instance = own.Instance(one.effect)
    instance.advance(seconds)
    for _ in range(8):
        s, x = rng.normal(size=len(instance.state)), float(rng.normal())
        for back, system in ((False, one.forward), (True, one.backward)):
            instance.state[:] = s
            answer = instance.solve(x) if back else instance.absorb(x)
            if back:
                instance.absorb(answer)
            wanted, states = float(system.c @ s + system.d * x), system.a @ s + system.b * x
            scale = 1.0 + float(np.abs(system.c) @ np.abs(s)) + abs(system.d * x) + float(np.max(np.abs(states)))
            if max(abs(answer - wanted), float(np.max(np.abs(instance.state - states)))) > SAME * scale:
                return False
    return True


def build(every: Sequence[Linear], reals: Callable[[ArrayLike, str], Reals]) -> OwnTables:
    """The tables of the blocks on one side of the plays."""
    return OwnTables(
        firsts(len(each.numbers) for each in every),
        reals(np.concatenate([np.empty(0), *(each.numbers for each in every)]), "parameters of your own effects"),
        firsts(len(each.settled) for each in every),
        np.zeros(len(every), dtype=np.int64),
    )


def constants(t: OwnTables, kinds: Sequence[type[Effect]], products: int = 1) -> list[Constants]:
    """The parameters of the blocks of each of these effects; `products`: multiplications per product of a block."""
    found = []
    for j, effect in enumerate(kinds):
        assert effect.block is not None
        numbers = dict(zip(effect.block.table, t.number[t.first[j] : t.first[j + 1]], strict=True))
        absorb, solve = effect.block.products
        found.append(Constants(own.kind(effect), numbers, (products * absorb, products * solve), bits=int(t.bits[j])))
    return found


# ---------------------------------------------------------------- product_float.c


@jit(inline=True)
def product(number: Scalar, x: Scalar) -> Scalar:
    """A number of the table times x."""
    return number * x


@jit(inline=True)
def passed(t: OwnTables, j: int, x: Scalar) -> Scalar:  # noqa: ARG001  as in fixed point
    """A signal of the chain as one of block j, or the reverse: the value is the same."""
    return x


# ---------------------------------------------------------------- as a part of the chain


def memory(t: OwnTables, dtype: DTypeLike) -> Reals:
    """Memory (m,) of all blocks on one side of the plays."""
    return np.zeros(t.place[-1], dtype)


def arithmetic(
    blocks: Sequence[OwnBlock], effects: Sequence[type[Effect]], made: Glue, products: int,
    tables: Callable[..., object], formats: Callable[..., object] = lambda one, *_: one,
) -> Realized:
    """Blocks on one side of the plays in series, as one block of the chain; `products`: multiplications per product of
    a block; `tables`, `formats`: as in `Realized`."""

    def through(verb: str) -> Answer:
        calls = [_one(made, block, verb, j) for j, block in enumerate(blocks)]
        return functools.reduce(_both, calls[::-1] if verb in ("solve", "resting") else calls)

    verbs = Verbs(memory)
    if blocks:
        verbs = Verbs(memory, through("rest"), through("absorb"), through("resting"), through("solve"))
    return Realized(verbs, lambda t: constants(t, effects, products), tables, formats)


def _both(first: Answer, behind: Answer) -> Answer:
    """A verb of two blocks in series."""

    @jit
    def both(t: OwnTables, s: Reals, j: int, x: Scalar) -> Scalar:
        return behind(t, s, j, first(t, s, j, x))

    return both


def _one(made: Glue, block: OwnBlock, verb: str, j: int) -> Answer:
    """A verb of block j, bound to its parameters and memory."""
    product, entered, left = made
    function = block.compiled(verb, product)
    if verb == "resting":

        @jit
        def resting(t: OwnTables, s: Reals, k: int, y: Scalar) -> Scalar:  # noqa: ARG001  as in every block
            return left(t, j, function(t.number[t.first[j] : t.first[j + 1]], entered(t, j, y)))

        return resting

    @jit
    def call(t: OwnTables, s: Reals, k: int, x: Scalar) -> Scalar:  # noqa: ARG001  as in every block
        row, memory = t.number[t.first[j] : t.first[j + 1]], s[t.place[j] : t.place[j + 1]]
        return left(t, j, function(row, memory, entered(t, j, x)))

    return call


GLUE: Glue = product, passed, passed
