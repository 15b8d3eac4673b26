"""Densities of the continuous model, and the thresholds and weights that represent them.

The continuous model is `y = p0 v + int_0^R p(r) play_r[v] dr` (18 of the note). `[0, R]` is divided into n equal
cells; each becomes one play with the cell's mass as its weight and the cell's centroid as its threshold.

Error of the initial loading curve (19). Let D be the continuous curve minus that of the play sum. Since each cell keeps
its mass and first moment, D and its slope vanish at every cell boundary. In a cell [a, b] with threshold c the slope of
D grows by the density, `D'' = p >= 0`, except that it drops by the whole mass at c: D rises from 0 up to c and then
falls back to 0. So the play sum never lies above the curve, and at most `D(c) = int_a^c (c - r) p(r) dr` below it.

Error of the output, for every drive and history. The plays' states s(r) satisfy `|s(r) - s(r')| <= |r - r'|`. A cell of
mass m contributes an error of `|int p s dr - m s(c)| <= int p |r - c| dr`, which is `2 D(c)` because both sides of the
centroid c have the same moment. The sum of `2 D(c)` over the cells is a bound, and it is tight: a history that turns at
every threshold and every boundary reaches it.

Everything is computed with 40 digits and rounded to double once at the end, so that every machine gets the same
numbers. A formula is replaced by polynomials on panels that are halved until the polynomials agree with it; the bound
includes the remaining difference.

The work is limited by operation counts, not time, so the limit is the same on every machine: no formula of the
permitted length takes longer than about 10 s.
"""

from __future__ import annotations

import math
import re
from bisect import bisect_right
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from itertools import pairwise
from typing import TYPE_CHECKING, Any

from hystgen.basics.arguments import finite, positive, whole_from
from hystgen.basics.quantities import MAX_PLAYS

if TYPE_CHECKING:
    from mpmath.ctx_mp import MPContext
    from mpmath.ctx_mp_python import mpf

MAX_FORMULA = 1000
"""[characters] A longer formula is refused before it is parsed."""
FUNCTIONS = ("exp", "log", "sqrt", "sin", "cos", "tanh")

_DIGITS = 40
"""Decimal digits of the arithmetic: converting a panel's polynomial to powers loses six of them, and 34 remain."""
_DEGREE = 16
"""Degree of the polynomials; a panel evaluates the formula 33 times."""
_FIRST_PANELS = 64
"""Initial number of panels, enough to detect a narrow peak."""
_MAX_PANELS = 600
"""Maximum number of panels: a formula that needs more has a pole or oscillates too fast."""
_MAX_HALVINGS = 60
"""Maximum number of halvings from the range to a panel; beyond it the panel's ends are the same double."""
_PRECISION = 1e-20
"""Largest error of a panel's polynomial, relative to the whole mass."""
_LARGEST_EXPONENT = 1000
_SMALLEST_EXPONENT = -4000
"""Binary exponents: above the first an intermediate value is refused, below the second it is taken as 0."""
_LARGE_POWER = 1 << 16
"""Exponents of `**` above which a power is computed from the logarithm."""
_MAX_OPERATIONS = 2_000_000
"""Total number of operations allowed for a formula, 1 to 5 us each (tests/test_density.py has the slowest formulas). A
sum of 29 bell curves, about the longest that fits into a formula, takes 600 000."""


class DensityError(ValueError):
    """A density that cannot be used: `part` is the key at fault; the message says what is wrong and what to do."""

    def __init__(self, part: str, message: str) -> None:
        self.part = part
        super().__init__(message)


@dataclass(frozen=True)
class Discretisation:
    """Play sum of a density: `thresholds` (r_0 = 0 first), `weights` (p_0 first), same length.

    `error` bounds the distance of the initial loading curve from the continuous one on `[0, R]`, in output units;
    beyond R the slopes differ only by rounding. `output_error` bounds the output's error for every drive and history
    that keep the plays within R of zero; further out, rounding of the weights adds an error in proportion to the plays.
    """

    thresholds: tuple[float, ...]
    weights: tuple[float, ...]
    error: float
    output_error: float


@cache
def _context() -> MPContext:
    """A multiple-precision context of this package; the global one belongs to the user."""
    from mpmath.ctx_mp import MPContext

    context = MPContext()
    context.dps = _DIGITS
    return context


