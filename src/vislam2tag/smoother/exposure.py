"""Poses at the times of their stamps: what a phone logs was so when the image was exposed, before its stamp."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vislam2tag.core.arrays import FloatArray, IntArray


@dataclass(frozen=True)
class ExposureInterpolation:
    """For each of ``n`` frames which two frames were exposed just before and after its stamp: ``first`` (n,) and the
    next one, and the ``share`` (n,) of the way between them, 0 to 1.
    """

    first: IntArray
    share: FloatArray

    @classmethod
    def of(cls, time_s: FloatArray, lag_s: float) -> ExposureInterpolation:
        """Find them for stamps ``time_s`` (n,), increasing, n at least 2, each ``lag_s`` later than the exposure.

        Nothing is exposed after the last frame (of the first one, before it): there the pose stands still.
        """
        wanted = time_s + lag_s
        first = np.clip(np.searchsorted(time_s, wanted, side="right") - 1, 0, len(time_s) - 2)
        share = (wanted - time_s[first]) / (time_s[first + 1] - time_s[first])
        return cls(first, share.clip(0, 1))

    def blend(self, values: FloatArray) -> FloatArray:
        """Interpolate values (n, ...) of the exposures; where any of them is not known (NaN), the frame's own stays."""
        share = self.share.reshape(-1, *(1 for _ in values.shape[1:]))
        start = values[self.first]
        blended = start + share * (values[self.first + 1] - start)
        return np.asarray(np.where(np.isnan(blended + values), values, blended))

    def blend_quaternions(self, values: FloatArray) -> FloatArray:
        """Interpolate unit quaternions (n, 4) of neighbouring, hence similar, orientations; ``w >= 0``."""
        start, end = values[self.first], values[self.first + 1]
        end = np.where(np.sum(start * end, axis=1, keepdims=True) < 0, -end, end)
        mixed = start + self.share[:, None] * (end - start)
        mixed /= np.linalg.norm(mixed, axis=1, keepdims=True)
        return np.asarray(np.where(mixed[:, 3:] < 0, -mixed, mixed))
