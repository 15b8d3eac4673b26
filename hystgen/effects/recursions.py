"""What the effects do sample by sample, compiled when first used."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from hystgen.basics.jit import jit
from hystgen.plays.operators import followed

Array = NDArray[np.float64]

MOST_PIECES = 1000
"""A step of a nonlinear relaxation is cut into at most so many."""

CLOSE = 1e-7
"""Error of a piece of a nonlinear relaxation, in largest thresholds."""

SLOW = 1.0
"""Share of a disturbance that friction may take in a piece by the Taylor series."""

NEARLY = 0.3
"""Share of a stretch by which it may change in a piece whose curvature counts with its leading term."""

SLIGHT = 1e-4
"""Share of the speed that friction may take while what it takes is summed along the way without it."""


@jit
def follow(u: Array, decay: Array, early: Array, late: Array, x: float, out: Array) -> None:
    """First-order filter from the state `x`: `x_(k+1) = decay_k x_k + early_k u_k + late_k u_(k+1)`."""
    out[0] = x
    for k in range(len(u) - 1):
        x = decay[k] * x + early[k] * u[k] + late[k] * u[k + 1]
        out[k + 1] = x


@jit
def creep(
    u: Array, step: NDArray[np.intp], decay: Array, early: Array, late: Array, weights: Array, states: Array,
    total: Array,
) -> None:
    """Add the first-order filters of every column of `u` (N, R), times the weight of each, to `total`.

    `step` (N - 1): the row of `decay`, `early` and `late` (., T) that holds; `states` (T, R) are where the filters
    begin. Columns side by side, or of one column all filters, since each by itself waits for its own last sample.
    """
    taus, rows = states.shape
    for j in range(taus):
        for i in range(rows):
            total[0, i] += weights[j] * states[j, i]
    if rows == 1:
        for k in range(len(u) - 1):
            s = step[k]
            for j in range(taus):
                states[j, 0] = decay[s, j] * states[j, 0] + early[s, j] * u[k, 0] + late[s, j] * u[k + 1, 0]
            for j in range(taus):
                total[k + 1, 0] += weights[j] * states[j, 0]
        return
    for j in range(taus):
        x, weight = states[j], weights[j]
        for k in range(len(u) - 1):
            s = step[k]
            d, a, b = decay[s, j], early[s, j], late[s, j]
            for i in range(rows):
                x[i] = d * x[i] + a * u[k, i] + b * u[k + 1, i]
                total[k + 1, i] += weight * x[i]


@jit
def limit(u: Array, up: Array, down: Array, out: Array) -> None:
    """`u`, straight between samples, followed at no more than `up_k` upwards and `down_k` downwards in a step.

    Where it is met within a step, the rest of the step goes along with it, or as fast as it may.
    """
    x = u[0]
    out[0] = x
    for k in range(len(u) - 1):
        change = u[k + 1] - u[k]
        ahead = u[k] - x
        closing = up[k] - change if ahead > 0.0 else down[k] + change
        if ahead != 0.0 and not closing > abs(ahead):
            x = x + up[k] if ahead > 0.0 else x - down[k]
        elif -down[k] <= change <= up[k]:
            x = u[k + 1]
        else:
            part = abs(ahead) / closing if ahead != 0.0 else 0.0
            x = u[k] + part * change + (1.0 - part) * (up[k] if change > 0.0 else -down[k])
        out[k + 1] = x


@jit
def rung(
    y: float, rate: float, u: float, after: float, c: float, s: float, ramp: float, step: float, damping: float
) -> tuple[float, float]:
    """Output and rate of `ring` after a step in which its input goes from `u` to `after`."""
    off = y - u
    change = after - u
    return (
        u + (c + damping * s) * off + s * rate + ramp * change,
        (c - damping * s) * rate - s * off + step * change,
    )


@jit
def ring(u: Array, c: Array, s: Array, ramp: Array, step: Array, damping: float, out: Array) -> None:
    """Second-order low pass of every row of `u` (R, N), from rest, over steps with straight `u`.

    `c`, `s`: decaying cosine and sine of each step; `ramp`, `step`: what the output, and its rate, gain by a change of
    `u` by 1 over the step. Rates are per radian of the undamped oscillation.
    """
    # Four side by side, since each by itself waits for its own last sample
    rows, number = u.shape
    fours = rows // 4 * 4
    for i in range(0, fours, 4):
        u0, u1, u2, u3 = u[i], u[i + 1], u[i + 2], u[i + 3]
        y0, y1, y2, y3 = u0[0], u1[0], u2[0], u3[0]
        v0, v1, v2, v3 = 0.0, 0.0, 0.0, 0.0
        out[i, 0], out[i + 1, 0], out[i + 2, 0], out[i + 3, 0] = y0, y1, y2, y3
        for k in range(number - 1):
            y0, v0 = rung(y0, v0, u0[k], u0[k + 1], c[k], s[k], ramp[k], step[k], damping)
            y1, v1 = rung(y1, v1, u1[k], u1[k + 1], c[k], s[k], ramp[k], step[k], damping)
            y2, v2 = rung(y2, v2, u2[k], u2[k + 1], c[k], s[k], ramp[k], step[k], damping)
            y3, v3 = rung(y3, v3, u3[k], u3[k + 1], c[k], s[k], ramp[k], step[k], damping)
            out[i, k + 1], out[i + 1, k + 1], out[i + 2, k + 1], out[i + 3, k + 1] = y0, y1, y2, y3
    for i in range(fours, rows):
        y, v = u[i, 0], 0.0
        out[i, 0] = y
        for k in range(number - 1):
            y, v = rung(y, v, u[i, k], u[i, k + 1], c[k], s[k], ramp[k], step[k], damping)
            out[i, k + 1] = y


@jit
def curve(u: Array, scale: float, coefficients: Array, weight: float, total: Array) -> None:
    """Add `weight` times `scale xi^2 (c_2 + c_3 xi + ..)`, `xi = u/scale`, to `total`."""
    for k in range(len(u)):
        xi = u[k] / scale
        value = 0.0
        for c in coefficients[::-1]:
            value = c + value * xi
        total[k] += weight * (scale * xi * xi * value)


@jit
def dilated_plays(w: Array, rate: Array, r: Array, beta: Array, states: Array, out: Array) -> None:
    """Plays whose thresholds are `r + beta rate_k`, from `states`, into the rows of `out`."""
    # Four side by side, since each by itself waits for its own last sample
    fours = len(r) // 4 * 4
    for i in range(0, fours, 4):
        r0, r1, r2, r3 = r[i], r[i + 1], r[i + 2], r[i + 3]
        b0, b1, b2, b3 = beta[i], beta[i + 1], beta[i + 2], beta[i + 3]
        s0, s1, s2, s3 = states[i], states[i + 1], states[i + 2], states[i + 3]
        for k in range(len(w)):
            s0, s1 = followed(s0, w[k], r0 + b0 * rate[k]), followed(s1, w[k], r1 + b1 * rate[k])
            s2, s3 = followed(s2, w[k], r2 + b2 * rate[k]), followed(s3, w[k], r3 + b3 * rate[k])
            out[i, k], out[i + 1, k], out[i + 2, k], out[i + 3, k] = s0, s1, s2, s3
    for i in range(fours, len(r)):
        state = states[i]
        for k in range(len(w)):
            state = followed(state, w[k], r[i] + beta[i] * rate[k])
            out[i, k] = state


@jit
def mean_decay(x: float) -> float:
    """`(1 - exp(-x))/x`."""
    if x < 0.1:  # the series is as exact and far quicker
        return 1.0 - x * (0.5 - x * (1 / 6 - x * (1 / 24 - x * (1 / 120 - x * (1 / 720 - x * (1 / 5040 - x / 40320))))))
    return -math.expm1(-x) / x


@jit
def bent_decay(x: float) -> float:
    """`(1 - 2 x exp(-x) - exp(-2 x))/(2 x^3)`, what a growing disturbance leaves of its square's sum; 1/6 at 0."""
    if x < 0.1:
        return 1 / 6 - x * (1 / 6 - x * (11 / 120 - x * (13 / 360 - x * 57 / 5040)))
    decay = math.exp(-x)
    return (1.0 - decay * (2.0 * x + decay)) / (2.0 * x * x * x)


