"""A plant: base hysteresis and the effects around it, from the commanded drive to the converter's input."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from . import base
from .effects import Effect, Surroundings, drive_side, memory, output_side, slow
from .session import Session

Array = NDArray[np.float64]

DRIVE_SIDE = {
    "delay": drive_side.delay,
    "slew_limit": drive_side.slew,
    "lag": drive_side.lag,
    "asymmetry": drive_side.asymmetry,
    "saturation": drive_side.saturation,
}
OUTPUT_SIDE = {
    "creep": slow.creep,
    "ageing": slow.ageing,
    "thermal": slow.thermal,
    "resonance": output_side.resonance,
    "saturation": output_side.stops,
    "sensor_nonlinearity": output_side.sensor,
    "drift": output_side.drift,
}


@dataclass(frozen=True)
class Plant:
    hysteresis: base.Base
    effects: tuple[Effect, ...] = ()

    def respond(self, session: Session) -> Array:
        """Noise-free output on the session's fine grid; zero drive gives about zero output."""
        x, dt = session.v, session.dt
        around = Surroundings(session.t, dt, session.v, session.temperature, session.bench)
        present = {effect.name: effect for effect in self.effects}
        for name, block in DRIVE_SIDE.items():
            if name in present:
                x = block(present[name], x, around)
        viscosity = memory.viscosity(present["rate_dependence"]) if "rate_dependence" in present else None
        centre = memory.centre(present["noncongruent"]) if "noncongruent" in present else None
        h = base.run(self.hysteresis, np.ascontiguousarray(x), dt, viscosity, centre)
        h = h - h.mean() + x.mean() * session.bench.span_out / session.bench.span
        for name, block in OUTPUT_SIDE.items():
            if name in present:
                h = block(present[name], h, around)
        return h
