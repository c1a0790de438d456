"""What strategies share: the surveyed part of a log, the empty trajectory, mapping a stretch."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vislam2tag.core.arrays import FloatArray, StatusArray
from vislam2tag.core.orientation import camera_to_bcs
from vislam2tag.core.similarity import Affine2, Similarity2
from vislam2tag.core.status import Status
from vislam2tag.core.tracks import CameraTrack, LandmarkLog, Landmarks, Segment, Trajectory, Visit


@dataclass(frozen=True)
class TrajectoryBuilder:
    """Arrays of a trajectory under construction, one entry for each frame."""

    position_bcs: FloatArray
    orientation_bcs: FloatArray
    status: StatusArray

    @classmethod
    def blank(cls, camera: CameraTrack, cause: Status) -> TrajectoryBuilder:
        """Give every usable frame the same cause; the others keep their own."""
        n = len(camera.time_ns)
        status = np.where(camera.usable, np.int8(cause), camera.status).astype(np.int8)
        return cls(np.full((n, 3), np.nan), np.full((n, 4), np.nan), status)

    def map_stretch(self, camera: CameraTrack, start: int, stop: int, bcs_T_acs: Similarity2 | Affine2) -> None:
        """Fill frames ``start`` (included) to ``stop`` (excluded) by one transformation of the plane."""
        frames = start + np.flatnonzero(camera.usable[start:stop])
        self.position_bcs[frames, :2] = bcs_T_acs @ camera.plane_acs[frames]
        self.orientation_bcs[frames] = camera_to_bcs(camera.orientation_acs[frames], bcs_T_acs.rotation_rad)
        self.status[frames] = Status.OK

    def discard(self, camera: CameraTrack, start: int, stop: int, cause: Status) -> None:
        """Give the usable frames ``start`` to ``stop`` (excluded) a cause instead of a position."""
        frames = start + np.flatnonzero(camera.usable[start:stop])
        self.position_bcs[frames] = np.nan
        self.orientation_bcs[frames] = np.nan
        self.status[frames] = cause

    def finish(self, camera: CameraTrack, segments: tuple[Segment, ...], visits: tuple[Visit, ...]) -> Trajectory:
        """Freeze into a trajectory; the paper's strategies know no uncertainty."""
        covariance = np.full((len(camera.time_ns), 2, 2), np.nan)
        return Trajectory(
            camera.time_ns, self.position_bcs, self.orientation_bcs, covariance, self.status, segments, visits
        )


def surveyed_rows(log: LandmarkLog, landmarks: Landmarks) -> LandmarkLog:
    """Drop the rows of landmarks without a surveyed position."""
    return log.select([i for i, landmark_id in enumerate(log.ids) if landmark_id in landmarks.surveyed_ids])
