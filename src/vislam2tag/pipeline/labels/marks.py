"""What a mapped walk met, as its result tells it: visits, events of the tracker, contradicting landmarks."""

from __future__ import annotations

import math

from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.status import has_position
from vislam2tag.core.tracks import Landmarks, Trajectory
from vislam2tag.labeling.results import ContradictionMark, EventMark, VisitMark


def visit_marks(trajectory: Trajectory, own: int) -> list[VisitMark]:
    """Each visit with where the camera was then; ``own`` is the session's floor."""
    return [
        VisitMark(
            landmark=visit.landmark,
            time_ns=int(trajectory.time_ns[visit.frame]),
            distance_m=round(visit.distance_m, 3),
            position=_position(trajectory, visit.frame),
            floor=_other_floor(trajectory, visit.frame, own),
        )
        for visit in trajectory.visits
    ]


def event_marks(trajectory: Trajectory, own: int) -> list[EventMark]:
    """Each event with its time and where the camera was after it; ``own`` is the session's floor."""
    return [
        EventMark(
            time_ns=int(trajectory.time_ns[event.frame]),
            kind=event.kind,
            size_m=round(event.size_m, 3),
            turn_rad=None if math.isnan(event.turn_rad) else round(event.turn_rad, 4),
            position=_position(trajectory, event.frame),
            floor=_other_floor(trajectory, event.frame, own),
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
                surveyed_m=_pair(landmarks.position_bcs[row]),
                offset_m=_pair(found.offset_bcs_m),
            )
        )
    return marks


def _position(trajectory: Trajectory, frame: int) -> tuple[float, float] | None:
    """Where the camera was at a frame; None where that frame is not mapped."""
    mapped = has_position(trajectory.status[frame : frame + 1]).all()
    return _pair(trajectory.position_bcs[frame, :2]) if mapped else None


def _other_floor(trajectory: Trajectory, frame: int, own: int) -> int | None:
    """Floor of a frame where it is not the session's own."""
    floor = int(trajectory.floor[frame]) if len(trajectory.floor) else own
    return None if floor == own else floor


def _pair(point: FloatArray | tuple[float, float]) -> tuple[float, float]:
    """A point (2,) in metres, to the centimetre."""
    return round(float(point[0]), 2), round(float(point[1]), 2)