@jit
def taylor(e: float, c1: float, q0: float, m: float, step: float) -> tuple[float, float]:
    """What `e` gains over a step of `e' = speed - q`, `q` as `e^m`, by six terms from `c1` on, and the last of them.

    The terms `q_k` of q follow from `e q' = m q e'`, those of e from the second on are `-step q_(k-1)/k`.
    """
    d = 1.0 / e
    q1 = m * c1 * q0 * d
    c2 = -step * q1 / 2
    q2 = ((m - 1) * c1 * q1 + 2 * m * c2 * q0) * d / 2
    c3 = step * q2 * (-1 / 3)
    q3 = ((m - 2) * c1 * q2 + (2 * m - 1) * c2 * q1 + 3 * m * c3 * q0) * d * (1 / 3)
    c4 = -step * q3 / 4
    q4 = ((m - 3) * c1 * q3 + (2 * m - 2) * c2 * q2 + (3 * m - 1) * c3 * q1 + 4 * m * c4 * q0) * d / 4
    c5 = step * q4 * (-1 / 5)
    q5 = (m - 4) * c1 * q4 + (2 * m - 3) * c2 * q3 + (3 * m - 2) * c3 * q2 + (4 * m - 1) * c4 * q1 + 5 * m * c5 * q0
    c6 = step * q5 * d * (-1 / 30)
    return c1 + (c2 + (c3 + (c4 + (c5 + c6)))), c6