# Formulas ------------------------------------------------------------------------------------------------

_TOKEN = re.compile(
    r"\s*(?:(?P<number>(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][-+]?[0-9]+)?)"
    r"|(?P<word>[A-Za-z_][A-Za-z_0-9]*)|(?P<sign>\*\*|[-+*/()])|(?P<other>\S))"
)
_BINDING = {"+": 1, "-": 1, "*": 2, "/": 2, "negate": 3, "**": 4}


@dataclass(frozen=True)
class Formula:
    """A parsed formula: its text, and its steps in postfix order (numbers as text, `r`, operators, functions)."""

    text: str
    steps: tuple[str, ...]

    @cached_property
    def _compiled(self) -> tuple[tuple[int, Any], ...]:
        mp = _context()
        operators: dict[str, tuple[int, Callable[..., mpf]]] = {
            "+": (2, lambda a, b: a + b),
            "-": (2, lambda a, b: a - b),
            "*": (2, lambda a, b: a * b),
            "/": (2, lambda a, b: a / b),
            "**": (2, _power),
            "negate": (1, lambda a: -a),
        }
        operators.update((name, (1, getattr(mp, name))) for name in FUNCTIONS)
        return tuple(operators.get(step) or (0, None if step == "r" else mp.mpf(step)) for step in self.steps)

    def __call__(self, r: mpf) -> mpf:
        """Value at `r` with 40 digits. Raises DensityError where it has no value."""
        real = _context().mpf
        r = real(r)
        stack: list[mpf] = []
        for count, step in self._compiled:
            if count == 0:
                stack.append(r if step is None else step)
                continue
            arguments = stack[-count:]
            try:
                value = step(*arguments)
            except (ZeroDivisionError, ValueError, OverflowError):
                value = None
            if not isinstance(value, real):
                raise DensityError("formula", f"has no real value at r = {_short(r)}; correct the formula or r_max")
            _, mantissa, exponent, bits = value._mpf_
            if (mantissa == 0 and exponent != 0) or exponent + bits > _LARGEST_EXPONENT:
                raise DensityError("formula", f"is not finite at r = {_short(r)}; correct the formula or r_max")
            stack[-count:] = [value if exponent + bits > _SMALLEST_EXPONENT else real(0)]
        return stack[0]


def _power(base: mpf, exponent: mpf) -> mpf:
    """`base**exponent`. Raises ValueError where it is not real.

    A power with a large exponent is computed from the logarithm, with extra bits to make up for its loss: an integer
    power would take up to a thousand squarings of ever longer numbers.
    """
    mp = _context()
    if abs(exponent) <= _LARGE_POWER or base == 0:
        return base**exponent
    if base < 0 and not mp.isint(exponent):
        raise ValueError("no real power")
    with mp.extraprec(40):
        size = mp.exp(exponent * mp.log(abs(base)))
    return -size if base < 0 and exponent % 2 == 1 else +size


