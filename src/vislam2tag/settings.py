"""Every threshold and default of the package, in one place.

The resolved tree is written beside each result (``run.json``).
"""

from __future__ import annotations

import math
from enum import StrEnum

from pydantic import Field, field_serializer

from vislam2tag.common.records import FiniteRecord


class LabelRule(StrEnum):
    """How a reading between two frames gets its position."""

    INTERPOLATE = "interpolate"
    """Linear interpolation between the two neighbouring frames."""
    NEXT_FRAME = "next-frame"
    """The paper's rule: the first frame whose time is not before the reading's."""


class VisitSettings(FiniteRecord):
    """When a walk counts as having visited a landmark (paper, section V-B)."""

    radius_m: float = Field(default=1.0, gt=0)
    """Greatest 3-D distance between camera and landmark, metres."""


class LocalSettings(FiniteRecord):
    """The paper's local mapping."""

    max_step_m: float = Field(default=5.0, gt=0)
    """``local-corrected`` discards a segment with a longer step between neighbouring mapped frames, metres."""


class SmootherSettings(FiniteRecord):
    """The smoother; its noise levels are estimated for each session, its assumptions stand in ``core.noise``."""

    sighting_range_m: float = Field(default=6.0, gt=0)
    """A landmark whose logged pose changes counts as seen within this horizontal distance, metres."""
    allow_for_pose_lag: bool = False
    """Whether poses are taken for as much older than their stamps as the gyroscope tells, where it does."""


class LabelSettings(FiniteRecord):
    """How time-stamped readings are labelled."""

    rule: LabelRule = LabelRule.INTERPOLATE
    max_gap_s: float = Field(default=1.0, gt=0)
    """No interpolation between frames farther apart than this, seconds."""
    max_sigma_m: float = Field(default=0.5, gt=0, allow_inf_nan=True)
    """Frames and readings whose sigma (one standard deviation per axis) is greater are ``uncertain``, metres.

    Infinite: none is.
    """

    @field_serializer("max_sigma_m", when_used="json")
    def _as_json(self, value: float) -> float | str:
        """JSON has no infinity; as an option, ``inf`` is read back."""
        return value if math.isfinite(value) else "inf"


class FindingSettings(FiniteRecord):
    """When something odd in a session is worth a finding."""

    frame_gap_s: float = Field(default=1.0, gt=0)
    """A hole between neighbouring frames longer than this is a ``frame_gap``, seconds."""
    scan_interval_s: float = Field(default=20.0, gt=0)
    """A median time between Wi-Fi scans above this is ``scan_throttling`` (Android allows 4 scans in 2 minutes)."""
    pose_lag_s: float = Field(default=0.1, gt=0)
    """Poses stamped later than the gyroscope says by more than this are a ``pose_lag``, seconds."""


class SplitSettings(FiniteRecord):
    """How a data set is split for training and testing (docs/datasets.md)."""

    seed: int = 0
    share: float = Field(default=0.3, gt=0, lt=1)
    """Part that tests, of the fingerprints (``random``) or of the blocks (``block``); the paper's 30 %."""
    folds: int = Field(default=5, ge=2)
    """Folds that walks are dealt to (``trajectory``); fewer where there are fewer walks."""
    block_m: float = Field(default=10.0, gt=0)
    """Side of a block, metres."""
    guard_m: float = Field(default=0.0, ge=0)
    """Fingerprints nearer than this to a block that tests do not train, metres."""


class ImuWindowSettings(FiniteRecord):
    """How inertial readings are cut into windows for learned odometry (docs/datasets.md)."""

    length_s: float = Field(default=1.0, gt=0)
    """As in RoNIN and TLIO."""
    step_s: float = Field(default=1.0, gt=0)
    """From one window's start to the next, seconds; shorter than the length: they overlap."""
    rate_hz: float | None = Field(default=None, gt=0)
    """Samples a second; None: the one of Android's usual rates that is nearest to the session's own."""
    max_sensor_gap_s: float = Field(default=0.1, gt=0)
    """A window in which a sensor is silent for longer is dropped, seconds."""


class DatasetSettings(FiniteRecord):
    """How labelled readings become a data set (docs/datasets.md)."""

    wifi_window_s: float | None = Field(default=None, ge=0.001)
    """Wi-Fi readings are grouped by windows of this length, seconds; None: by scan, as the phone gave them."""
    ble_window_s: float = Field(default=1.0, ge=0.001)
    """BLE readings are grouped by windows of this length, seconds: there are no scans."""
    magnetic_window_s: float = Field(default=0.5, ge=0.001)
    """Magnetic readings are averaged over windows of this length, seconds: half a metre of walking."""
    scan_length_s: float = Field(default=6.0, gt=0)
    """A reading this much older than the newest of its scan is a cached result: sweeping all channels takes less."""
    imu: ImuWindowSettings = ImuWindowSettings()

    def window_of(self, technology: str) -> float | None:
        """Length of the windows of ``wifi`` or ``ble`` readings, seconds; None: they are grouped by scan."""
        return self.ble_window_s if technology == "ble" else self.wifi_window_s


class Settings(FiniteRecord):
    """The resolved settings of a run."""

    strategy: str = "smoother"
    visits: VisitSettings = VisitSettings()
    local: LocalSettings = LocalSettings()
    smoother: SmootherSettings = SmootherSettings()
    labels: LabelSettings = LabelSettings()
    findings: FindingSettings = FindingSettings()
    default_landmark_sigma_m: float = Field(default=0.02, gt=0)
    """Standard deviation per axis of a surveyed landmark whose file gives none, metres."""