@jit
def stretch(e: float, speed: float, duration: float, tau: float, exponent: float, scale: float) -> tuple[float, float]:
    """Stretch `e` after `duration` of `e' = speed - (scale/tau) (e/scale)^exponent`, and the time left when it ends.

    The linear case is exact. Else pieces by the equation's Taylor series where friction takes its time, and where it is
    fast pieces that are exact for the equation straightened about `e` (exponential Rosenbrock-Euler) with the leading
    term of the curvature, each as long as what is left out allows.
    """
    if exponent == 1.0:
        final = e + (speed - e / tau) * duration * mean_decay(duration / tau)
        if final > 0.0 or (final == 0.0 and speed >= 0.0):
            return final, 0.0
        taken = tau * math.log1p(e / (-speed * tau))
        return 0.0, duration - taken if taken < duration else 0.0
    left = duration
    step = left
    fall = scale / tau * (e / scale) ** exponent
    for _ in range(MOST_PIECES):
        if not fall < 1e200:
            return (0.0, 0.0) if speed >= 0.0 else (0.0, left)
        change = speed - fall
        if fall < 0.5 * SLIGHT * speed:  # hardly anything but the speed counts
            little = scale * (SLIGHT * speed * tau / scale) ** (1.0 / exponent)
            taken = min((little - e) / speed, left)
            final = e + speed * taken
            e = final - (scale / tau * (final / scale) ** exponent * final - fall * e) / ((exponent + 1.0) * speed)
            left -= taken
            if not left > 0.0:
                break
            fall = scale / tau * (e / scale) ** exponent
            continue
        if not e > 0.0:
            return 0.0, left if speed < 0.0 else 0.0
        slope = exponent * fall / e
        step = min(step, left)
        part = slope * step
        if part <= SLOW and abs(change) * step <= 0.5 * e:
            gain, last = taylor(e, change * step, fall, exponent, step)
            if abs(last) > CLOSE * scale:
                step *= 0.5
                continue
            e += gain
            left -= step
            if left <= 1e-12 * duration:
                break
            step *= 4.0
            fall = scale / tau * (e / scale) ** exponent
            continue
        gain = change * step * mean_decay(part)
        final = e + gain
        if speed == 0.0:
            final = max(final, 0.0)
        bend = slope / e
        end, after = 0.0, 0.0
        if abs(gain) > NEARLY * e:
            end = max(final, 0.1 * e)
            after = scale / tau * (end / scale) ** exponent
            bend = max(bend, exponent * after / end / end)
            wrong = step * gain * gain * bend * abs(exponent - 1.0) / 12.0
        else:  # the curvature about e adds its leading term
            more = (1.0 - exponent) * bend * change * change * bent_decay(part) * step * step * step
            final += more
            wrong = abs(more * gain) / e * (abs(exponent - 2.0) / 3.0 + 2.0 * abs(exponent - 1.0))
        if wrong > CLOSE * scale and (final > 0.0 or e > CLOSE * scale):
            step *= max(0.2, 0.9 * (CLOSE * scale / wrong) ** (1.0 / 3.0))
            continue
        if final < 0.0:
            taken = -math.log1p(slope * e / change) / slope if part > 1e-8 else -e / change
            return 0.0, max(left - min(taken, step), 0.0)
        e = final
        left -= step
        if left <= 1e-12 * duration or not e > 0.0:
            break
        step *= 4.0
        fall = after if e == end else scale / tau * (e / scale) ** exponent
    return e, 0.0


