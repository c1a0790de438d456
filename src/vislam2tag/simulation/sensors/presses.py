"""The control-point button, pressed by a human hand."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vislam2tag.core.arrays import IntArray
from vislam2tag.simulation.model import TrueWalk


@dataclass(frozen=True)
class Hand:
    """How one person presses: ``lead_s`` before the exact moment on average, normal scatter ``scatter_s``."""

    lead_s: float = 0.1
    scatter_s: float = 0.35


def simulate_presses(walk: TrueWalk, hand: Hand, rng: np.random.Generator) -> IntArray:
    """Return the times (p,) of the presses, boot-clock ns, in order and inside the walk."""
    error_s = rng.normal(-hand.lead_s, hand.scatter_s, len(walk.presses_ns))
    pressed = walk.presses_ns + (error_s * 1e9).astype(np.int64)
    inside: IntArray = np.sort(np.clip(pressed, walk.time_ns[0], walk.time_ns[-1]))
    return inside
