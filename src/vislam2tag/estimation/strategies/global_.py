"""The paper's global mapping: one transformation for the whole walk (section V-A), similarity or affine."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.status import Status
from vislam2tag.core.tracks import CameraTrack, LandmarkLog, Landmarks, Segment, Trajectory
from vislam2tag.core.transforms import Affine2, Similarity2
from vislam2tag.core.visits import boundaries_of_loss, find_visits
from vislam2tag.estimation.strategy import TrajectoryBuilder, register, surveyed_rows


@dataclass(frozen=True)
class GlobalMapping:
    """Least squares between each landmark's median logged position and its surveyed one.

    The medians include all logged rows, even during tracking losses, as in the published program. Frames from the first
    boundary (a visit, or an end of a stretch without landmarks) to the one before the last boundary are mapped.
    """

    transformation: type[Similarity2] | type[Affine2]
    visit_radius_m: float
    needs: str = "sightings of two surveyed landmarks"

    def map(self, camera: CameraTrack, log: LandmarkLog, landmarks: Landmarks) -> Trajectory:
        """Map all frames between the first and the last boundary by one transformation."""
        log_surveyed = surveyed_rows(log, landmarks)
        visits = find_visits(camera, log_surveyed, self.visit_radius_m)
        frames = [boundary.frame for boundary in (*visits, *boundaries_of_loss(camera, log))]
        source, target = _median_pairs(log_surveyed, landmarks)
        try:
            bcs_T_acs = self.transformation.fit(source, target)
            start, stop = min(frames), max(frames)
        except ValueError:
            return TrajectoryBuilder.blank(camera, Status.NO_MAPPING).finish(camera, (), visits)
        builder = TrajectoryBuilder.blank(camera, Status.BEFORE_FIRST_LANDMARK)
        builder.map_stretch(camera, start, stop, bcs_T_acs)
        builder.discard(camera, stop, len(camera.time_ns), Status.AFTER_LAST_LANDMARK)
        return builder.finish(camera, (Segment(start, stop, Status.OK),), visits)


def _median_pairs(log: LandmarkLog, landmarks: Landmarks) -> tuple[FloatArray, FloatArray]:
    """Median logged position (m, 2) in the ACS plane and surveyed position (m, 2) of each logged landmark."""
    plane = log.plane_acs
    medians = [np.median(plane[log.rows_of(i)], axis=0) for i in range(len(log.ids))]
    surveyed = landmarks.position_bcs[[landmarks.index[landmark_id] for landmark_id in log.ids]]
    return np.reshape(medians, (-1, 2)).astype(np.float64), surveyed


register("global", lambda settings: GlobalMapping(Similarity2, settings.visit_radius_m))


NEEDS = "sightings of three surveyed landmarks that are not on one line"

register("global-affine", lambda settings: GlobalMapping(Affine2, settings.visit_radius_m, NEEDS))
