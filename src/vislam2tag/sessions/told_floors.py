"""Floors that the walker said to have come to, while the phone recorded: which sheets were seen there."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

import numpy as np

from vislam2tag.common.findings import Finding
from vislam2tag.core.context import ToldFloors
from vislam2tag.core.tracks import LandmarkLog, Landmarks
from vislam2tag.sessions.model import Session
from vislam2tag.site.corrections.file import Corrections, SetLandmarkFloor
from vislam2tag.site.model import Site

_REASON = "the walker said so"


def floors_told(session: Session) -> tuple[int, ...]:
    """Numbers of the floors that the walker said to be on, sorted; none where nobody said so."""
    told = session.camera.told_floors
    return () if told is None else tuple(np.unique(told.floor).tolist())


def on_known_floors(session: Session, site: Site) -> Session:
    """Leave out what the walker told of floors that the survey does not have, and report them."""
    told = session.camera.told_floors
    if told is None:
        return session
    known = np.isin(told.floor, [floor.number for floor in site.floors])
    if known.all():
        return session
    unknown = ", ".join(map(str, np.unique(told.floor[~known]).tolist()))
    message = (
        f"the collector said to be on floor {unknown}, which the survey does not have: what follows counts as on the "
        "floor before; add the floor (docs/how-to/add-floor.md), or leave the time out by [[exclude_span]]"
    )
    finding = Finding(kind="unknown_told_floor", file="Events.csv", count=int((~known).sum()), message=message)
    kept = ToldFloors(told.time_ns[known], told.floor[known]) if known.any() else None
    return replace(session, camera=replace(session.camera, told_floors=kept), findings=(*session.findings, finding))


def with_told_floors(corrections: Corrections, session: Session, landmarks: Landmarks) -> Corrections:
    """Add an entry for each sheet that hangs on a floor the walker told, and whose id another floor has too.

    ``landmarks`` are all floors'. From the moment told to the next one, sightings of such an id are the told floor's.
    What the file says of an id for this session goes before.
    """
    told, camera = session.camera.told_floors, session.camera
    if told is None or not camera.usable.any():
        return corrections
    said = {entry.id for entry in corrections.set_landmark_floor if entry.applies(session.key)}
    floors_of = Counter(landmarks.ids)
    places = set(zip(landmarks.floor.tolist(), landmarks.ids, strict=True))
    key = {"floor": session.key.floor, "device": session.key.device, "session": session.key.session}
    start_ns = int(camera.time_ns[camera.usable][0])
    ends_ns = [*told.time_ns[1:].tolist(), None]
    entries = []
    for begin_ns, end_ns, floor in zip(told.time_ns.tolist(), ends_ns, told.floor.tolist(), strict=True):
        for name in _seen_within(session, begin_ns, end_ns) if floor != session.key.floor else ():
            if (floor, name) in places and floors_of[name] > 1 and name not in said:
                to_s = float("inf") if end_ns is None else (end_ns - start_ns) * 1e-9
                span = {"from_s": (begin_ns - start_ns) * 1e-9, "to_s": to_s}
                entries.append(
                    SetLandmarkFloor.model_validate({"id": name, "to": floor, **key, **span, "reason": _REASON})
                )
    added = (*corrections.set_landmark_floor, *entries)
    return corrections.model_copy(update={"set_landmark_floor": added}) if entries else corrections


def _seen_within(session: Session, begin_ns: int, end_ns: int | None) -> list[str]:
    """Ids that were logged from one moment to another (None: the end), boot-clock ns."""
    log: LandmarkLog = session.landmarks
    at_ns = session.camera.time_ns[log.frame]
    inside = (at_ns >= begin_ns) & (at_ns < (np.iinfo(np.int64).max if end_ns is None else end_ns))
    return [log.ids[number] for number in np.unique(log.landmark[inside]).tolist()]
