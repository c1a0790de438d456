"""What is too uncertain to count as labelled: it keeps its position and its sigma, and says so by its status."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from vislam2tag.core.arrays import FloatArray, StatusArray
from vislam2tag.core.status import Status
from vislam2tag.core.tracks import Trajectory


def with_uncertain(status: StatusArray, sigma_m: FloatArray, max_sigma_m: float) -> StatusArray:
    """Turn ``ok`` into ``uncertain`` where sigma (n,) exceeds ``max_sigma_m``, metres; an unknown sigma (NaN) never."""
    above = (status == Status.OK) & (sigma_m > max_sigma_m)
    marked: StatusArray = np.where(above, np.int8(Status.UNCERTAIN), status).astype(np.int8)
    return marked


def mark_uncertain(trajectory: Trajectory, max_sigma_m: float) -> Trajectory:
    """Mark the frames whose sigma exceeds ``max_sigma_m``, metres (``inf``: none); nothing else changes."""
    return replace(trajectory, status=with_uncertain(trajectory.status, trajectory.sigma_m, max_sigma_m))
