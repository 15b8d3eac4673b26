"""Faults of instruments that a fit would take for the actuator: counters that wrap, fringes that slip.

The actuators here are simulated in plain Python, without code of the package."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from hystgen.identification import clocks, instruments, lasting
from hystgen.records import Record

Array = NDArray[np.float64]

FRINGE = 0.3164
"""[um] Half the wavelength of a helium-neon laser."""


def actuator(v: Array, thresholds: int = 12, start: float = 0.0) -> Array:
    """About 15 um of motion for 0 to 100 V, with a loop 14 % wide: backlashes side by side, sample by sample."""
    reach = np.linspace(0.5, 30.0, thresholds)
    held = [start] * thresholds
    y = np.empty(len(v))
    for k, x in enumerate(v.tolist()):
        held = [min(max(s, x - r), x + r) for s, r in zip(held, reach, strict=True)]
        y[k] = 0.09 * x + sum(held) * 0.08 / thresholds
    return y


def triangle(samples: int, periods: float) -> Array:
    phase = (np.arange(samples) / samples * periods) % 1.0
    return np.asarray(50.0 - 50.0 * np.cos(np.pi * np.abs(2.0 * phase - 1.0)))


def swept(samples: int) -> Array:
    """A drive of several frequencies and amplitudes, as of a scan."""
    t = np.arange(samples) / samples
    return np.asarray(50.0 + 30.0 * np.sin(2.0 * np.pi * 6.0 * t) + 20.0 * np.sin(2.0 * np.pi * 17.0 * t + 1.0))


def record(v: Array, y: Array, noise: float = 0.0, seed: int = 0) -> Record:
    y = y + noise * np.random.default_rng(seed).standard_normal(len(y))
    return Record("r.csv", np.arange(len(v)) * 0.004, v, y, sample_time=0.004, units={"v": "V", "y": "um"})


def stepped(y: Array, **at: float) -> Array:
    """The output with steps, `s1200=0.3` for one of 0.3 that is there from sample 1200 on."""
    out = y.copy()
    for place, size in at.items():
        out[int(place[1:]) :] += size
    return out


DRIVES = {"triangle": triangle(3000, 6.0), "swept": swept(3000)}


@pytest.mark.parametrize("drive", DRIVES)
@pytest.mark.parametrize("steps", [
    {"s1300": -FRINGE}, {"s1300": FRINGE}, {"s700": FRINGE, "s2100": FRINGE}, {"s1300": -FRINGE, "s2101": FRINGE},
    {"s400": 3.0 * FRINGE}, {"s2700": -2.0 * FRINGE}, {"s900": -FRINGE, "s1500": -FRINGE, "s2200": -FRINGE},
])  # fmt: skip
def test_a_slip_of_fringes_is_found_with_sample_and_size(drive: str, steps: dict[str, float]) -> None:
    v = DRIVES[drive]
    y = actuator(v)
    found = lasting.steps(record(v, stepped(y, **steps), noise=0.01))
    assert found is not None
    assert found.modulus is None
    assert found.at.tolist() == [int(place[1:]) for place in steps]
    np.testing.assert_allclose(found.sizes, list(steps.values()), atol=0.03)  # three deviations of the noise


@pytest.mark.parametrize("drive", DRIVES)
@pytest.mark.parametrize(("bits", "scale", "offset"), [(16, 65536 / 10.0, 0.4), (12, 4096 / 12.0, 0.0), (16, 1.0, 0.0)])
def test_a_counter_that_wraps_is_unwrapped(drive: str, bits: int, scale: float, offset: float) -> None:
    v = DRIVES[drive]
    y = actuator(v) + offset
    if scale == 1.0:  # a counter read in um
        counted, modulus = np.mod(y, 10.0), 10.0
    else:
        counted, modulus = np.mod(np.rint(y * scale), 2.0**bits), 2.0**bits
    assert np.max(np.abs(np.diff(counted))) > 0.9 * modulus
    found = lasting.steps(record(v, counted))
    assert found is not None
    assert found.modulus == pytest.approx(modulus, rel=1e-3)
    moved = found.bridged(counted)
    np.testing.assert_allclose(np.diff(moved), np.diff(y * scale), atol=1.5 if scale != 1.0 else 1e-2)


def relays(v: Array, number: int, spread: float) -> Array:
    """A Preisach model of a few relays: its output moves in jumps, as a switching ferroelectric's does."""
    random = np.random.default_rng(3)
    low, high = np.sort(random.uniform(0.5 - spread, 0.5 + spread, (2, number)) * 100.0, axis=0)
    states = np.zeros(number)
    y = np.empty(len(v))
    for k, x in enumerate(v):
        states = np.where(x >= high, 1.0, np.where(x <= low, 0.0, states))
        y[k] = 0.02 * x + 10.0 * states.mean()
    return y