def parse_formula(text: str) -> Formula:
    """Parse `+ - * / ** ( ) r numbers` and the functions exp, log, sqrt, sin, cos, tanh.

    As usual, `**` binds tightest and to the right, then the sign in front of a value: `-r**2` is `-(r**2)`.
    Raises DensityError with the position (from 1) of the character at which the formula goes wrong.
    """
    if len(text) > MAX_FORMULA:
        raise DensityError("formula", f"has {len(text)} characters, more than {MAX_FORMULA}; shorten it")
    steps: list[str] = []
    waiting: list[tuple[str, int]] = []  # operators, functions and open brackets, with their positions
    operand_next = True
    for match in _TOKEN.finditer(text):
        token, at = match[match.lastgroup or 0], match.start(match.lastgroup or 0) + 1
        after_function = bool(waiting) and waiting[-1][0] in FUNCTIONS
        if match["other"]:
            hint = "; a power is written **" if token == "^" else "; use + - * / ** ( ), numbers and r"
            raise _wrong(f"unexpected {_quoted(token)}", at, hint)
        if after_function and token != "(":
            raise _wrong(f"{waiting[-1][0]} without its argument", waiting[-1][1], "; write it in ( )")
        if match["number"] or match["word"]:
            if match["word"] and token != "r" and token not in FUNCTIONS:
                raise _wrong(
                    f"unknown name {token[:30]}", at, f"; the variable is r, the functions are {_FUNCTION_LIST}"
                )
            if not operand_next:
                raise _wrong(f"unexpected {token[:30]}", at, "; put an operator in front of it")
            if token in FUNCTIONS:
                waiting.append((token, at))
            else:
                steps.append(_number(token, at) if match["number"] else token)
                operand_next = False
        elif token == "(":
            if not operand_next:
                raise _wrong("unexpected '('", at, "; put an operator in front of it")
            waiting.append((token, at))
        elif operand_next:
            if token not in "+-":
                raise _wrong(f"unexpected '{token}'", at, "; a number, r, a function or ( is expected there")
            if token == "-":
                waiting.append(("negate", at))
        elif token == ")":
            while waiting and waiting[-1][0] != "(":
                steps.append(waiting.pop()[0])
            if not waiting:
                raise _wrong("unexpected ')'", at, "; remove it or open the bracket")
            waiting.pop()
            if waiting and waiting[-1][0] in FUNCTIONS:
                steps.append(waiting.pop()[0])
        else:
            tightest = _BINDING[token] + (token == "**")  # ** binds to the right: an earlier ** waits
            while waiting and _BINDING.get(waiting[-1][0], 0) >= tightest:
                steps.append(waiting.pop()[0])
            waiting.append((token, at))
            operand_next = True
    if operand_next:
        what = "is empty" if not text.strip() else "ends too early"
        raise DensityError("formula", f"{what}; a number, r, a function or ( is expected at the end")
    while waiting:
        token, at = waiting.pop()
        if token == "(":
            raise _wrong("'(' is not closed", at, "; add )")
        steps.append(token)
    return Formula(text, tuple(steps))


_FUNCTION_LIST = f"{', '.join(FUNCTIONS[:-1])} and {FUNCTIONS[-1]}"


def _wrong(what: str, character: int, hint: str) -> DensityError:
    return DensityError("formula", f"{what} at character {character}{hint}")


def _quoted(token: str) -> str:
    return f"'{token}'" if token.isprintable() else f"character U+{ord(token):04X}"


def _number(token: str, at: int) -> str:
    vanished = float(token) == 0.0 and re.search("[1-9]", re.split("[eE]", token)[0])
    if vanished or float(token) > 1e300:
        raise _wrong(f"number {token[:30]} out of range", at, "; keep to 1e-300 .. 1e300")
    return token


def _short(r: mpf) -> str:
    return f"{float(r):.6g}"


# Densities as polynomials on panels -----------------------------------------------------------------------


def _polynomial(coefficients: Sequence[mpf], t: mpf) -> mpf:
    """Value at t; coefficients from the highest power down."""
    value = 0
    for c in coefficients:
        value = value * t + c
    return value


class _Panel:
    """Density on `[start, end]` as a polynomial `sum c_k t**k` of `t = (r - middle)/half` in [-1, 1]."""

    def __init__(self, start: mpf, end: mpf, coefficients: Sequence[mpf], error: float = 0.0) -> None:
        self.start, self.end, self.error = start, end, error
        self.middle, self.half = (start + end) / 2, (end - start) / 2
        integral = [c * self.half / (k + 1) for k, c in enumerate(coefficients)]
        lever = [c * self.half**2 / (k + 2) for k, c in enumerate(coefficients)]
        self._mass = [*reversed(integral), -sum(a if k % 2 else -a for k, a in enumerate(integral))]
        self._lever = [*reversed(lever), 0, -sum(-a if k % 2 else a for k, a in enumerate(lever))]

    def moments(self, r: mpf) -> tuple[mpf, mpf]:
        """Integrals of p and of r p over `[start, r]`."""
        t = (r - self.middle) / self.half
        mass = _polynomial(self._mass, t)
        return mass, self.middle * mass + _polynomial(self._lever, t)


