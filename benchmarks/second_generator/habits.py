"""What the carrier, the phone, its tracker and the surveyor do: drawn once a walk, worse the more severe it is."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

Severity = Literal["none", "mild", "default", "severe"]
FAULTS: dict[Severity, float] = {"none": 0.0, "mild": 0.5, "default": 1.0, "severe": 2.0}
DRIFT: dict[Severity, float] = {"none": 0.25, "mild": 0.6, "default": 1.0, "severe": 1.9}
MOST_SCALE_BIAS = 0.03


@dataclass(frozen=True, kw_only=True)
class Gait:
    """Frames and motion along the route."""

    rate_hz: float
    duration_s: float
    jitter: float = 0.0
    """Standard deviation of a frame's time, as a share of the time between frames."""
    holes_per_min: float = 0.0
    speed_mps: float
    pauses_per_min: float
    stands_at_sheet: float = 0.0
    """Probability of standing still at a landmark that is passed."""


@dataclass(frozen=True, kw_only=True)
class Sheets:
    """How the landmarks hang."""

    spacing_m: float
    """Between crossings."""
    count: int
    aside_m: tuple[float, float]
    """Least and greatest distance from the corridor's middle line."""
    height_spread_m: float = 0.04


@dataclass(frozen=True, kw_only=True)
class Surveying:
    """How well the landmarks' positions are known; shares of the landmarks where no unit is given."""

    sigma_m: float = 0.02
    mis_surveyed: float = 0.0
    moved: float = 0.0
    swapped: float = 0.0
    unsurveyed: float = 0.0
    headings: bool = False


@dataclass(frozen=True, kw_only=True)
class Sight:
    """When a landmark is sighted."""

    reach_m: float
    reach_spread_m: float
    pattern: Literal["all", "one", "few", "first", "blink"] = "all"
    """Which frames of a pass within reach: every, one, up to eight, the first ones, now and then."""
    missed: float = 0.0
    """Probability that a pass goes unnoticed."""


@dataclass(frozen=True, kw_only=True)
class SightingErrors:
    """What is wrong with sightings."""

    pass_bias_m: float
    """Standard deviation per axis of the error that all sightings of a pass share, seen from 1 m."""
    depth_bias: float = 0.0
    frame_noise_m: float = 0.0
    settling: float = 1.0
    """Share of a new sighting that the landmark's pose takes up in 1/30 s."""
    outlier: float = 0.0
    """Probability of a gross error of a sighting in a pass of one."""
    outlier_pass: float = 0.0
    """Probability of a gross error that a whole pass shares."""
    convention: Literal["constant", "arcore", "yaw"]
    """Axes of the sheet: meaningless, ARCore's (X along the wall, Y out of it), or turned about the vertical only."""
    heading_noise_rad: float = 0.0
    lean_rad: float = 0.0
    """Greatest error of the heading by the direction that the sheet is seen from."""


@dataclass(frozen=True, kw_only=True)
class Drift:
    """Errors of the odometry."""

    slip_m_per_sqrt_s: float = 0.0
    slip_m_per_sqrt_m: float = 0.0
    pose_noise_m: float = 0.0
    heading_walk_rad_per_sqrt_s: float
    heading_rate_rad_per_s: float = 0.0
    turn_gain: float = 0.0
    scale_bias: float = 0.0
    scale_wander: float = 0.0
    scale_memory_s: float = 30.0

    def times(self, factor: float) -> Drift:
        """Scale everything but the memory."""
        return Drift(
            slip_m_per_sqrt_s=factor * self.slip_m_per_sqrt_s,
            slip_m_per_sqrt_m=factor * self.slip_m_per_sqrt_m,
            pose_noise_m=factor * self.pose_noise_m,
            heading_walk_rad_per_sqrt_s=factor * self.heading_walk_rad_per_sqrt_s,
            heading_rate_rad_per_s=factor * self.heading_rate_rad_per_s,
            turn_gain=factor * self.turn_gain,
            scale_bias=min(max(factor * self.scale_bias, -MOST_SCALE_BIAS), MOST_SCALE_BIAS),
            scale_wander=factor * self.scale_wander,
            scale_memory_s=self.scale_memory_s,
        )


@dataclass(frozen=True, kw_only=True)
class Updates:
    """Map updates: camera and landmarks are expressed anew."""

    per_min: float = 0.0
    size_m: float = 0.3
    turn_rad: float = 0.006
    scale: float = 0.001
    uneven: float = 0.33
    """Share of the updates that move landmarks and camera by unlike amounts."""


@dataclass(frozen=True, kw_only=True)
class Losses:
    """Lost tracking."""

    per_min: float = 0.0
    rows: Literal["position", "pose", "none"] = "position"
    """What landmarks' rows repeat of the camera's meanwhile; none: there are no rows."""
    motion: Literal["normal", "frozen", "frozen-right", "drifting"] = "normal"
    """The camera walks on, stands still (and goes on from there, or where it belongs) or strays."""
    ends_in_break: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Kidnaps:
    """Jumps of the camera alone, taken back after some time, at a landmark seen before, or never."""

    per_min: float = 0.0
    size_m: float = 8.0
    turn_rad: float = 0.0
    end: Literal["time", "landmark", "never"] = "time"


@dataclass(frozen=True, kw_only=True)
class Corrections:
    """Drift taken back: at any time, or when a landmark is seen again."""

    per_min: float = 0.0
    at_revisit: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Habits:
    """Everything that is drawn once a walk."""

    gait: Gait
    sheets: Sheets
    sight: Sight
    errors: SightingErrors
    drift: Drift
    surveying: Surveying
    updates: Updates = Updates()
    losses: Losses = Losses()
    kidnaps: Kidnaps = Kidnaps()
    corrections: Corrections = Corrections()
    breaks_per_min: float = 0.0
    camera_yaw: Literal["bcs", "acs", "constant"]
    """Whether the camera's heading is logged in the tracker's frame at all."""

    def at(self, severity: Severity) -> Habits:
        """Scale drift and faults to a severity; frames, gait, sight and shared errors of passes stay."""
        faults, shares = FAULTS[severity], min(FAULTS[severity], 1.5)
        survey, updates, losses, errors = self.surveying, self.updates, self.losses, self.errors
        return replace(
            self,
            drift=self.drift.times(DRIFT[severity]),
            errors=replace(errors, outlier=faults * errors.outlier, outlier_pass=faults * errors.outlier_pass),
            surveying=replace(
                survey,
                mis_surveyed=shares * survey.mis_surveyed,
                moved=shares * survey.moved,
                swapped=shares * survey.swapped,
                unsurveyed=shares * survey.unsurveyed,
            ),
            updates=replace(
                updates,
                per_min=faults * updates.per_min,
                size_m=max(faults, 0.3) * updates.size_m,
                turn_rad=max(faults, 0.3) * updates.turn_rad,
            ),
            losses=replace(losses, per_min=faults * losses.per_min, ends_in_break=shares * losses.ends_in_break),
            kidnaps=replace(self.kidnaps, per_min=faults * self.kidnaps.per_min),
            corrections=Corrections(
                per_min=faults * self.corrections.per_min, at_revisit=shares * self.corrections.at_revisit
            ),
            breaks_per_min=faults * self.breaks_per_min,
        )
