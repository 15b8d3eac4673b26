"""A plant: base hysteresis and the effects around it, from the commanded drive to the converter's input."""

from __future__ import annotations

from dataclasses import dataclass, replace

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

    def respond(self, session: Session, first: Session | None = None) -> Array:
        """Noise-free output on the session's fine grid; zero drive gives about zero output.

        `first`: the session that defines the plant's zero and the strengths of its effects, if not this one.
        """
        around = _around(session)
        x, h = self._driven(around)
        known = h
        if first is not None:
            around = replace(around, first=_around(first))
            x, known = self._driven(around.scale)
        h = h - known.mean() + x.mean() * session.bench.span_out / session.bench.span
        present = self._present
        for name, block in OUTPUT_SIDE.items():
            if name in present:
                h = block(present[name], h, around)
        return h

    @property
    def _present(self) -> dict[str, Effect]:
        return {effect.name: effect for effect in self.effects}

    def _driven(self, around: Surroundings) -> tuple[Array, Array]:
        """Input and output of the hysteresis."""
        x, present = around.drive, self._present
        for name, block in DRIVE_SIDE.items():
            if name in present:
                x = block(present[name], x, around)
        viscosity = memory.viscosity(present["rate_dependence"]) if "rate_dependence" in present else None
        centre = memory.centre(present["noncongruent"]) if "noncongruent" in present else None
        h = base.run(self.hysteresis, np.ascontiguousarray(x), around.dt, viscosity, centre)
        if "bouc_wen" in present:
            h = h + memory.parallel(present["bouc_wen"], np.ascontiguousarray(x), around.bench)
        return x, h


def _around(session: Session) -> Surroundings:
    return Surroundings(session.t, session.dt, session.v, session.temperature, session.bench)
