"""Findings that need the landmarks' survey beside the session."""

from __future__ import annotations

import numpy as np

from vislam2tag.common.findings import Finding, Severity
from vislam2tag.core.status import Status
from vislam2tag.core.tracks import CameraTrack, LandmarkLog, Landmarks, Trajectory
from vislam2tag.mapping.trajectory_builder import surveyed_part


def landmark_findings(
    camera: CameraTrack, log: LandmarkLog, landmarks: Landmarks, trajectory: Trajectory, radius_m: float, needs: str
) -> list[Finding]:
    """Landmarks too high to be visited, or too few for the strategy, which says what it needs."""
    return [
        *_too_high(camera, surveyed_part(log, landmarks), trajectory, radius_m),
        *_too_few(camera, trajectory, needs),
    ]


def _too_high(camera: CameraTrack, log: LandmarkLog, trajectory: Trajectory, radius_m: float) -> list[Finding]:
    """Surveyed landmarks passed within the radius on the plan, but never in space."""
    visited = {visit.landmark for visit in trajectory.visits}
    unvisited = log.select([i for i, name in enumerate(log.ids) if name not in visited])
    apart = np.linalg.norm(camera.plane_acs[unvisited.frame] - unvisited.plane_acs, axis=1)
    missed = [unvisited.ids[i] for i in np.unique(unvisited.landmark[(apart < radius_m) & ~unvisited.lost])]
    if not missed:
        return []
    return [
        Finding(
            kind="landmark_never_passed",
            file="",
            count=len(missed),
            message=f"landmarks {', '.join(missed)} were passed but never within {radius_m:g} m in space, height "
            "included, and so not visited: hang them at the phone's height or raise --visit-radius-m",
        )
    ]


def _too_few(camera: CameraTrack, trajectory: Trajectory, needs: str) -> list[Finding]:
    """What was missing where no frame at all could be mapped."""
    usable = trajectory.status[camera.usable]
    if len(usable) == 0 or (usable != Status.NO_MAPPING).any():
        return []
    visited = sorted({visit.landmark for visit in trajectory.visits})
    message = (
        f"the walk cannot be mapped: it needs {needs}; visited within the radius: {', '.join(visited) or 'none'}. Pass "
        "more landmarks, nearer, or survey more of those seen"
    )
    return [Finding(kind="too_few_landmarks", file="", count=1, severity=Severity.ERROR, message=message)]
