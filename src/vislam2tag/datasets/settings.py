"""Settings of data sets: how they are made, split and counted."""

from __future__ import annotations

from enum import StrEnum

from pydantic import Field

from vislam2tag.common.records import FiniteRecord, SettingsRecord

CHANGE_CELL_M = 4.0
"""Side of a place, metres: about the distance walked between two scans, so a walk leaves one or two scans in it."""


class SplitKind(StrEnum):
    """What the test set contains that the training set does not."""

    RANDOM = "random"
    DEVICE = "device"
    TRAJECTORY = "trajectory"
    DAY = "day"
    BLOCK = "block"
    FLOOR = "floor"


class SplitSettings(FiniteRecord):
    """How a data set is split into training set and test set (docs/reference/splits.md)."""

    seed: int = 0
    """Seed of the random draw. Change it to get another draw."""
    share: float = Field(default=0.3, gt=0, lt=1)
    """Share of the fingerprints (`random`) or blocks (`block`) in the test set. The default is the paper's 30 %."""
    folds: int = Field(default=5, ge=2)
    """Number of folds for `trajectory`. A data set with fewer walks gets fewer folds."""
    block_m: float = Field(default=10.0, gt=0)
    """Side of a block for `block`, metres."""
    guard_m: float = Field(default=0.0, ge=0)
    """Distance between training and test fingerprints for `block`, metres. Fingerprints in between are unused."""


class ImuWindowSettings(SettingsRecord):
    """How inertial readings are cut into windows for learned odometry (docs/reference/datasets.md)."""

    removed = frozenset(("max_sensor_gap_s",))
    length_s: float = Field(default=1.0, gt=0)
    """Length of a window, seconds. The default is that of RoNIN and TLIO."""
    step_s: float = Field(default=1.0, gt=0)
    """Time from the start of a window to the start of the next, seconds. Windows overlap if it is shorter."""
    rate_hz: float | None = Field(default=None, gt=0)
    """Sampling rate of the windows, Hz. Without a value it is the usual Android rate closest to that of the session."""


class DatasetSettings(FiniteRecord):
    """How labelled readings become a data set (docs/reference/datasets.md)."""

    wifi_window_s: float | None = Field(default=None, ge=0.001)
    """Group Wi-Fi readings by time windows of this length, seconds. Without a value they are grouped by scan."""
    ble_window_s: float = Field(default=1.0, ge=0.001)
    """Group BLE readings, which have no scans, by time windows of this length, seconds."""
    ble_with_wifi: bool = False
    """Add the BLE readings around each Wi-Fi scan to its fingerprint, instead of making fingerprints of their own.

    They are those within half of `ble_window_s` before and after the scan. Others are left out.
    """
    magnetic_window_s: float = Field(default=0.5, ge=0.001)
    """Average magnetic readings over windows of this length, seconds. The default is about half a metre of walking."""
    scan_length_s: float = Field(default=6.0, gt=0)
    """A reading this much older than the newest of its scan is a cached result, seconds. A full sweep takes less."""
    imu: ImuWindowSettings = ImuWindowSettings()

    def window_of(self, technology: str) -> float | None:
        """Return the length of the windows of ``wifi`` or ``ble`` readings, seconds, or None if grouped by scan."""
        return self.ble_window_s if technology == "ble" else self.wifi_window_s


class CoverageSettings(FiniteRecord):
    """How coverage is counted."""

    cell_m: float = Field(default=2.0, ge=0.05)
    """Side of a cell, metres. A walkable area has its own cells, which are used instead."""
    radius_m: float = Field(default=2.0, gt=0)
    """A cell counts as covered if a fingerprint is within this distance of its centre, metres."""


class RadioMapSettings(SettingsRecord):
    """How radio maps are made."""

    removed = frozenset(("least_readings", "most_points"))
    cell_m: float = Field(default=1.0, gt=0)
    """Side of a cell, metres."""
    reach_m: float = Field(default=3.0, gt=0)
    """A cell gets a value if a scan or reading is within this distance of its centre, metres."""
    most: int = Field(default=100, ge=1)
    """Largest number of access points for each floor and technology; those heard most are mapped."""