class Density:
    """A density `p(r) >= 0` on `[0, r_max]`, zero beyond; made by `from_formula` or `from_table`."""

    def __init__(self, panels: Sequence[_Panel], part: str) -> None:
        self._part = part
        self._panels = panels
        self._starts = [panel.start for panel in panels]
        self.r_max = panels[-1].end
        mass = moment = _context().mpf(0)
        self._before: list[tuple[mpf, mpf]] = []
        for panel in panels:
            self._before.append((mass, moment))
            m, s = panel.moments(panel.end)
            mass, moment = mass + m, moment + s
        self._total = mass
        self._noise = sum(panel.error for panel in panels)

    def _moments(self, r: mpf) -> tuple[mpf, mpf]:
        """Integrals of p and of r p over `[0, r]`."""
        i = max(bisect_right(self._starts, r) - 1, 0)
        mass, moment = self._panels[i].moments(r)
        return self._before[i][0] + mass, self._before[i][1] + moment

    def discretise(self, p0: float, n: int) -> Discretisation:
        """Thresholds and weights of n equal cells of the density (18), after `r_0 = 0` and `p0`.

        `p0` and the weights in output per input unit; thresholds in input units; `n` at least 1. Raises ValueError for
        other numbers, DensityError for cells so narrow that thresholds coincide.
        """
        finite(p0=p0)
        whole_from(1, n=n)
        thresholds, weights = [0.0], [p0]
        worst = total = start = mass = moment = _context().mpf(0)
        for i in range(1, n + 1):
            end = self.r_max * i / n
            mass_end, moment_end = self._moments(end)
            weight, threshold = mass_end - mass, (start + end) / 2
            if weight > self._noise:
                threshold = min(max((moment_end - moment) / weight, start), end)
                mass_there, moment_there = self._moments(threshold)
                below = threshold * (mass_there - mass) - (moment_there - moment)
                worst, total = max(worst, below), total + 2 * below
            else:
                weight = 0
            thresholds.append(float(threshold))
            weights.append(float(weight))
            if not thresholds[-2] < thresholds[-1]:
                what = f"two of {n} thresholds coincide at r = {_short(threshold)}"
                raise DensityError(self._part, f"{what}; take fewer, or a wider density")
            start, mass, moment = end, mass_end, moment_end
        # Further errors: polynomials that differ from the formula, cells set to zero, weights and thresholds in double.
        margin = 2 * ((n + 2) * self._noise + 2.0**-52 * self._total) * self.r_max
        errors = (
            0.0 if self._total == 0 else math.nextafter(float(bound + margin), math.inf) for bound in (worst, total)
        )
        return Discretisation(tuple(thresholds), tuple(weights), *errors)

    def discretise_to(self, p0: float, tolerance: float) -> Discretisation:
        """The fewest equal cells of the density (18), up to 4096, whose error bound is at most `tolerance`.

        `tolerance` > 0, of the loading curve (19), in output units; `p0` in output per input unit. The bound falls like
        1/n**2; the search assumes that it falls with every n. Raises ValueError for other numbers, and DensityError,
        with the bound that can be reached, if 4096 are not enough.
        """
        positive(tolerance=tolerance)
        too_few, enough, found = 0, MAX_PLAYS + 1, None
        n, tries = 16, 0
        while enough - too_few > 1:
            candidate = self.discretise(p0, n)
            if candidate.error <= tolerance:
                enough, found = n, candidate
            else:
                too_few = n
            tries += 1
            guess = math.ceil(min(n * math.sqrt(candidate.error / tolerance), MAX_PLAYS))
            n = min(max(guess, too_few + 1), enough - 1) if tries < 6 else (too_few + enough) // 2
        if found is None:
            reach = f"{1.005 * self.discretise(p0, MAX_PLAYS).error:.3g}"
            what = f"{tolerance!r} is not reached with {MAX_PLAYS} thresholds"
            raise DensityError("tolerance", f"{what}; ask for {reach} or more")
        return found


def from_table(r: Sequence[float], p: Sequence[float]) -> Density:
    """Piecewise linear density through the points `(r, p)`, zero outside them.

    `r` rises strictly from 0 or more, `p >= 0`, both of the same length of at least 2; the caller has checked that.
    """
    real = _context().mpf
    knots = [real(x) for x in r]
    panels = [_Panel(real(0), knots[0], [real(0)])] if knots[0] > 0 else []
    for i in range(len(knots) - 1):
        a, b = real(p[i]), real(p[i + 1])
        panels.append(_Panel(knots[i], knots[i + 1], [(a + b) / 2, (b - a) / 2]))
    return Density(panels, "table")


