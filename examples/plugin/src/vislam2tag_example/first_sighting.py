"""A mapping strategy: one similarity for the walk, from where each landmark was logged first (a poor idea)."""

from __future__ import annotations

import numpy as np

from vislam2tag.core.status import Status
from vislam2tag.core.tracks import CameraTrack, LandmarkLog, Landmarks, Trajectory
from vislam2tag.core.transforms import Similarity2
from vislam2tag.estimation.strategy import TrajectoryBuilder, register, surveyed_rows


class FirstSighting:
    """Maps all frames by one transformation."""

    needs = "two landmarks seen"

    def map(self, camera: CameraTrack, log: LandmarkLog, landmarks: Landmarks) -> Trajectory:
        """Map all frames, or none where fewer than two landmarks were seen."""
        log = surveyed_rows(log, landmarks)
        first = log.plane_acs[log.offsets[:-1]]
        surveyed = landmarks.position_bcs[[landmarks.index[name] for name in log.ids]].reshape(-1, 2)
        builder = TrajectoryBuilder.blank(camera, Status.NO_MAPPING)
        if len(np.unique(first, axis=0)) >= 2:
            builder.map_stretch(camera, 0, len(camera.time_ns), Similarity2.fit(first, surveyed))
        return builder.finish(camera, (), ())


register("first-sighting", lambda settings: FirstSighting())  # noqa: ARG005 - it has no settings
