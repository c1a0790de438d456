"""Ids that walks logged against those of the landmark tables: other names, and names shifted by a constant."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np

from vislam2tag.common.findings import Finding, Severity
from vislam2tag.core.limits import MAX_DIAGNOSED_PASSES
from vislam2tag.core.tracks import CameraTrack, LandmarkLog, Landmarks, longest_section
from vislam2tag.estimation.observations import FEWEST_FRAMES, WalkObservations
from vislam2tag.estimation.settings import SmootherSettings
from vislam2tag.intake.ids import IdComparison, IdShift, NamedIds, compare_ids, shift_by_geometry

SAME_IDS = (
    "give the sheets the ids of the table in the app, or write the logged ids into the first column of marker_dict.csv"
)
"""What to do."""


def compared_with_logs(landmarks: Landmarks, logged: Mapping[int, Iterable[str]]) -> dict[int, IdComparison]:
    """Compare the ids that all walks of each floor logged with the tables, for floors where they are of other kinds.

    Ids of other floors' tables count as known: a walk may go there. Floors without a table are left out.
    """
    every = set(landmarks.ids)
    found = {}
    for floor, names in sorted(logged.items()):
        table = landmarks.on_floor(floor).ids
        seen = tuple(name for name in sorted(set(names), key=_natural) if name not in every or name in table)
        if not table or not seen:
            continue
        elsewhere = len(seen) < len(set(names))
        one = compare_ids(
            NamedIds(f"the landmark table of floor {floor}", table), NamedIds("what the phones logged there", seen)
        )
        if one.differ and (one.pattern is not None or not elsewhere):
            found[floor] = one
    return found


def other_ids_findings(landmarks: Landmarks, logged: Mapping[int, Iterable[str]]) -> list[Finding]:
    """Report floors whose walks logged ids of another kind than the table has."""
    return [
        Finding(
            kind="other_ids",
            file="",
            count=len(one.unknown),
            message=f"the ids do not match: {one.text}. Landmarks without a match are unsurveyed: {SAME_IDS}",
            severity=Severity.ERROR,
        )
        for one in compared_with_logs(landmarks, logged).values()
    ]


def shifted_ids_findings(camera: CameraTrack, log: LandmarkLog, landmarks: Landmarks) -> list[Finding]:
    """Report a walk whose ids are all shifted against the table's, by the distances between its landmarks."""
    found = walk_id_shift(camera, log, landmarks)
    if found is None:
        return []
    message = (
        f"the ids seem to be shifted: {found.text}; the walk's labels are wrong. The phone logged landmarks "
        f"{', '.join(sorted(log.ids, key=_natural)[:5])}, ...: {SAME_IDS}"
    )
    count = len(log.ids)
    return [Finding(kind="shifted_ids", file="", count=count, message=message, severity=Severity.ERROR)]


def walk_id_shift(camera: CameraTrack, log: LandmarkLog, landmarks: Landmarks) -> IdShift | None:
    """The constant by which a walk's ids are shifted, by where the tracker's continuous path puts each landmark passed.

    None if they are not shifted, or the walk cannot show it.
    """
    camera, log = longest_section(camera, log)
    if np.count_nonzero(camera.usable) < FEWEST_FRAMES or not len(log.frame):
        return None
    walk = WalkObservations.of(camera, log, SmootherSettings().sighting_range_m).first(MAX_DIAGNOSED_PASSES)
    at = walk.odometry.path[walk.passes.at]
    way_m = np.concatenate(([0.0], np.cumsum(np.abs(np.diff(at))))) if len(at) else np.empty(0)
    return shift_by_geometry(
        [walk.ids[i] for i in walk.passes.landmark.tolist()], at + walk.passes.offset, way_m, _own_places(landmarks)
    )


def _own_places(landmarks: Landmarks) -> dict[str, complex]:
    """Where surveyed landmarks are, those of the walk's own floor if there are several floors."""
    known = landmarks.surveyed
    if landmarks.storeys is not None:
        known = known & (landmarks.floor == landmarks.storeys.own)
    return {landmarks.ids[i]: complex(*landmarks.position_bcs[i]) for i in np.flatnonzero(known).tolist()}


def _natural(name: str) -> tuple[int, int, str]:
    """Numbers by their value, then names."""
    return (0, int(name), "") if name.isdecimal() else (1, 0, name)
