"""Whether known positions of a walk contradict each other so much that its path is wrong as a whole.

One wrong fix among many is outvoted by the others, and the path stays right. Here are walks whose fixes as a whole
do not fit: positions in the wrong order, of another floor, or of another walk.
"""

from __future__ import annotations

import numpy as np

from vislam2tag.core.arrays import FloatArray
from vislam2tag.estimation.dead_reckoning.self_check import LeftOut
from vislam2tag.estimation.dead_reckoning.settings import MIN_JUDGED
from vislam2tag.estimation.dead_reckoning.walk import ReckonedWalk

MIN_DOUBTFUL = 2
MAX_DOUBTFUL_SHARE = 0.3
"""Real walks have one wrong fix in ten at most."""
MAX_SCALE = 2.0
"""Greatest distance between fixes, in parts of what the steps say ..."""
MAX_M_S = 3.0
"""... and in metres per second of the time between them ..."""
MARGIN_M = 3.0
"""... plus this, metres: a fix that is farther from its neighbour is wrong."""


def contradictions_m(walk: ReckonedWalk) -> FloatArray:
    """How far each fix (f,) contradicts the others, metres, if together they cannot be right; otherwise zeros."""
    left_out = LeftOut.of(walk)
    judged, doubtful = np.isfinite(left_out.sigma_m), left_out.doubtful
    most = doubtful.sum() >= MIN_DOUBTFUL and doubtful.sum() > MAX_DOUBTFUL_SHARE * judged.sum()
    if not most and judged.sum() >= MIN_JUDGED:
        return np.zeros(len(judged))
    error_m = np.where(doubtful, np.linalg.norm(np.nan_to_num(left_out.error_m), axis=1), 0.0)
    error_m = np.maximum(error_m, _too_far_m(walk))
    if not error_m.any():
        return error_m
    return np.where(error_m > 0, error_m, np.median(error_m[error_m > 0]))  # the path is no better where one agrees


def _too_far_m(walk: ReckonedWalk) -> FloatArray:
    """How much farther each fix (f,) is from its neighbours than the steps or the time allow, metres."""
    nodes, at = walk.nodes, walk.ties.node
    duration_s = np.diff(nodes.time_s)
    in_time_m = MAX_M_S * duration_s
    walked_m = np.where(nodes.known, MAX_SCALE * nodes.length_m, in_time_m)
    so_far_m = np.vstack((np.zeros(2), np.cumsum(np.column_stack((walked_m, in_time_m)), axis=0)))
    possible_m = np.diff(so_far_m[at], axis=0).min(axis=1)
    excess_m = (np.abs(np.diff(walk.ties.position)) - possible_m - MARGIN_M).clip(0)
    return np.asarray(np.maximum(np.append(excess_m, 0.0), np.append(0.0, excess_m)))
