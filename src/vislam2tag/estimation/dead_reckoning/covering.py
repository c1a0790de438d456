"""Covariances that also cover walkers and buildings unlike those that the settings were calibrated with.

Few fixes cannot tell an unusual speed, or a plan that is turned against the phone's north, from a wrong path. The path
is therefore fitted a second time, with a speed and a north that may be wrong by much more. With enough fixes both fits
agree, and the covariance stays the usual one.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.similarity import as_points
from vislam2tag.estimation.dead_reckoning.equations import PathModel, Ties
from vislam2tag.estimation.dead_reckoning.smoothing import SmoothedPath, smooth_path

WIDE_SCALE_SIGMA = 0.3
"""Relative error of an unusual walker's speed, one standard deviation."""
WIDE_NORTH_MEMORY_S = 100.0
"""How long an error of the phone's north lasts if the plan itself is turned against north, seconds."""


def covering_covariance(path: SmoothedPath, model: PathModel, ties: Ties) -> FloatArray:
    """(k, 2, 2) covariance of each node's position: the path's own, or, if greater, the second fit's spread about it.

    Raises numpy.linalg.LinAlgError as :func:`~vislam2tag.estimation.dead_reckoning.smoothing.smooth_path` does.
    """
    own = path.covariance[:, :2, :2]
    wide = {
        "scale_sigma": max(WIDE_SCALE_SIGMA, model.settings.scale_sigma),
        "north_memory_s": max(WIDE_NORTH_MEMORY_S, model.settings.north_memory_s),
    }
    other = smooth_path(replace(model, settings=model.settings.model_copy(update=wide)), ties)
    apart_m = as_points(other.state.position - path.state.position)
    spread = other.covariance[:, :2, :2] + apart_m[:, :, None] * apart_m[:, None, :]
    greater = np.trace(spread, axis1=1, axis2=2) > np.trace(own, axis1=1, axis2=2)
    return np.where(greater[:, None, None], spread, own)
