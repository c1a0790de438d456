"""Entries of ``corrections.toml`` that change nothing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from vislam2tag.common.findings import Finding
from vislam2tag.site.corrections.file import (
    CORRECTIONS_FILE,
    OF_SESSIONS,
    Correction,
    Corrections,
    ExcludeLandmark,
    MoveLandmark,
    SetLandmarkFloor,
)
from vislam2tag.site.model import SessionKey, Site


def unused_corrections(corrections: Corrections, keys: Sequence[SessionKey], site: Site) -> list[Finding]:
    """Find entries that match no session, and moves of what the files of their floors do not have.

    Whether a landmark to exclude or to swap was seen is known only to those who read the sessions: such entries may
    well concern landmarks without a surveyed position.
    """
    known = set(zip(site.landmarks.floor.tolist(), site.landmarks.ids, strict=True))
    points = {(floor.number, name) for floor in site.floors for name in floor.control_points.ids}
    findings = [
        _unused("move_control_point", number, f"floor {entry.floor} has no control point {entry.id}")
        for number, entry in enumerate(corrections.move_control_point, start=1)
        if (entry.floor, entry.id) not in points
    ]
    for table in OF_SESSIONS:
        entries: tuple[Correction, ...] = getattr(corrections, table)
        for number, entry in enumerate(entries, start=1):
            floors = {key.floor for key in keys if entry.applies(key)} | _visited_floor(entry, keys, known)
            if not floors:
                problem = "no session matches"
            elif isinstance(entry, MoveLandmark) and not any((floor, entry.id) in known for floor in floors):
                problem = f"no landmark {entry.id} in the files of the floors it is for"
            elif isinstance(entry, SetLandmarkFloor) and (entry.to, entry.id) not in known:
                problem = f"no landmark {entry.id} in the file of floor {entry.to}"
            else:
                continue
            findings.append(_unused(table, number, problem))
    return findings


def _unused(table: str, number: int, problem: str) -> Finding:
    message = f"[[{table}]] number {number} has no effect: {problem}; correct or remove it"
    return Finding(kind="unused_correction", file=CORRECTIONS_FILE, count=1, message=message)


def _visited_floor(entry: Correction, keys: Sequence[SessionKey], known: set[tuple[int, str]]) -> set[int]:
    """The floor of a landmark entry, where sessions of other floors may go there and find that landmark."""
    if entry.floor is None or not isinstance(entry, ExcludeLandmark | MoveLandmark):
        return set()
    possible = (entry.floor, entry.id) in known and any(entry.applies(replace(key, floor=entry.floor)) for key in keys)
    return {entry.floor} if possible else set()