def sticking(v: Array, least: float) -> Array:
    """A slider that stands still until the spring is stretched by `least`, and then catches up at once."""
    y, where = np.empty(len(v)), 0.0
    for k, x in enumerate(0.15 * v):
        if abs(x - where) > least:
            where = x
        y[k] = where
    return y


def lagging(v: Array, share: float) -> Array:
    y, x = np.empty(len(v)), v[0]
    for k, drive in enumerate(v):
        x += share * (drive - x)
        y[k] = x
    return y


SQUARE = np.where((np.arange(3000) // 250) % 2 == 0, 20.0, 80.0)
STAIRS = np.repeat(np.round(50.0 + 40.0 * np.sin(np.linspace(0.0, 12.0, 60))), 50)
SLOW = triangle(3000, 1.0)
SOUND: dict[str, Callable[[], tuple[Array, Array]]] = {
    "a sound record": lambda: (DRIVES["triangle"], actuator(DRIVES["triangle"])),
    "steps of the drive": lambda: (SQUARE, actuator(SQUARE)),
    "steps of the drive and a lag": lambda: (SQUARE, actuator(lagging(SQUARE, 0.5))),
    "stairs": lambda: (STAIRS, actuator(STAIRS)),
    "one step of the drive": lambda: (np.where(np.arange(3000) < 900, 0.0, 60.0), actuator(
        np.where(np.arange(3000) < 900, 0.0, 60.0)) + 0.3 * np.log1p(np.maximum(np.arange(3000) - 900, 0.0))),
    "a coarse converter": lambda: (SLOW, np.round(actuator(SLOW) / 0.25) * 0.25),
    "a very coarse converter": lambda: (SLOW, np.round(actuator(SLOW))),
    "a hundred relays": lambda: (DRIVES["triangle"], relays(DRIVES["triangle"], 100, 0.4)),
    "ten relays": lambda: (DRIVES["triangle"], relays(DRIVES["triangle"], 10, 0.3)),
    "a single relay": lambda: (DRIVES["triangle"], relays(DRIVES["triangle"], 1, 0.2)),
    "three relays, swept": lambda: (DRIVES["swept"], relays(DRIVES["swept"], 3, 0.2)),
    "fine stick-slip": lambda: (DRIVES["triangle"], sticking(DRIVES["triangle"], 0.2)),
    "coarse stick-slip": lambda: (DRIVES["triangle"], sticking(DRIVES["triangle"], 2.0)),
    "stick-slip on a motion": lambda: (SLOW, actuator(SLOW) + 0.2 * sticking(SLOW, 1.5)),
    "isolated faults": lambda: (DRIVES["swept"], actuator(DRIVES["swept"]) + 3.0 * (np.arange(3000) % 700 == 5)),
    "a drop-out": lambda: (DRIVES["swept"], np.where(
        np.abs(np.arange(3000) - 1400) < 30, 0.0, actuator(DRIVES["swept"]))),
}


@pytest.mark.parametrize("what", SOUND)
@pytest.mark.parametrize("noise", [0.0, 0.01])
def test_what_the_actuator_or_a_lesser_fault_does_is_no_lasting_step(what: str, noise: float) -> None:
    v, y = SOUND[what]()
    assert lasting.steps(record(v, y, noise)) is None


# Clocks that differ --------------------------------------------------------------------------------------------

SECONDS = np.arange(5000) * 0.004
WAVES: dict[str, Callable[[Array], Array]] = {
    "sine": lambda t: 50.0 - 50.0 * np.cos(2.0 * np.pi * t),
    "triangle": lambda t: 100.0 * np.abs(2.0 * ((0.7 * t) % 1.0) - 1.0),
    "two sines": lambda t: 50.0 + 30.0 * np.sin(3.3 * t) + 20.0 * np.sin(10.7 * t + 1.0),
    "sweep": lambda t: 50.0 - 50.0 * np.cos(2.0 * np.pi * (0.2 * t + 0.05 * t**2)),
}


def on_clocks(
    wave: str, ppm: float, change: Callable[[Array, Array], Array] = lambda _, y: y, lag: float = 0.0
) -> Record:
    """A record whose sensor is late by `ppm` us for each second, and by `lag` s from the beginning."""
    drive = WAVES[wave]
    late = SECONDS * (1.0 - 1e-6 * ppm) - lag
    y = change(SECONDS, actuator(drive(np.maximum(late, 0.0))))
    y = y + 0.01 * np.random.default_rng(5).standard_normal(len(y))
    return Record("r.csv", SECONDS, drive(SECONDS), y, sample_time=0.004)


@pytest.mark.parametrize(("wave", "ppm"), [
    ("sine", 100.0), ("sine", -300.0), ("sine", 2000.0), ("triangle", 200.0), ("two sines", 50.0),
    ("two sines", -1000.0), ("sweep", 300.0), ("sweep", 2000.0),
])  # fmt: skip
def test_the_skew_of_two_clocks_is_estimated(wave: str, ppm: float) -> None:
    found = clocks.skew(on_clocks(wave, ppm, lag=0.006))
    assert found is not None
    assert abs(1e6 * found.slope - ppm) < max(2.0 * 1e6 * found.half, 0.015 * abs(ppm))
    assert 1e6 * found.half < 30.0


def creeping(_: Array, y: Array) -> Array:
    slow = [lagging(y, 0.004 / seconds) - y for seconds in (0.3, 3.0, 30.0)]
    return np.asarray(y + 0.02 * slow[0] + 0.02 * slow[1] + 0.03 * slow[2])


CHANGES: dict[str, Callable[[Array, Array], Array]] = {
    "nothing": lambda _, y: y,
    "creep": creeping,
    "ageing": lambda t, y: y * (1.0 + 0.03 * t / t[-1]),
    "warming": lambda t, y: y * (1.0 + 0.02 * (1.0 - np.exp(-0.2 * t))) + 0.3 * (1.0 - np.exp(-0.2 * t)),
    "a sensor's lag": lambda _, y: lagging(y, 0.3),
}


@pytest.mark.parametrize("wave", WAVES)
@pytest.mark.parametrize("change", CHANGES)
def test_a_lag_creep_and_ageing_are_no_skew(wave: str, change: str) -> None:
    assert clocks.skew(on_clocks(wave, 0.0, CHANGES[change], lag=0.02)) is None


def test_a_skew_is_told_and_taken_out_where_asked() -> None:
    skewed, plain = on_clocks("two sines", 1000.0), on_clocks("two sines", 0.0)
    (told,) = instruments.put_right([skewed])
    assert told.y is skewed.y
    (note,) = told.notes
    assert "the clocks of drive and sensor differ by" in note
    assert "--clock-skew auto" in note
    for asked in ("auto", 1000.0):
        (right,) = instruments.put_right([skewed], asked)
        lost = len(plain) - len(right)
        assert 0 < lost <= 1 + 0.001 * 20.0 / 0.004
        assert f"taken out, with the last {lost} samples" in right.notes[-1]
        assert right.y is not None
        assert plain.y is not None
        assert np.std(right.y - plain.y[: len(right)]) < 0.02  # the noise of both, and the estimate's
        assert clocks.skew(right) is None
