"""Whether presses and control points, which belong together, are both there."""

from __future__ import annotations

from vislam2tag.findings import Finding, Severity
from vislam2tag.sessions.model import Session
from vislam2tag.survey.model import Floor


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
