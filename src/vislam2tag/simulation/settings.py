"""Settings of the simulated world, options of a simulated survey, and sources of random numbers.

Imports nothing heavy, because the command's help names them all.
"""

from __future__ import annotations

import hashlib
import math
from enum import StrEnum
from typing import TYPE_CHECKING, Self

from pydantic import Field, model_validator

from vislam2tag.common.records import FiniteRecord, Record, SettingsRecord

if TYPE_CHECKING:
    import numpy as np


class SeverityLevel(StrEnum):
    """How many tracking faults occur."""

    NONE = "none"
    MILD = "mild"
    DEFAULT = "default"
    SEVERE = "severe"


class FileNames(StrEnum):
    """Naming scheme of the raw files."""

    PUBLISHED = "published"
    PAPER = "paper"


class SessionLayout(StrEnum):
    """Layout of the session folders."""

    PUBLISHED = "published"
    PHONE = "phone"
    """The layout of the phone app (docs/reference/phone-format.md)."""


class Locale(StrEnum):
    """Decimal marks in the phones' files."""

    DE = "de"
    """A comma everywhere."""
    EN = "en"
    """A point everywhere."""
    MIXED = "mixed"
    """Each phone has its own. OnePlus phones write poses with a comma and sensors with a point, as in the published
    survey."""


class Climb(StrEnum):
    """How walks change floors."""

    STAIRS = "stairs"
    LIFT = "lift"
    MIXED = "mixed"
    """Stairs or lift, drawn for each change of floors."""


class SiteColumn(StrEnum):
    """Optional columns of the site's files."""

    ELEVATION = "elevation"
    Z = "z"
    SIGMA = "sigma"
    """``sigma_m``, which differs between landmarks; surveyed positions have errors of this size."""
    HEADING = "heading"
    """``heading_rad`` and ``heading_sigma_rad``; surveyed headings have errors of this size."""


class CopiedSurvey(StrEnum):
    """Surveys of which copies are simulated."""

    PAPER = "paper"


TRAP_FINDINGS: dict[str, frozenset[str]] = {
    "decimal_comma": frozenset(),
    "mixed_decimal_marks": frozenset({"mixed_decimal_marks"}),
    "no_space_separator": frozenset(),
    "other_clock": frozenset({"clock_mismatch"}),
    "odd_ssids": frozenset(),
    "broken_ssid_bytes": frozenset({"undecodable_text"}),
    "stale_wifi": frozenset({"stale_wifi_rows"}),
    "partial_last_line": frozenset({"partial_last_line"}),
    "garbage_lines": frozenset({"malformed_lines"}),
    "empty_file": frozenset({"empty_file"}),
    "missing_file": frozenset({"missing_file"}),
    "duplicate_times": frozenset({"duplicate_times"}),
    "backward_times": frozenset({"backward_times"}),
    "non_finite": frozenset({"non_finite_values"}),
    "tracking_lost": frozenset({"tracking_lost"}),
    "unknown_landmark": frozenset({"landmark_without_position"}),
    "high_landmark": frozenset({"landmark_never_passed"}),
    "frame_gap": frozenset({"frame_gap"}),
    "scan_throttling": frozenset({"scan_throttling"}),
    "pose_lag": frozenset({"pose_lag"}),
    "few_landmarks": frozenset({"too_few_landmarks"}),
    "duplicate_landmark_rows": frozenset({"duplicate_landmark_rows"}),
    "landmark_rows_without_frame": frozenset({"landmark_rows_without_frame"}),
    "known_from_start": frozenset(),
    "missing_plan": frozenset({"missing_plan"}),
    "missing_dimensions": frozenset({"missing_file"}),
    "missing_markers": frozenset({"missing_file", "landmark_without_position", "too_few_landmarks"}),
}
"""Kinds of findings that a survey with this trap must report, in addition to its usual findings.

Where a floor has a plan, it may place walks past too few landmarks, so ``too_few_landmarks`` needs ``missing_plan``.
"""


