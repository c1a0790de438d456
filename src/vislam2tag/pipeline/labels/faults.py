"""What a strategy found wrong with a walk, as its result tells it: events, and landmarks that contradict the rest."""

from __future__ import annotations

import math

from vislam2tag.common.findings import Finding
from vislam2tag.core.faults import Contradiction
from vislam2tag.core.status import has_position
from vislam2tag.core.tracks import Landmarks, Trajectory
from vislam2tag.labeling.results import ContradictionMark, EventMark
from vislam2tag.pipeline.labels.statistics import other_floor


def event_marks(trajectory: Trajectory, own: int) -> list[EventMark]:
    """Each event with its time and where the camera was after it; ``own`` is the session's floor."""
    mapped = has_position(trajectory.status)
    return [
        EventMark(
            time_ns=int(trajectory.time_ns[event.frame]),
            kind=event.kind,
            size_m=round(event.size_m, 3),
            turn_rad=None if math.isnan(event.turn_rad) else round(event.turn_rad, 4),
            position=_pair(*trajectory.position_bcs[event.frame, :2]) if mapped[event.frame] else None,
            floor=other_floor(trajectory, event.frame, own),
            reason=event.reason,
        )
        for event in trajectory.events
    ]


def contradiction_marks(trajectory: Trajectory, landmarks: Landmarks) -> list[ContradictionMark]:
    """Each contradiction with the floor and the surveyed place of its landmark."""
    marks = []
    for found in trajectory.contradictions:
        row = landmarks.index[found.landmark]
        marks.append(
            ContradictionMark(
                floor=int(landmarks.floor[row]),
                landmark=found.landmark,
                size_m=round(found.size_m, 3),
                sigma_m=round(found.sigma_m, 3),
                passes=found.passes,
                surveyed_m=_pair(*landmarks.position_bcs[row]),
                offset_m=_pair(*found.offset_bcs_m),
            )
        )
    return marks


def contradiction_findings(trajectory: Trajectory, landmarks: Landmarks) -> list[Finding]:
    """One finding for each contradiction, at the landmark's row in the file that surveys it."""
    return [_contradiction(found, landmarks) for found in trajectory.contradictions]


def _contradiction(found: Contradiction, landmarks: Landmarks) -> Finding:
    row = landmarks.index[found.landmark]
    x, y = landmarks.position_bcs[row]
    file, _, line = (landmarks.source[row] if landmarks.source else "").rpartition(":")
    passes = f"{found.passes} pass{'' if found.passes == 1 else 'es'}"
    message = (
        f"landmark {found.landmark} contradicts the others by {found.size_m:.2f} m (one standard deviation is "
        f"{found.sigma_m:.2f} m; {passes}): surveyed at ({x:.2f}, {y:.2f}), the walk puts it at "
        f"({x + found.offset_bcs_m[0]:.2f}, {y + found.offset_bcs_m[1]:.2f}); measure it again and correct its row, or "
        "say in corrections.toml where it hung"
    )
    lines = (int(line),) if line else ()
    return Finding(kind="contradicting_landmark", file=file, count=1, message=message, lines=lines)


def _pair(x: float, y: float) -> tuple[float, float]:
    return round(float(x), 2), round(float(y), 2)
