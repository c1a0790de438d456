"""How much the tracker's idea of where landmarks are moved during a walk (paper, section VI-A and its Figure 6)."""

from __future__ import annotations

import numpy as np

from vislam2tag.core.tracks import LandmarkLog


def landmark_movement_m(log: LandmarkLog) -> float:
    """Mean displacement of the logged landmarks in the plane of the ACS, metres; NaN where none was logged.

    A sheet hangs still, so its logged positions would be one. A landmark's displacement is the mean distance of its
    positions from their median, which is what a mapping of the whole walk takes for its place; rows of lost tracking do
    not count. Each landmark counts once.
    """
    plane = log.plane_acs
    means = []
    for index in range(len(log.ids)):
        rows = log.rows_of(index)
        logged = plane[rows][~log.lost[rows]]
        if len(logged):
            means.append(np.linalg.norm(logged - np.median(logged, axis=0), axis=1).mean())
    return float(np.mean(means)) if means else float("nan")
