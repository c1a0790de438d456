"""A rotation at any time between given ones."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from vislam2tag.core.arrays import IntArray


class RotationSeries:
    """Rotations at times (n,), strictly increasing, boot-clock ns."""

    def __init__(self, time_ns: IntArray, rotation: Rotation) -> None:
        quaternion = rotation.as_quat()
        # Neighbours on one side of the sphere, so that what lies between them is between them.
        flips = np.cumprod(np.where(np.sum(quaternion[1:] * quaternion[:-1], axis=1) < 0, -1.0, 1.0))
        self._quaternion = quaternion * np.concatenate(([1.0], flips))[:, None]
        self._time_ns = time_ns

    def at(self, time_ns: IntArray) -> Rotation:
        """Interpolate at times (k,); held before the first and after the last.

        Quaternions are blended and normalised: for the few degrees between neighbouring readings as good as Slerp (a
        tenth of a radian: a few millionths).
        """
        since, at = ((times - self._time_ns[0]) * 1e-9 for times in (self._time_ns, time_ns))
        return Rotation.from_quat(np.column_stack([np.interp(at, since, part) for part in self._quaternion.T]))
