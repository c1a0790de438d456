"""Known positions of a walk without a tracker: somebody says now and then where they are."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.simulation.model import TrueWalk
from vislam2tag.simulation.walking.sampling import position_at

INTERVAL_S = 20.0
SIGMA_M = 0.4
"""Per axis: nobody stands exactly where they say.

Taps of real walks are off by 0.4 to 0.6 m (docs/results/dead_reckoning.md)."""
DELAY_S = 0.1
"""From being there to saying so."""


@dataclass(frozen=True)
class SimulatedFixes:
    """``time_ns`` (k,) boot clock, ``position_bcs`` (k, 2) metres."""

    time_ns: IntArray
    position_bcs: FloatArray


def simulate_fixes(walk: TrueWalk, rng: np.random.Generator) -> SimulatedFixes:
    """Say where the walker was at the start, every :data:`INTERVAL_S` and near the end."""
    first, last = int(walk.time_ns[0]) + 200_000_000, int(walk.time_ns[-1]) - 200_000_000
    count = max(round((last - first) * 1e-9 / INTERVAL_S), 1)
    time_ns = np.linspace(first, last, count + 1).astype(np.int64)
    place = position_at(walk, time_ns - int(DELAY_S * 1e9))[:, :2]
    return SimulatedFixes(time_ns, place + rng.normal(0, SIGMA_M, place.shape))
