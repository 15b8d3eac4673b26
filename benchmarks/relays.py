"""A stage made of relays, creep, a lag and a mode: a simulator that shares no code and no model form with the package.

Hysteresis is a Preisach sum of ideal relays, not of plays; creep has more and other time constants than any creep that
a diagnosis fits; the amplifier's lag and the mode are discretised by scipy. Noise is white, or coloured by an AR(1)
filter. Drives in V from 0 to 100, displacements in um.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy import signal

Array = NDArray[np.float64]


@dataclass
class Stage:
    """A stage from rest at 0 V; `move` continues from where the last call ended.

    `creep`: share of the displacement per decade; `lag`: s; `mode`: Hz and damping, None without; `noise`: um rms;
    `colour`: coefficient of the AR(1) filter of the noise; `gain`: of the whole, which ageing changes.
    """

    seed: int
    seconds: float = 1e-3
    creep: float = 0.008
    lag: float = 1.5e-3
    mode: tuple[float, float] | None = (90.0, 0.08)
    noise: float = 0.01
    colour: float = 0.0
    gain: float = 1.0
    relays: int = 300
    _state: dict[str, Array] = field(default_factory=dict, init=False)

    def __post_init__(self) -> None:
        self.random = np.random.default_rng((self.seed, 1))
        shape = np.random.default_rng((self.seed, 0))
        middle, half = shape.uniform(-10.0, 110.0, self.relays), 40.0 * shape.beta(1.0, 3.0, self.relays)
        self._up, self._down = middle + half, middle - half
        weight = shape.gamma(3.0, 1.0, self.relays) * np.exp(-(((middle - 50.0) / 70.0) ** 2))
        self._weight = 3.0 * weight / weight.sum()  # um; relays make 6 um of about 18
        self._linear = 0.12 * shape.uniform(0.9, 1.1)
        self._taus = np.array([0.03, 0.2, 1.1, 7.0])
        self._relay = np.where(self._down >= 0.0, -1.0, np.where(self._up <= 0.0, 1.0, -1.0))
        self._last = 0.0

    def move(self, v: Array) -> Array:
        """Measured displacement (N,) for drives (N,), one each `seconds`."""
        a = self._filtered("lag", v, *self._first_order(self.lag)) if self.lag > 0.0 else v
        on = np.zeros(len(a))
        for k in range(self.relays):
            event = np.where(a >= self._up[k], 1.0, np.where(a <= self._down[k], -1.0, 0.0))
            place = np.maximum.accumulate(np.where(event != 0.0, np.arange(len(a)), -1))
            state = np.where(place >= 0, event[np.maximum(place, 0)], self._relay[k])
            self._relay[k] = state[-1]
            on += self._weight[k] * state
        h = self._linear * a + on
        y = h + sum(
            self.creep * self._filtered(f"creep {tau}", h, *self._first_order(float(tau))) for tau in self._taus
        )
        if self.mode is not None:
            w, zeta = 2.0 * np.pi * self.mode[0], self.mode[1]
            b, c, _ = signal.cont2discrete(([w * w], [1.0, 2.0 * zeta * w, w * w]), self.seconds, "foh")
            y = self._filtered("mode", y, np.ravel(b), c)
        white = self.noise * np.sqrt(1.0 - self.colour**2) * self.random.normal(size=len(y))
        return np.asarray(self.gain * y + self._filtered("noise", white, np.array([1.0]), np.array([1, -self.colour])))

    def _first_order(self, tau: float) -> tuple[Array, Array]:
        kept = np.exp(-self.seconds / tau)
        return np.array([1.0 - kept]), np.array([1.0, -kept])

    def _filtered(self, name: str, x: Array, b: Array, a: Array) -> Array:
        state = self._state.get(name)
        if state is None:  # at rest at the first value
            state = signal.lfilter_zi(b, a) * (x[0] if name != "noise" else 0.0)
        y, self._state[name] = signal.lfilter(b, a, x, zi=state)
        return np.asarray(y)


def multisine(seed: int, samples: int, seconds: float, low: float = 2.0, high: float = 98.0) -> Array:
    """A drive of a few lines from 0.5 to 12 Hz that begins at `low`."""
    random = np.random.default_rng((seed, 2))
    t = np.arange(samples) * seconds
    lines = np.array([0.5, 1.3, 2.9, 5.1, 11.7]) * random.uniform(0.8, 1.2, 5)
    phases = random.uniform(0.0, 2.0 * np.pi, 5)
    x = sum(np.sin(2.0 * np.pi * f * t + phase) / f**0.7 for f, phase in zip(lines, phases, strict=True))
    x = low + (high - low) * (x - x.min()) / np.ptp(x)
    begin = np.minimum(t / 0.2, 1.0)
    return np.asarray(low + begin * (x - low))