@jit
def relaxed(
    x: float, target: float, left: float, r: float, tau: float, exponent: float, scale: float, state: float
) -> float:
    """State of a play that follows its input viscously, after the input's way from `x` to `target` in the time `left`.

    `z' = (scale/tau) (stretch/scale)^exponent` beyond the threshold.
    """
    speed = (target - x) / left
    side = 0.0
    if x - r - state > 0.0:
        side = 1.0
    elif state - r - x > 0.0:
        side = -1.0
    if side != 0.0:
        e, left = stretch(side * (x - state) - r, side * speed, left, tau, exponent, scale)
        if left > 0.0:  # caught up, with the input on its way back
            x = target - speed * left
            state = x - side * r
            side = 0.0
        else:
            state = target - side * (r + e)
    if side == 0.0 and left > 0.0 and target != x:
        way = 1.0 if target > x else -1.0
        beyond = way * (target - state) - r
        if beyond > 0.0:
            taken = left * min(beyond / (way * (target - x)), 1.0)
            e, _ = stretch(0.0, way * speed, taken, tau, exponent, scale)
            state = target - way * (r + e)
    return state


@jit
def relaxing_plays(
    w: Array, steps: Array, r: Array, tau: float, exponent: float, scale: float, states: Array, out: Array
) -> None:
    """Plays of thresholds `r` that follow their input viscously, from `states`, into the rows of `out`.

    Side by side, since each by itself waits for its own last sample.
    """
    for i in range(len(r)):
        states[i] = min(max(states[i], w[0] - r[i]), w[0] + r[i])
        out[i, 0] = states[i]
    for k in range(len(w) - 1):
        for i in range(len(r)):
            states[i] = relaxed(w[k], w[k + 1], steps[k], r[i], tau, exponent, scale, states[i])
            out[i, k + 1] = states[i]


@jit
def rubbed(way: float, reach: float) -> float:
    """What plays of thresholds up to `reach` lose to friction on a way on which more and more of them follow.

    One of threshold r follows behind r and then loses r a unit of the way, all that follow `min(way, reach)^2/2`.
    """
    rising = min(way, reach)
    return rising * rising * (rising / 6.0 + 0.5 * (way - rising))


@jit
def lost(v: Array, reach: float, corner: Array, out: Array) -> None:
    """Energy that plays of all thresholds up to `reach`, equally dense and relaxed at `v[0]`, lose in each step of `v`.

    Behind a turning point a play follows when the way is twice its threshold. Turning points that are passed are
    forgotten (Madelung's rules): there the way goes on from an earlier one, or on the initial curve.
    """
    depth = 0
    w = v[0]
    up = True
    for k in range(len(v) - 1):
        x = v[k + 1]
        out[k] = 0.0
        if x == w:
            continue
        if (x > w) != up:
            up = x > w
            if w != v[0] or depth > 0:
                corner[depth] = w
                depth += 1
        sign = 1.0 if up else -1.0
        while x != w:
            if depth == 0:
                out[k] += rubbed(abs(x - v[0]), reach) - rubbed(abs(w - v[0]), reach)
                w = x
                break
            last = corner[depth - 1]
            end = corner[depth - 2] if depth > 1 else 2.0 * v[0] - last
            ends = sign * (x - end) >= 0.0
            to = end if ends else x
            out[k] += 2.0 * (rubbed(0.5 * sign * (to - last), reach) - rubbed(0.5 * sign * (w - last), reach))
            w = to
            if ends:
                depth -= min(depth, 2)


def load() -> None:
    """Have them compiled, or read from the cache, by running each of them on two samples."""
    u, step = np.arange(2.0), np.ones(1)
    out = np.empty(2)
    follow(u, step, step, step, 0.0, out)
    first = np.zeros(1, dtype=np.intp)
    one = np.ones((1, 1))
    creep(u[:, None], first, one, one, one, step, np.ones((1, 1)), out[:, None])
    limit(u, step, step, out)
    ring(u[None, :], step, step, step, step, 1.0, out[None, :])
    curve(u, 1.0, step, 1.0, out)
    dilated_plays(u, u, step, step, np.zeros(1), out[None, :])
    lost(u, 1.0, np.empty(2), np.empty(1))
    relaxing_plays(u, step, step, 1.0, 1.0, 1.0, np.zeros(1), out[None, :])
