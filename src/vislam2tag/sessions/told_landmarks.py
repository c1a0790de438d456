"""Where the landmarks hang that a session passed, as the survey and all other sessions tell."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from vislam2tag.core.arrays import FloatArray, IntArray, joint_columns
from vislam2tag.core.tracks import Landmarks


@dataclass(frozen=True)
class ToldLandmarks:
    """``k`` landmarks by id and floor: ``position_bcs`` (k, 2) metres; ``heading_rad`` (k,), NaN where not known;
    ``joint_covariance`` (3k, 3k) of x, y of each, then of all headings (m^2, m rad, rad^2).
    """

    ids: tuple[str, ...]
    floor: IntArray
    position_bcs: FloatArray
    heading_rad: FloatArray
    joint_covariance: FloatArray
    sessions: int
    """How many other sessions tell of them."""

    def onto(self, landmarks: Landmarks) -> Landmarks:
        """The landmarks of a session, ids unique, in the places told; those that it does not list are added."""
        new = [i for i, name in enumerate(self.ids) if name not in landmarks.index]
        whole = self._added(landmarks, new)
        rows = np.array([whole.index[name] for name in self.ids], dtype=np.int64)
        own = np.concatenate((whole.covariance_bcs[:, (0, 1), (0, 1)].ravel(), whole.heading_sigma_rad**2))
        joint = np.diag(own)
        x = 2 * np.arange(len(whole.ids))
        joint[x, x + 1], joint[x + 1, x] = whole.covariance_bcs[:, 0, 1], whole.covariance_bcs[:, 1, 0]
        column = joint_columns(rows, len(whole.ids))
        joint[column] = joint[:, column] = 0
        joint[np.ix_(column, column)] = self.joint_covariance
        headed = rows[np.isfinite(self.heading_rad)]
        position, heading, sigma = whole.position_bcs.copy(), whole.heading_rad.copy(), whole.heading_sigma_rad.copy()
        position[rows], heading[rows], sigma[rows] = self.position_bcs, self.heading_rad, np.nan
        variance = np.diag(joint)
        sigma[headed] = np.sqrt(variance[2 * len(whole.ids) + headed])
        covariance = whole.covariance_bcs.copy()
        covariance[rows] = joint[(2 * rows[:, None] + (0, 1))[:, :, None], (2 * rows[:, None] + (0, 1))[:, None, :]]
        return replace(
            whole,
            position_bcs=position,
            covariance_bcs=covariance,
            heading_rad=heading,
            heading_sigma_rad=sigma,
            joint_covariance=joint,
        )

    def _added(self, landmarks: Landmarks, new: list[int]) -> Landmarks:
        """The landmarks with those of the told ones that they lack, as if nobody had surveyed them."""
        count = len(new)
        unknown = np.full(count, np.nan)
        return replace(
            landmarks,
            ids=(*landmarks.ids, *(self.ids[i] for i in new)),
            floor=np.concatenate((landmarks.floor, self.floor[new])),
            position_bcs=np.concatenate((landmarks.position_bcs, np.full((count, 2), np.nan))),
            covariance_bcs=np.concatenate(
                (landmarks.covariance_bcs, np.tile(np.diag((np.inf, np.inf)), (count, 1, 1)))
            ),
            z_m=np.concatenate((landmarks.z_m, unknown)),
            heading_rad=np.concatenate((landmarks.heading_rad, unknown)),
            heading_sigma_rad=np.concatenate((landmarks.heading_sigma_rad, unknown)),
            source=(*landmarks.source, *("" for _ in new)) if landmarks.source else (),
        )
