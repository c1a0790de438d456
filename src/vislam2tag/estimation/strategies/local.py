"""The paper's local mapping: one similarity for each sub-trajectory between two landmarks (section V-B).

``local-corrected`` discards sub-trajectories that are impossible.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from vislam2tag.core.status import Status
from vislam2tag.core.tracks import CameraTrack, LandmarkLog, Landmarks, Segment, Trajectory, Visit
from vislam2tag.core.transforms import Similarity2
from vislam2tag.core.visits import NO_LANDMARK, boundaries_of_loss, find_visits, merge_boundaries
from vislam2tag.estimation.strategy import TrajectoryBuilder, register, surveyed_rows


@dataclass(frozen=True)
class LocalMapping:
    """Maps the end landmarks of each sub-trajectory, as the tracker had them then, to their surveyed positions.

    With ``discards`` (``local-corrected``) a sub-trajectory is discarded if tracking was lost at one of its ends, or if
    two successive mapped frames are more than ``max_step_m`` apart. Without it (``local``) all are kept.
    """

    visit_radius_m: float
    max_step_m: float
    discards: bool
    needs = "visits to two different surveyed landmarks"

    def map(self, camera: CameraTrack, log: LandmarkLog, landmarks: Landmarks) -> Trajectory:
        """Map each sub-trajectory separately; discarded ones have their cause as status."""
        visits = find_visits(camera, surveyed_rows(log, landmarks), self.visit_radius_m)
        return self.map_between(visits, camera, log, landmarks)

    def map_between(
        self, visits: tuple[Visit, ...], camera: CameraTrack, log: LandmarkLog, landmarks: Landmarks
    ) -> Trajectory:
        """Map between given visits to surveyed landmarks, sorted by frame."""
        losses = boundaries_of_loss(camera, log) if self.discards else ()
        boundaries = merge_boundaries(visits, losses)
        frames = [boundary.frame for boundary in boundaries if boundary.landmark != NO_LANDMARK]
        if len(merge_boundaries(visits)) < 2:
            return TrajectoryBuilder.blank(camera, Status.NO_MAPPING).finish(camera, (), visits)
        builder = TrajectoryBuilder.blank(camera, Status.BEFORE_FIRST_LANDMARK)
        builder.discard(camera, frames[-1], len(camera.time_ns), Status.AFTER_LAST_LANDMARK)
        segments = _segments(boundaries, frames[0], frames[-1])
        done = [self._map_segment(builder, segment, camera, log, landmarks) for segment in segments]
        return builder.finish(camera, tuple(done), visits)

    def _map_segment(
        self, builder: TrajectoryBuilder, segment: Segment, camera: CameraTrack, log: LandmarkLog, landmarks: Landmarks
    ) -> Segment:
        """Map one segment, or discard it; return it with its status."""
        start, stop = segment.start, segment.stop
        status = Status(segment.status)
        if status == Status.OK:
            try:
                builder.map_stretch(camera, start, stop, _between_landmarks(segment, log, landmarks))
            except ValueError:
                status = Status.NO_MAPPING
            else:
                if self.discards and _longest_step(builder, camera, start, stop) > self.max_step_m:
                    status = Status.BREAK
        if status != Status.OK:
            builder.discard(camera, start, stop, status)
        return replace(segment, status=status)


def _segments(boundaries: tuple[Visit, ...], first: int, last: int) -> list[Segment]:
    """Pair neighbouring boundaries from frame ``first`` to ``last``; a nameless end means lost tracking."""
    return [
        Segment(
            a.frame,
            b.frame,
            Status.TRACKING_LOST if NO_LANDMARK in (a.landmark, b.landmark) else Status.OK,
            a.landmark,
            b.landmark,
        )
        for a, b in pairwise(boundaries)
        if first <= a.frame < b.frame <= last
    ]


def _between_landmarks(segment: Segment, log: LandmarkLog, landmarks: Landmarks) -> Similarity2:
    """Similarity that maps the two end landmarks, as logged at the segment's two ends, to the survey."""
    ends = ((segment.first_landmark, segment.start), (segment.last_landmark, segment.stop))
    logged = np.array([_logged_at(log, landmark_id, frame) for landmark_id, frame in ends])
    surveyed = landmarks.position_bcs[[landmarks.index[landmark_id] for landmark_id, _ in ends]]
    return Similarity2.from_two_points(logged, surveyed)


def _logged_at(log: LandmarkLog, landmark_id: str, frame: int) -> tuple[float, float]:
    rows = log.rows_of(log.ids.index(landmark_id))
    row = rows.start + int(np.searchsorted(log.frame[rows], frame))
    x, _, z = log.position_acs[row]
    return float(x), -float(z)


def _longest_step(builder: TrajectoryBuilder, camera: CameraTrack, start: int, stop: int) -> float:
    """Greatest distance between neighbouring mapped frames of a stretch, metres."""
    mapped = builder.position_bcs[start:stop, :2][camera.usable[start:stop]]
    steps = np.linalg.norm(np.diff(mapped, axis=0), axis=1)
    return float(steps.max(initial=0.0))


register("local", lambda settings: LocalMapping(settings.visit_radius_m, math.inf, discards=False))


register("local-corrected", lambda settings: LocalMapping(settings.visit_radius_m, settings.max_step_m, discards=True))
