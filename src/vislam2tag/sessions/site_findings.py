"""Whether the landmarks a session saw are in the site's landmark files."""

from __future__ import annotations

from collections.abc import Sequence

from vislam2tag.common.findings import Finding, Severity
from vislam2tag.core.tracks import LandmarkLog, Landmarks
from vislam2tag.sessions.model import Session
from vislam2tag.survey.model import Floor


def landmarks_without_position(log: LandmarkLog, landmarks: Landmarks, unused: Sequence[str] = ()) -> list[Finding]:
    """Report landmarks that were seen but have no surveyed position among ``landmarks``, which the session may use.

    ``unused`` are those that only other floors have, where the session does not seem to have been.
    """
    missing = [name for name in log.ids if name not in landmarks.surveyed_ids and name not in unused]
    findings = []
    if missing:
        message = (
            f"landmarks {', '.join(missing)} were seen but have no surveyed position; only the smoother uses them, and "
            "less: add them to marker_dict.csv, or let vislam2tag survey-landmarks place them"
        )
        findings.append(Finding(kind="landmark_without_position", file="", count=len(missing), message=message))
    if unused:
        message = (
            f"landmark {', '.join(unused)} was seen, which only other floors have; nothing else says that the walk "
            "went there, so it is not used: add it to this floor's marker_dict.csv if it hangs here; a lift ride to "
            "a floor where one landmark was met looks the same: pass a second one there, or log air pressure"
        )
        findings.append(Finding(kind="landmark_of_other_floor", file="", count=len(unused), message=message))
    return findings


def press_findings(session: Session, floor: Floor) -> list[Finding]:
    """Report presses on a floor without control points, and a walk without presses on a floor that has some."""
    points = len(floor.control_points.ids)
    recorded = any(file.role == "presses" for file in session.files)
    if len(session.presses_ns) and not points:
        message = f"floor {floor.number} has no control points to compare the presses with: add its refmarker.csv"
        return [_finding("missing_control_points", "", len(session.presses_ns), message)]
    if points and not recorded:
        message = "no presses were recorded, though the floor has control points; nothing is evaluated there"
        return [_finding("missing_file", "refMarker.csv", 1, message)]
    return []


def _finding(kind: str, file: str, count: int, message: str) -> Finding:
    return Finding(kind=kind, file=file, count=count, message=message, severity=Severity.INFO)
