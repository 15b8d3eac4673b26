"""Start memories that are estimated again together with the effects of a hypothesis."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from recordings import brute_output, noisy, record, wander

from hystgen.diagnosis.data import preparing
from hystgen.diagnosis.data.items import rms
from hystgen.diagnosis.search import fits, hypothesis, selection
from hystgen.diagnosis.search.hypothesis import Structure
from hystgen.effects.sensor_nonlinearity.model import SensorPolynomial
from hystgen.identification.joint import Kept
from hystgen.records import Record

NOISE, BEND = 0.1, 0.08
"""[output units] Noise of the records, and [share of the range] bend of the sensor at its end."""


def test_a_memory_is_found_again_beside_a_sensor() -> None:
    """The memory is that of a stage that came from elsewhere; the bare model distorts it to follow the sensor.

    The record's amplitude grows to its end, so hardly any of the record can be used without a memory.
    """
    before = np.array([0.0, 100.0, 15.0, 80.0, 35.0])
    growing = 50.0 - np.linspace(10.0, 50.0, 400) * np.cos(np.linspace(0.0, 10.0 * np.pi, 400))
    wide = np.concatenate([50.0 - 50.0 * np.cos(np.linspace(0.0, 4.0 * np.pi, 300)), wander(1)])

    def seen(v: NDArray[np.float64], name: str, seed: int) -> Record:
        whole = np.concatenate([np.interp(np.linspace(0, 4, 81), np.arange(5), before), v])
        y = brute_output(whole, (0.0, 10.0, 25.0, 40.0), (1.0, 0.4, 0.3, 0.3), 0.0)[81:]
        return record(v, noisy(y + BEND * y**2 / 150.0, NOISE, seed), name)

    fitted, held = [seen(wide, "wide", 1), seen(growing, "growing", 2)], [seen(wander(3), "held", 3)]
    ready = preparing.prepare(fitted, held, None, 0.0)
    assert [item.turns is None for item in ready.to_fit] == [True, False]
    sensor = hypothesis.kept(SensorPolynomial(name="sensor_nonlinearity", coefficients=(BEND,), scale=150.0))
    structure = Structure(ready.thresholds, Kept(), (sensor,))
    begun = selection.refit(structure, ready.to_fit, np.empty(0))
    found = fits.restarted(begun, [*ready.to_fit, *ready.held], ready.to_fit)
    growing_alone = ready.to_fit[1:]
    assert rms(begun.errors(growing_alone)) > 3.0 * NOISE  # 4.8 times
    assert rms(found.errors(growing_alone)) < 1.2 * NOISE  # 1.07 times
    assert rms(found.errors(ready.held)) < rms(begun.errors(ready.held))
    assert fits.restarted(found, ready.held, ready.held) is found  # no memory was sought for those