@cache
def _fit() -> tuple[list[mpf], list[mpf], list[list[mpf]]]:
    """Chebyshev points, the points between them, and the matrix from samples to powers of t."""
    mp = _context()
    n = _DEGREE
    nodes = [mp.cos(mp.pi * j / n) for j in range(n + 1)]
    between = [mp.cos(mp.pi * (2 * j + 1) / (2 * n)) for j in range(n)]
    powers = [[1], [0, 1]]  # Chebyshev polynomials as powers of t
    for k in range(2, n + 1):
        twice = [0] + [2 * c for c in powers[k - 1]]
        powers.append([c - (powers[k - 2][i] if i < k - 1 else 0) for i, c in enumerate(twice)])
    matrix = [[mp.mpf(0)] * (n + 1) for _ in range(n + 1)]
    for j in range(n + 1):
        for k in range(n + 1):
            share = mp.cos(mp.pi * (j * k) / n) * 2 / n / (2 if j in (0, n) else 1) / (2 if k in (0, n) else 1)
            for i, c in enumerate(powers[k]):
                matrix[i][j] += c * share
    return nodes, between, matrix


def from_formula(formula: Formula, r_max: float) -> Density:
    """The formula on `[0, r_max]`, r_max > 0.

    Raises DensityError if it has no finite real value, is negative, does not become smooth under repeated halving
    (a pole, or oscillations too fast to follow), or takes more than 2 million operations.
    """
    mp = _context()
    nodes, between, matrix = _fit()
    end = mp.mpf(r_max)
    lowest, highest = (mp.inf, mp.mpf(0)), mp.mpf(0)
    panels_within = _MAX_OPERATIONS // (len(formula.steps) * (len(nodes) + len(between)))

    def fit(a: mpf, b: mpf) -> _Panel:
        nonlocal lowest, highest, panels_within
        panels_within -= 1
        if panels_within < 0:
            what = f"takes too long to integrate: {len(formula.steps)} operations at too many values of r"
            raise DensityError("formula", f"{what}; shorten it, or give the density as a table")
        middle, half = (a + b) / 2, (b - a) / 2
        samples = [formula(middle + half * t) for t in nodes]
        checks = [formula(middle + half * t) for t in between]
        coefficients = [mp.fdot(row, samples) for row in matrix]
        miss = max(abs(_polynomial(coefficients[::-1], t) - s) for t, s in zip(between, checks, strict=True))
        for t, s in zip((*nodes, *between), (*samples, *checks), strict=True):
            lowest, highest = min(lowest, (s, middle + half * t)), max(highest, abs(s))
        return _Panel(a, b, coefficients, miss * (b - a))

    if panels_within < _FIRST_PANELS:
        what = f"has {len(formula.steps)} operations, too many to integrate"
        raise DensityError("formula", f"{what}; shorten it, or give the density as a table")
    edges = [end * i / _FIRST_PANELS for i in range(_FIRST_PANELS + 1)]
    first = [fit(a, b) for a, b in pairwise(edges)]
    allowed = _PRECISION * sum(abs(panel.moments(panel.end)[0]) for panel in first)
    todo, panels = first[::-1], []
    while todo:
        panel = todo.pop()
        if panel.error <= allowed:
            panels.append(panel)
            continue
        narrow = panel.end - panel.start < end * mp.mpf(2) ** -_MAX_HALVINGS
        if narrow or len(panels) + len(todo) > _MAX_PANELS:
            what = f"cannot be integrated: no smooth function near r = {_short(panel.middle)}"
            raise DensityError("formula", f"{what}; remove the pole or the fast oscillation")
        todo += [fit(panel.middle, panel.end), fit(panel.start, panel.middle)]
    if lowest[0] < -1e-30 * highest:
        what = f"p(r) is negative, {_short(lowest[0])} at r = {_short(lowest[1])}"
        raise DensityError("formula", f"{what}; change the formula or r_max so that p(r) >= 0")
    return Density(panels, "formula")
