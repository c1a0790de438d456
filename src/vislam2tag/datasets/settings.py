"""How labelled readings become a data set, how it is split, and what is made of it."""

from __future__ import annotations

from enum import StrEnum

from pydantic import Field

from vislam2tag.common.records import FiniteRecord, SettingsRecord

CHANGE_CELL_M = 4.0
"""Side of a place, metres: about what is walked between two scans, so that a walk through it leaves one or two."""


class SplitKind(StrEnum):
    """What is held out."""

    RANDOM = "random"
    DEVICE = "device"
    TRAJECTORY = "trajectory"
    DAY = "day"
    BLOCK = "block"
    FLOOR = "floor"


class SplitSettings(FiniteRecord):
    """How a data set is split for training and testing (docs/reference/splits.md)."""

    seed: int = 0
    """Another seed, another draw."""
    share: float = Field(default=0.3, gt=0, lt=1)
    """Part that tests, of the fingerprints (``random``) or of the blocks (``block``); the paper's 30 %."""
    folds: int = Field(default=5, ge=2)
    """Folds that walks are dealt to (``trajectory``); fewer where there are fewer walks."""
    block_m: float = Field(default=10.0, gt=0)
    """Side of a block, metres."""
    guard_m: float = Field(default=0.0, ge=0)
    """Fingerprints nearer than this to a block that tests do not train, metres."""


class ImuWindowSettings(SettingsRecord):
    """How inertial readings are cut into windows for learned odometry (docs/reference/datasets.md)."""

    removed = frozenset(("max_sensor_gap_s",))
    length_s: float = Field(default=1.0, gt=0)
    """As in RoNIN and TLIO."""
    step_s: float = Field(default=1.0, gt=0)
    """From one window's start to the next, seconds; shorter than the length: they overlap."""
    rate_hz: float | None = Field(default=None, gt=0)
    """Samples a second; None: the one of Android's usual rates that is nearest to the session's own."""


class DatasetSettings(FiniteRecord):
    """How labelled readings become a data set (docs/reference/datasets.md)."""

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


class CoverageSettings(FiniteRecord):
    """How coverage is counted."""

    cell_m: float = Field(default=2.0, ge=0.05)
    """Side of a cell, metres; where a walkable area is given, its own cells count."""
    radius_m: float = Field(default=2.0, gt=0)
    """A cell is covered when a fingerprint lies within this distance of its centre, metres."""


class RadioMapSettings(SettingsRecord):
    """How radio maps are made."""

    removed = frozenset(("least_readings", "most_points"))
    cell_m: float = Field(default=1.0, gt=0)
    """Side of a cell, metres."""
    reach_m: float = Field(default=3.0, gt=0)
    """A cell has a share where a scan lies within this distance of its centre, a mean where a reading does, metres."""
    most: int = Field(default=100, ge=1)
    """Access points a floor and technology, the most heard; more only where they are named."""
