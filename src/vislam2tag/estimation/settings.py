"""Settings of the estimation: assumptions about trackers, walkers, phones, buildings and fixes."""

from __future__ import annotations

from typing import Self

from pydantic import Field, model_validator

from vislam2tag.common.records import FiniteRecord, SettingsRecord

MIN_JUDGED = 3
"""Two fixes agree with any speed and heading, so only steps and time can contradict fewer fixes than this."""


class DeadReckoningSettings(SettingsRecord):
    """Paths from inertial sensors alone."""

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
    """Use the walls of a plan drawn in polygons to keep walks inside corridors and rooms."""


class HeightSettings(FiniteRecord):
    """Estimation of the height and floor of each frame (docs/explanation/heights.md)."""

    carried_m: float = Field(default=1.4, gt=0)
    """Usual height of the phone above the floor, metres; also the height of landmarks without a measured height. Change
    it if the phone is not carried in the hand."""
    carried_range_m: tuple[float, float] = (0.9, 1.9)
    """Lowest and highest height of a carried phone above the floor, metres. Widen it for other ways of carrying."""
    surveyed_sigma_m: float = Field(default=0.05, gt=0)
    """Standard deviation of a landmark's surveyed height, metres. The default suits a tape measure."""
    storey_m: float = Field(default=3.5, gt=0)
    """Height of a storey, metres, if floors have no elevation. It only separates floors; heights do not use it."""

    @model_validator(mode="after")
    def _range_in_order(self) -> Self:
        if not self.carried_range_m[0] <= self.carried_m <= self.carried_range_m[1]:
            raise ValueError("carried_m must be within carried_range_m")
        return self


class SmootherSettings(FiniteRecord):
    """The smoother, which estimates its noise levels for each session (docs/explanation/smoother.md)."""

    sighting_range_m: float = Field(default=6.0, gt=0)
    """Largest horizontal distance at which a change of a landmark's logged pose counts as a sighting, metres."""
    body_behind_camera_m: float = Field(default=0.0, ge=-2, le=2)
    """Label the position of a body this far behind the camera, along the horizontal view direction, metres. With 0
    labels are positions of the camera."""
    allow_for_pose_lag: bool = False
    """Correct the delay of the pose time stamps that the gyroscope shows. Use it after a `pose_lag` finding."""


WITHOUT_TRACKER = "dead-reckoning"
"""The strategy for sessions without poses. The smoother passes such sessions to it; it maps no others."""


BY_LANDMARKS = "smoother"
"""The usual strategy for sessions with poses."""
ON_PLAN = "floor-plan"
"""The strategy that places walks on the floor's plan. The smoother passes sessions without usable landmarks to it."""


class MappingSettings(FiniteRecord):
    """How sessions are mapped. Each strategy uses the settings that it needs."""

    visit_radius_m: float = Field(default=1.0, gt=0)
    """A landmark counts as visited if the camera comes this close to it, metres (paper, section V-B)."""
    max_step_m: float = Field(default=5.0, gt=0)
    """`local-corrected` discards a segment with a longer step between successive mapped frames, metres."""
    smoother: SmootherSettings = SmootherSettings()
    dead_reckoning: DeadReckoningSettings = DeadReckoningSettings()
    heights: HeightSettings = HeightSettings()
