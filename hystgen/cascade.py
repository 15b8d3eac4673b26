"""Models as frozen objects that can be simulated, assembled from the parts in the packages imported here.

`PI` is the play sum, `DeadZone` and `TanhEnvelope` are the memoryless parts in front of it, and `Cascade` is the whole
actuator: stages in order from the drive, the play sum, an output offset and the drive range it is used in.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hystgen.basics.problems import NotInvertibleError
from hystgen.chain.static import StaticModel
from hystgen.compensator import remarks
from hystgen.compensator.reference import Session
from hystgen.plays.play_sum import PlaySum

Array = NDArray[np.float64]


@dataclass(frozen=True)
class PI(PlaySum):
    """Play sum `y = p_0 v + sum p_i play_(r_i)[v]` (21).

    `thresholds`: r_0 = 0 < r_1 < ... < r_n in units of the input; `weights`: p_0 .. p_n, any finite numbers, in output
    per input unit; `initial_state`: one number or n+1 of them, projected to the admissible set (`projected`: whether
    that changed it). Raises ValueError for anything else.
    """

    def simulate(self, v: ArrayLike) -> Array:
        """Output for the input samples `v` (N,), from the start memory, in double precision."""
        return Cascade(pi=self).simulate(v)


@dataclass(frozen=True)
class Cascade(StaticModel):
    """The actuator: `y = PI[G[v]] + output_offset` (39), `G` the stages in order from the drive.

    `input_range`: the range of drives in which it is used (two numbers, or unbounded). `simulate` runs it, and
    `inverse` returns the compensator.
    """

    pi: PI

    def simulate(self, v: ArrayLike, clamp: bool = False) -> Array:
        """Output for the drive samples `v` (N,) from the start memory, in double precision; `clamp` limits the drive.

        Warns (`SampleWarning`) of drives outside `input_range` and of non-finite samples, which repeat the last drive.
        """
        y, said = remarks.run(Session(self, "forward", clamp=clamp), v)
        remarks.tell(said)
        return y

    def inverse(self) -> InverseCascade:
        """The compensator `v = G^-1[PI^-1[u]]` (48). Raises NotInvertibleError."""
        problems = self.inverse_problems()
        if problems:
            raise NotInvertibleError(problems)
        return InverseCascade(self)


@dataclass(frozen=True)
class InverseCascade:
    """The compensator of a cascade: reference in, drive out."""

    forward: Cascade

    def inverse(self) -> Cascade:
        """The model that this inverse compensates."""
        return self.forward

    def simulate(self, u: ArrayLike, clamp: bool = True) -> Array:
        """Drive for the reference samples `u` (N,), in double precision; `clamp` keeps it inside `input_range`.

        The memory follows the limited drive. Warns (`SampleWarning`) with the number of limited samples and of
        non-finite samples, for which the drive is held.
        """
        session = Session(self.forward, "inverse", clamp=clamp)
        v, said = remarks.run(session, u, Session(self.forward, "forward"))
        remarks.tell(said)
        return v
