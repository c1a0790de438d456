"""Settings of the smoother: what is known of a tracker."""

from __future__ import annotations

from pydantic import Field

from vislam2tag.common.records import FiniteRecord


class SmootherSettings(FiniteRecord):
    """The smoother; its noise levels are estimated for each session (docs/explanation/smoother.md)."""

    sighting_range_m: float = Field(default=6.0, gt=0)
    """A landmark whose logged pose changes counts as seen within this horizontal distance, metres."""
    body_behind_camera_m: float = Field(default=0.0, ge=-2, le=2)
    """Positions are of a body this far behind the camera, level, along its view, metres; 0: of the camera itself."""
    allow_for_pose_lag: bool = False
    """Whether poses are taken for as much older than their stamps as the gyroscope tells, where it does."""
