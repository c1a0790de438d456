"""Settings of the estimation: what is assumed of trackers, walkers, phones, buildings and fixes."""

from __future__ import annotations

from typing import Self

from pydantic import Field, model_validator

from vislam2tag.common.records import FiniteRecord, SettingsRecord

MIN_JUDGED = 3
"""Two fixes agree with any speed and heading. Only steps and time can contradict so few."""


class DeadReckoningSettings(SettingsRecord):
    """How paths are found from inertial sensors."""

    removed = frozenset(
        (
            "fix_sigma_m",
            "fix_sigma_spread",
            "heading_noise_rad",
            "north_memory_s",
            "north_sigma_rad",
            "offset_memory_s",
            "offset_noise",
            "scale_noise",
            "scale_sigma",
            "standing_s",
            "start_noise",
            "start_s",
            "step_noise",
            "swing_noise",
            "wall_distance_m",
            "wall_memory_s",
            "wall_sigma_m",
        )
    )
    plan_prior: bool = True
    """Walls of a plan drawn in polygons keep walks between them."""


class HeightSettings(FiniteRecord):
    """How height and floor of each frame are found (docs/explanation/heights.md)."""

    carried_m: float = Field(default=1.4, gt=0)
    """Usual height of the phone above the floor, and of a landmark whose height nobody measured, metres: in the hand of
    somebody who looks at it."""
    carried_range_m: tuple[float, float] = (0.9, 1.9)
    """Lowest and highest that a walk may carry the phone above the floor, metres."""
    surveyed_sigma_m: float = Field(default=0.05, gt=0)
    """Standard deviation of a landmark's surveyed height, metres: a tape from the floor."""
    storey_m: float = Field(default=3.5, gt=0)
    """Height of a storey where elevations are unknown, metres: tells floors apart, never heights."""

    @model_validator(mode="after")
    def _range_in_order(self) -> Self:
        if not self.carried_range_m[0] <= self.carried_m <= self.carried_range_m[1]:
            raise ValueError("carried_m must lie within carried_range_m")
        return self


class SmootherSettings(FiniteRecord):
    """The smoother; its noise levels are estimated for each session (docs/explanation/smoother.md)."""

    sighting_range_m: float = Field(default=6.0, gt=0)
    """A landmark whose logged pose changes counts as seen within this horizontal distance, metres."""
    body_behind_camera_m: float = Field(default=0.0, ge=-2, le=2)
    """Positions are of a body this far behind the camera, level, along its view, metres; 0: of the camera itself."""
    allow_for_pose_lag: bool = False
    """Whether poses are taken for as much older than their stamps as the gyroscope tells, where it does."""


WITHOUT_TRACKER = "dead-reckoning"
"""The strategy of sessions without poses, which the smoother hands them to; it maps no others."""


class MappingSettings(FiniteRecord):
    """How sessions are mapped; a strategy takes what it needs of it."""

    visit_radius_m: float = Field(default=1.0, gt=0)
    """A landmark is visited where the camera comes within this distance in space, metres (paper, section V-B)."""
    max_step_m: float = Field(default=5.0, gt=0)
    """``local-corrected`` discards a segment with a longer step between neighbouring mapped frames, metres."""
    smoother: SmootherSettings = SmootherSettings()
    dead_reckoning: DeadReckoningSettings = DeadReckoningSettings()
    heights: HeightSettings = HeightSettings()
