"""Wilcoxon's signed-rank test; `scipy.stats` has it too, and takes longer to be imported than a diagnosis can spare."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

EXACT = 50
"""Up to so many values the distribution is counted; of more it is normal to three digits."""


def signed_rank(values: Array) -> float:
    """One-sided p-value of values (N,) that lie above 0 by more, or more often, than below.

    The sum of the ranks of the positive ones against that of random signs (Wilcoxon, Biometrics Bulletin 1, 1945);
    zeros are left out, equal sizes share their ranks. 1 where all are zero.
    """
    values = values[values != 0.0]
    _, place, equal = np.unique(np.abs(values), return_inverse=True, return_counts=True)
    twice = (2 * np.cumsum(equal) - equal + 1)[place]  # ranks of equal sizes may be halves
    found = int(np.sum(twice[values > 0.0]))
    n = len(values)
    if n <= EXACT:
        chance = np.zeros(n * (n + 1) + 1)
        chance[0] = 1.0
        for rank in twice.tolist():
            chance[rank:] += chance[:-rank].copy()
            chance *= 0.5
        return float(np.sum(chance[found:]))
    variance = n * (n + 1) * (2 * n + 1) / 24.0 - float(np.sum(equal.astype(np.float64) ** 3 - equal)) / 48.0
    above = 0.5 * found - 0.25 * n * (n + 1)
    return 0.5 * math.erfc(above / math.sqrt(2.0 * variance))
