"""Elements in parallel with the plays, in fixed point."""

from __future__ import annotations

from hystgen.effects.bouc_wen import compensator
from hystgen.effects.plays import Elements

ARITHMETIC: Elements = compensator.ELEMENTS.floating
