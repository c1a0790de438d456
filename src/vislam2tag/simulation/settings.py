"""Options of the simulator's world, what can be chosen of a simulated survey, and where its random numbers come from.

Imports nothing heavy, as the command's help names it all.
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
    """How much goes wrong with tracking."""

    NONE = "none"
    MILD = "mild"
    DEFAULT = "default"
    SEVERE = "severe"


class FileNames(StrEnum):
    """Which names the raw files have."""

    PUBLISHED = "published"
    PAPER = "paper"


class SessionLayout(StrEnum):
    """How sessions are laid out."""

    PUBLISHED = "published"
    PHONE = "phone"
    """As the phone app writes them (docs/reference/phone-format.md)."""


class Locale(StrEnum):
    """Decimal marks of the phones' files."""

    DE = "de"
    """A comma everywhere."""
    EN = "en"
    """A point everywhere."""
    MIXED = "mixed"
    """Each phone its own; OnePlus writes poses with a comma and sensors with a point, as in the published survey."""


class Climb(StrEnum):
    """How walks change floors."""

    STAIRS = "stairs"
    LIFT = "lift"
    MIXED = "mixed"
    """Each time one or the other."""


class SiteColumn(StrEnum):
    """Optional columns of the site's files."""

    ELEVATION = "elevation"
    Z = "z"
    SIGMA = "sigma"
    """``sigma_m``, different from landmark to landmark; the surveyed positions are off accordingly."""
    HEADING = "heading"
    """``heading_rad`` and ``heading_sigma_rad``, off accordingly."""


class CopiedSurvey(StrEnum):
    """Surveys that are simulated in copy."""

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
"""Finding kinds that reading and processing a survey with this trap must report, beside those it has anyway."""


SEVERITIES = {"none": 0.0, "mild": 0.5, "default": 1.0, "severe": 2.0}
"""Named fault levels; ``none`` is a tracker with sensor noise and nothing else."""


def severity_level(severity: str | float) -> float:
    """Turn a name of :data:`SEVERITIES`, or a number not below zero, into a level; raises ValueError otherwise."""
    level = SEVERITIES.get(severity) if isinstance(severity, str) else None
    if level is None:
        level = float(severity)
    if not 0 <= level < float("inf"):
        raise ValueError(f"severity must not be below zero: {severity}")
    return level


def stream(seed: int, *names: object) -> np.random.Generator:
    """Make the generator that belongs to these names: other names never change what it draws."""
    import numpy as np

    text = "\x1f".join(str(name) for name in (seed, *names))
    return np.random.default_rng(int.from_bytes(hashlib.sha256(text.encode()).digest()[:16], "big"))


LANDMARK_HEIGHT_M = 1.4
"""Mean height of landmarks whose height is not known, above the floor, metres."""
LANDMARK_HEIGHT_SIGMA_M = 0.04
"""Standard deviation of that height, metres."""
CONTROL_POINT_SPACING_M = 6.0
"""Usual distance between control points along the ways, metres."""
NARROWEST_ROOM_M = 2.5
"""Rooms between two corridors need at least this."""


class BuildingSettings(SettingsRecord):
    """Size and furnishing of a generated building."""

    removed = frozenset(("landmark_height_m", "landmark_height_sigma_m"))
    width_m: float = Field(default=60.0, ge=30)
    """From left to right, metres."""
    height_m: float = Field(default=32.0, ge=24)
    """From front to back, metres."""
    storey_m: float = 3.6
    """Height of a storey, metres."""
    corridor_width_m: float = Field(default=2.2, ge=1.6, le=4)
    """Width of corridors, metres."""
    room_depth_m: float = Field(default=5.0, ge=3)
    """Depth of rooms, from the corridor on, metres."""
    room_width_m: float = Field(default=4.5, ge=3)
    """Width of rooms along the corridor, metres."""
    cross_corridors: int = Field(default=1, ge=0, le=4)
    """Corridors that cut across the ring."""
    dead_ends: int = Field(default=1, ge=0, le=4)
    """Corners of the ring at which a corridor runs on to the outer wall."""
    landmarks: int = Field(default=12, ge=2, le=25)
    """Landmarks on each floor."""
    control_point_spacing_m: float = Field(default=CONTROL_POINT_SPACING_M, ge=2)
    """Distance between control points along the ways, metres."""
    access_points: int = Field(default=14, ge=1)
    """Access points on each floor."""

    @model_validator(mode="after")
    def _corridors_fit(self) -> Self:
        ring = self.width_m - 2 * self.room_depth_m - self.corridor_width_m
        narrowest = 0.76 * ring / (self.cross_corridors + 1) - self.corridor_width_m
        if narrowest < NARROWEST_ROOM_M:
            raise ValueError(f"{self.cross_corridors} cross corridors do not fit into {self.width_m} m; take fewer")
        return self


