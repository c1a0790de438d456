"""What can be chosen of a simulated survey; imports nothing heavy, as the command's help names it all."""

from __future__ import annotations

from enum import StrEnum


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
