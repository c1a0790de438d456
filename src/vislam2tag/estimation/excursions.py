"""Excursions: the camera jumps away, at once or in several jumps, and later back as far.

A tracker that lost its way and then recognises a place is in its old map again: what it logs is as good as if it had
never been away, and only where it was meanwhile is not known well. So the way over an excursion is what the log says
from the frame before it to the frame after it, and both jumps leave nothing free.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vislam2tag.core.arrays import BoolArray, ComplexArray, FloatArray

BACK_M = 0.1
BACK_RAD = 0.2
"""A jump back misses the jump away by this and, as the tracker may have turned, by this much of the way between."""
FAR = 3.0
"""Only jumps this many times greater than that count: two of them do not fit one another by chance."""
TURN_SIGMA_RAD = 0.1
PLACE_SIGMA_M = 0.1
"""How far the tracker may have turned and moved while it was away."""


@dataclass(frozen=True)
class Excursion:
    """Steps ``away`` to ``back`` whose jumps undo each other but for ``missing`` (complex metres)."""

    away: int
    back: int
    missing: complex


def find_excursions(jump: ComplexArray, alone: BoolArray, unknown: BoolArray, length_m: FloatArray) -> list[Excursion]:
    """Find jumps of the camera ``alone`` (n - 1,) that undo those before; none across steps that are ``unknown``.

    ``jump`` (n - 1,) is what each step has beyond motion, in the continuous frame; ``length_m`` (n - 1,) lengths of the
    steps without it.
    """
    along_m = np.concatenate(([0.0], np.cumsum(length_m)))
    lost = np.cumsum(unknown)
    found: list[Excursion] = []
    waiting: list[int] = []
    for back in np.flatnonzero(alone).tolist():
        waiting.append(back)
        for number in range(len(waiting) - 2, -1, -1):
            away, jumps = waiting[number], jump[waiting[number:]]
            if lost[back] > lost[away]:
                break
            missing = complex(jumps.sum())
            limit_m = BACK_M + BACK_RAD * float(along_m[back] - along_m[away])
            if abs(missing) < limit_m and np.abs(jumps).min() > FAR * limit_m:
                found.append(Excursion(away, back, missing))
                waiting.clear()
                break
    return found


def returned(excursion: Excursion, step: ComplexArray) -> tuple[ComplexArray, FloatArray]:
    """Steps of an excursion (from ``away`` to ``back``) that lead where the log is afterwards.

    Also the variance (k,), m^2 per axis, of the frame after each step: nothing after the last one.
    """
    length = np.abs(step)
    share = length / length.sum() if length.sum() > 0 else np.full(len(step), 1 / len(step))
    along = np.cumsum(length)
    from_ends = np.minimum(along, along[-1] - along)
    variance = PLACE_SIGMA_M**2 + (TURN_SIGMA_RAD * from_ends) ** 2
    variance[-1] = 0
    return step + excursion.missing * share, variance
