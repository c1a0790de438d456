"""Surveys made in two frames that do not fit: beyond a line, all surveyed positions lie off by some decimetres.

On the real walks one such step lies between two landmarks, and walks cross it: nothing in a log tells where.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from second_generator.random_numbers import gross_error
from second_generator.walk import MadeWalk

LEAST_M, MOST_M = 0.3, 1.0
FEWEST_BEYOND = 2
ATTEMPTS = 30


def surveyed_in_two_frames(made: MadeWalk, seed: int) -> MadeWalk:
    """Shift landmarks and truth beyond a line that the walk crosses, with two landmarks or more on either side.

    A label is right where it fits the frame of the survey that it lies in. Raises RuntimeError where no line does.
    """
    rng = np.random.default_rng([seed, 1])
    landmarks, truth = made.landmarks, made.truth_bcs
    for _ in range(ATTEMPTS):
        angle = rng.uniform(0, np.pi)
        across = np.array([np.cos(angle), np.sin(angle)])
        line = truth[int(rng.uniform(0.15, 0.85) * len(truth))] @ across
        beyond = landmarks.position_bcs @ across > line
        if FEWEST_BEYOND <= beyond.sum() <= len(beyond) - FEWEST_BEYOND:
            step = gross_error(rng, LEAST_M, MOST_M)
            off = np.array([step.real, step.imag])
            position = landmarks.position_bcs + beyond[:, None] * off
            return replace(
                made,
                landmarks=replace(landmarks, position_bcs=position),
                truth_bcs=truth + (truth @ across > line)[:, None] * off,
            )
    raise RuntimeError(f"{made.name}: no line has {FEWEST_BEYOND} landmarks on either side")
