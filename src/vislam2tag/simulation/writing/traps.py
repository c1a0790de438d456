"""Every trap of the raw layout, by name, and the findings that must come of it."""

from __future__ import annotations

from collections.abc import Iterable

from vislam2tag.common.errors import UsageError
from vislam2tag.simulation.writing.session import SimulatedSession
from vislam2tag.simulation.writing.table_traps import TABLE_TRAPS
from vislam2tag.simulation.writing.text_traps import TEXT_TRAPS
from vislam2tag.simulation.writing.writer import SessionText

SITE_TRAPS = {
    "missing_plan": "floorplan.jpg",
    "missing_dimensions": "floor_dimensions.csv",
    "missing_markers": "marker_dict.csv",
}
"""The site file that each of these traps leaves out."""

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

FOUND_BY_PROCESSING = frozenset({"landmark_without_position", "landmark_never_passed", "pose_lag", "too_few_landmarks"})
"""Kinds that need the whole pipeline; the reader alone finds the others."""


def check_traps(names: Iterable[str]) -> frozenset[str]:
    """Return the names as a set; raises UsageError for one that is no trap."""
    traps = frozenset(names)
    unknown = sorted(traps - TRAP_FINDINGS.keys())
    if unknown:
        raise UsageError(f"no such trap: {', '.join(unknown)}; known: {', '.join(TRAP_FINDINGS)}")
    return traps


def trap_tables(session: SimulatedSession, traps: frozenset[str]) -> SimulatedSession:
    """Put the chosen traps into a session's tables."""
    for name, change in TABLE_TRAPS.items():
        if name in traps:
            session = change(session)
    return session


def trap_text(text: SessionText, traps: frozenset[str]) -> SessionText:
    """Put the chosen traps into the text of a session's files."""
    for name, change in TEXT_TRAPS.items():
        if name in traps:
            text = change(text)
    return text


def left_out(path: str, traps: frozenset[str]) -> bool:
    """Tell whether a trap leaves out the site file at this path."""
    return any(path.endswith(name) for trap, name in SITE_TRAPS.items() if trap in traps)