SEVERITIES = {"none": 0.0, "mild": 0.5, "default": 1.0, "severe": 2.0}
"""Named fault levels; ``none`` is a tracker with sensor noise only."""


def severity_level(severity: str | float) -> float:
    """Turn a name of :data:`SEVERITIES`, or a number of zero or more, into a level; raises ValueError otherwise."""
    level = SEVERITIES.get(severity) if isinstance(severity, str) else None
    if level is None:
        level = float(severity)
    if not 0 <= level < float("inf"):
        raise ValueError(f"severity must be zero or more: {severity}")
    return level


def stream(seed: int, *names: object) -> np.random.Generator:
    """Make the random generator for these names. Streams of different names are independent."""
    import numpy as np

    text = "\x1f".join(str(name) for name in (seed, *names))
    return np.random.default_rng(int.from_bytes(hashlib.sha256(text.encode()).digest()[:16], "big"))


LANDMARK_HEIGHT_M = 1.4
"""Mean height of landmarks without a known height, above the floor, metres."""
LANDMARK_HEIGHT_SIGMA_M = 0.04
"""Standard deviation of that height, metres."""
CONTROL_POINT_SPACING_M = 6.0
"""Usual distance between control points along the corridors, metres."""
NARROWEST_ROOM_M = 2.5
"""Smallest width of rooms between two corridors, metres."""


class BuildingSettings(SettingsRecord):
    """Size and layout of a generated building."""

    removed = frozenset(("landmark_height_m", "landmark_height_sigma_m"))
    width_m: float = Field(default=60.0, ge=30)
    """Width of the building on the plan, from left to right, metres."""
    height_m: float = Field(default=32.0, ge=24)
    """Height of the building on the plan, from bottom to top, metres."""
    storey_m: float = 3.6
    """Height of a storey, metres."""
    corridor_width_m: float = Field(default=2.2, ge=1.6, le=4)
    """Width of corridors, metres."""
    room_depth_m: float = Field(default=5.0, ge=3)
    """Depth of rooms, measured from the corridor, metres."""
    room_width_m: float = Field(default=4.5, ge=3)
    """Width of rooms along the corridor, metres."""
    cross_corridors: int = Field(default=1, ge=0, le=4)
    """Number of corridors that cross the ring of corridors."""
    dead_ends: int = Field(default=1, ge=0, le=4)
    """Number of corners of the ring from which a corridor continues to the outer wall."""
    landmarks: int = Field(default=12, ge=0, le=25)
    """Number of landmarks on each floor; 0: none, so that only plans place the walks."""
    control_point_spacing_m: float = Field(default=CONTROL_POINT_SPACING_M, ge=2)
    """Distance between control points along the corridors, metres."""
    access_points: int = Field(default=14, ge=1)
    """Number of access points on each floor."""

    @model_validator(mode="after")
    def _corridors_fit(self) -> Self:
        ring = self.width_m - 2 * self.room_depth_m - self.corridor_width_m
        narrowest = 0.76 * ring / (self.cross_corridors + 1) - self.corridor_width_m
        if narrowest < NARROWEST_ROOM_M:
            raise ValueError(f"{self.cross_corridors} cross corridors do not fit into {self.width_m} m; choose fewer")
        return self


class SiteBuildingSettings(SettingsRecord):
    """Properties of a site's building that plans do not show."""

    removed = frozenset(("control_point_spacing_m", "landmark_height_m", "landmark_height_sigma_m"))
    storey_m: float = 3.6
    """Height of storeys without an elevation, metres."""
    access_point_m2: float = Field(default=140.0, gt=0)
    """Floor area for each access point, m². Every floor gets at least six."""


class SimulationSettings(FiniteRecord):
    """The simulated world (docs/reference/simulator.md)."""

    building: BuildingSettings = BuildingSettings()
    site: SiteBuildingSettings = SiteBuildingSettings()


