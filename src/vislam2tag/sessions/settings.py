"""What of a session is worth a finding; loads no tables, as the command line makes options of it."""

from __future__ import annotations

from pydantic import Field

from vislam2tag.common.records import FiniteRecord


class FindingSettings(FiniteRecord):
    """When something odd in a session is worth a finding."""

    frame_gap_s: float = Field(default=1.0, gt=0)
    """A longer time between two successive frames is a ``frame_gap``, seconds."""
    scan_interval_s: float = Field(default=20.0, gt=0)
    """A longer median time between Wi-Fi scans is ``scan_throttling``, seconds. Android allows 4 scans in 2 minutes."""
    pose_lag_s: float = Field(default=0.1, gt=0)
    """A larger difference between the time stamps of poses and gyroscope is a ``pose_lag``, seconds."""