class SiteBuildingSettings(SettingsRecord):
    """What plans do not tell of the building of a site."""

    removed = frozenset(("control_point_spacing_m", "landmark_height_m", "landmark_height_sigma_m"))
    storey_m: float = 3.6
    """Height of storeys without elevation, metres."""
    access_point_m2: float = Field(default=140.0, gt=0)
    """One access point for so many square metres of floor, and six at least."""


class SimulationSettings(FiniteRecord):
    """The simulator's world (docs/reference/simulator.md)."""

    building: BuildingSettings = BuildingSettings()
    site: SiteBuildingSettings = SiteBuildingSettings()


class WalkSettings(Record):
    """How somebody walks.

    No part of the tree of settings: a walk's style and what goes wrong on it follow from the command's options
    (:func:`walk_settings`, ``--severity``); Python gives a walk of its own to the functions of ``scenario``.
    """

    speed_m_s: float = Field(default=1.0, gt=0.2, lt=2)
    """Mean speed where nothing slows the walker; each walk has its own, 8 % about it."""
    pauses_per_minute: float = Field(default=0.5, ge=0)
    rooms: float = Field(default=0.12, ge=0, le=1)
    """Probability of entering a room when passing its door."""
    runs: int = Field(default=0, ge=0)
    """Running stretches of 5 to 9 s, at 2 to 3 m/s."""
    people: int = Field(default=0, ge=0)
    """Times at which somebody blocks the camera's view for 2 to 5 s."""
    look: bool = True
    """Whether the walker turns the phone to the landmarks passed."""
    straight_corridor: bool = False
    """Up and down the longest corridor with changing speed, in a total station's view."""
    control_points: bool = False
    """Whether the walk leads over the control points (an evaluation walk)."""


class TrackerSettings(Record):
    """The AR tracker's errors at severity 1; all drift and all faults scale with ``severity``.

    No part of the tree of settings: ``--severity``, a session's phone and its rank among all say what it has of them
    (docs/reference/simulator.md); ``simulation.json`` holds them as resolved for each session.
    """

    severity: float = Field(default=1.0, ge=0)
    frame_rate_hz: float = Field(default=30.0, gt=0, le=120)
    frame_jitter_s: float = Field(default=0.0006, ge=0)
    pose_lag_s: float = 0.045
    """Pose stamps are later than the exposure by this; a constant of the phone."""
    pose_noise_m: float = 0.002
    """White noise of the camera position, per axis."""
    sighting_bias_m: float = 0.19
    """Error of a landmark's position that all frames of one pass share, per axis, at 1 m distance."""
    sighting_noise_m: float = 0.004
    """White noise of a landmark's position, per axis, at 1 m distance."""
    sighting_heading_sigma_rad: float = 0.02
    """Error of a landmark's heading that all frames of one pass share."""
    sighting_range_m: float = 3.0
    sighting_angle_rad: float = math.pi / 3
    """Greatest angle between the sheet's normal and the direction to the camera."""
    field_of_view_rad: float = 1.1
    """Full opening angle of the camera."""
    heading_drift_rad: float = 0.0018
    """Random walk of the heading, per square root of metre walked."""
    turning_drift: float = 0.003
    """Further random walk of the heading, per square root of radian turned."""
    scale_sigma: float = 0.006
    """Stationary spread of the scale."""
    scale_length_m: float = 40.0
    """Distance over which the scale forgets itself."""
    position_drift_m: float = 0.008
    """Random walk of the position, per square root of metre walked, per axis."""
    running_factor: float = 3.0
    """Drift grows by this where the walker runs."""
    loop_share: tuple[float, float] = (0.2, 0.8)
    """Range of the share of the drift that a revisit corrects."""
    break_m: tuple[float, float] = (8.0, 28.0)
    """Jump of the camera at a break, for the best and the worst of the faulty sessions."""
    reexpression_m: tuple[float, float] = (12.0, 100.0)
    """How far a new map's origin lies from the old one's, for the least and the most affected; 0: no new maps."""
    map_updates_per_minute: float = 0.7
    """Small re-expressions of camera and landmarks together."""


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