class WalkSettings(Record):
    """How a simulated person walks.

    Not in the tree of settings: the style of a walk and its faults follow from the command's options
    (:func:`walk_settings`, ``--severity``). In Python, pass your own to the functions of ``scenario``.
    """

    speed_m_s: float = Field(default=1.0, gt=0.2, lt=2)
    """Mean speed without obstacles. Each walk has its own, with a spread of 8 %."""
    pauses_per_minute: float = Field(default=0.5, ge=0)
    rooms: float = Field(default=0.12, ge=0, le=1)
    """Probability of entering a room when passing its door."""
    runs: int = Field(default=0, ge=0)
    """Number of running stretches of 5 to 9 s, at 2 to 3 m/s."""
    people: int = Field(default=0, ge=0)
    """Number of times that someone blocks the camera's view for 2 to 5 s."""
    look: bool = True
    """Whether the walker points the phone at the landmarks on the way."""
    straight_corridor: bool = False
    """Walk up and down the longest corridor with changing speed, in view of a total station."""
    control_points: bool = False
    """Whether the walk visits the control points (an evaluation walk)."""


class TrackerSettings(Record):
    """The AR tracker's errors at severity 1. Drift and faults scale with ``severity``.

    Not in the tree of settings: the values follow from ``--severity``, the session's phone and its rank among all
    sessions (docs/reference/simulator.md). ``simulation.json`` contains the values of each session.
    """

    severity: float = Field(default=1.0, ge=0)
    frame_rate_hz: float = Field(default=30.0, gt=0, le=120)
    frame_jitter_s: float = Field(default=0.0006, ge=0)
    pose_lag_s: float = 0.045
    """Delay of the pose time stamps after the exposure, a constant of the phone, seconds."""
    pose_noise_m: float = 0.002
    """White noise of the camera position, per axis."""
    sighting_bias_m: float = 0.19
    """Error of a landmark's position, common to all frames of one observation, per axis, at 1 m distance."""
    sighting_noise_m: float = 0.004
    """White noise of a landmark's position, per axis, at 1 m distance."""
    sighting_heading_sigma_rad: float = 0.02
    """Error of a landmark's heading, common to all frames of one observation."""
    sighting_range_m: float = 3.0
    sighting_angle_rad: float = math.pi / 3
    """Largest angle between the sheet's normal and the direction to the camera."""
    field_of_view_rad: float = 1.1
    """Full opening angle of the camera."""
    heading_drift_rad: float = 0.0018
    """Random walk of the heading, per square root of a metre walked."""
    turning_drift: float = 0.003
    """Additional random walk of the heading, per square root of a radian turned."""
    scale_sigma: float = 0.006
    """Stationary standard deviation of the scale."""
    scale_length_m: float = 40.0
    """Correlation length of the scale, metres."""
    position_drift_m: float = 0.008
    """Random walk of the position, per square root of a metre walked, per axis."""
    running_factor: float = 3.0
    """Factor on the drift while the walker runs."""
    loop_share: tuple[float, float] = (0.2, 0.8)
    """Range of the share of the drift that a revisit corrects."""
    break_m: tuple[float, float] = (8.0, 28.0)
    """Camera jump at a break, metres, for the best and the worst of the faulty sessions."""
    reexpression_m: tuple[float, float] = (12.0, 100.0)
    """Distance between the origins of a new map and the old one, for the least and the most affected session; 0: no new
    maps."""
    map_updates_per_minute: float = 0.7
    """Small corrections that move camera and landmarks together."""


class WalkStyle(StrEnum):
    """Named ways to walk."""

    SURVEY = "survey"
    CONTROL_POINTS = "control-points"
    TOTAL_STATION = "total-station"


def walk_settings(style: WalkStyle, runs: int = 0, people: int = 0) -> WalkSettings:
    """Resolve a named way to walk."""
    if style is WalkStyle.CONTROL_POINTS:
        return WalkSettings(control_points=True, rooms=0.0, runs=runs, people=people)
    if style is WalkStyle.TOTAL_STATION:
        return WalkSettings(straight_corridor=True, rooms=0.0, pauses_per_minute=0.3, runs=runs, people=people)
    return WalkSettings(runs=runs, people=people)
