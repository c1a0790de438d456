"""Settings of the estimation: what is assumed of trackers, walkers, phones, buildings and fixes."""

from __future__ import annotations

from typing import Self

from pydantic import Field, model_validator

from vislam2tag.common.records import FiniteRecord

MIN_JUDGED = 3
"""Two fixes agree with any speed and heading. Only steps and time can contradict so few."""


class DeadReckoningSettings(FiniteRecord):
    """How paths are found from inertial sensors; docs/results/dead_reckoning.md calibrates the defaults."""

    fix_sigma_m: float = Field(default=0.4, gt=0)
    """Usual distance per axis between a fix and where the walker was, metres; each session's own is estimated."""
    fix_sigma_spread: float = Field(default=0.6, gt=0)
    """How much that differs between sessions: standard deviation of its logarithm."""
    step_noise: float = Field(default=0.1, gt=0)
    """Random part of the motion, phone held still: metres per square root of a second for each m/s of speed."""
    start_s: float = Field(default=2.0, gt=0)
    """How long the first steps of a recording tell less than others, seconds ..."""
    start_noise: float = Field(default=4.0, ge=0)
    """... and how much random motion they add (squares add up), in parts of the usual."""
    swing_noise: float = Field(default=3.0, ge=0)
    """How much random motion and drift a phone adds that swings, in a hand or on a thigh, in parts of the usual."""
    scale_sigma: float = Field(default=0.05, gt=0)
    """Relative error of a walker's speed, one standard deviation; some differ by much more (Student-t)."""
    scale_noise: float = Field(default=0.01, gt=0)
    """How much it changes: relative, per square root of a second."""
    heading_noise_rad: float = Field(default=0.03, gt=0)
    """Drift of the heading, phone held still, rad per square root of a second."""
    offset_noise: float = Field(default=0.35, ge=0)
    """How far walkers go beside where the phone points after a turn: rad for one of one rad, growing as its root."""
    offset_memory_s: float = Field(default=1.5, gt=0)
    """How long that lasts, seconds."""
    north_sigma_rad: float = Field(default=0.26, gt=0)
    """Error of the phone's own heading against the plan's north, one standard deviation, rad."""
    north_memory_s: float = Field(default=6.0, gt=0)
    """How long such an error lasts, seconds."""
    plan_prior: bool = True
    """Walls of a plan drawn in polygons keep walks between them."""
    wall_distance_m: float = Field(default=0.6, ge=0)
    """Walkers keep so far from walls where there is room, metres."""
    wall_sigma_m: float = Field(default=1.0, gt=0)
    """How far they go beyond that, or a plan is off, one standard deviation, metres."""
    wall_memory_s: float = Field(default=2.0, gt=0)
    """How long that lasts, seconds."""
    standing_s: float = Field(default=2.0, gt=0)
    """Shortest time without steps that counts as standing, seconds."""


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
