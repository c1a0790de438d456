"""Entries of ``corrections.toml`` that change nothing: what they name does not exist, or no session matches."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import replace

from vislam2tag.common.findings import Finding, FindingKind, Severity
from vislam2tag.intake.ids import closest_id
from vislam2tag.site.corrections.file import (
    CORRECTIONS_FILE,
    OF_SESSIONS,
    Correction,
    Corrections,
    ExcludeLandmark,
    MoveLandmark,
    SetLandmarkFloor,
    SwapLandmarks,
)
from vislam2tag.site.model import SessionKey, Site
from vislam2tag.site.site_table import site_finding

CHANGES_NOTHING = frozenset({"unknown_in_corrections", "unused_correction"})
"""Kinds of findings about such entries."""
_Place = tuple[int, str]
"""Floor and id of a landmark."""


def unused_corrections(corrections: Corrections, keys: Sequence[SessionKey], site: Site) -> list[Finding]:
    """Find entries that match no session, and moves of what the files of their floors do not have.

    Whether a landmark to exclude or to swap was seen is known only to those who read the sessions, see
    :func:`unknown_landmarks`.
    """
    known = set(zip(site.landmarks.floor.tolist(), site.landmarks.ids, strict=True))
    points = {(floor.number, name) for floor in site.floors for name in floor.control_points.ids}
    findings = [
        _unknown(
            "move_control_point",
            number,
            f"floor {entry.floor} has no control point {entry.id}",
            entry.id,
            [name for floor, name in points if floor == entry.floor],
        )
        for number, entry in enumerate(corrections.move_control_point, start=1)
        if (entry.floor, entry.id) not in points
    ]
    for table in OF_SESSIONS:
        for number, entry in enumerate(getattr(corrections, table), start=1):
            findings += _problems(table, number, entry, keys, known)
    return findings


def unknown_landmarks(corrections: Corrections, site: Site, seen: Iterable[str], uses: Iterable[str]) -> list[Finding]:
    """Find entries about the landmarks of logs that neither the site's files nor any walk has.

    ``seen`` are the ids that all walks logged; ``uses`` the sentences about applied corrections, because a corrected
    log may not have the id any more.
    """
    known, used = {*site.landmarks.ids, *seen}, "\n".join(uses)
    return [
        _unknown(table, number, f"neither the site's files nor a walk has a landmark {name}", name, known)
        for table in ("exclude_landmark", "swap_landmarks", "rename_landmark")
        for number, entry in enumerate(getattr(corrections, table), start=1)
        for name in (entry.ids if isinstance(entry, SwapLandmarks) else [entry.id])
        if name not in known and not re.search(rf"(?<!\w){re.escape(name)}(?!\w)", used)
    ]


def _problems(
    table: str, number: int, entry: Correction, keys: Sequence[SessionKey], known: set[_Place]
) -> Iterator[Finding]:
    floors = {key.floor for key in keys if entry.applies(key)} | _visited_floor(entry, keys, known)
    if not floors:
        yield _unmatched(table, number, entry, keys)
    elif isinstance(entry, MoveLandmark) and not any((floor, entry.id) in known for floor in floors):
        problem = f"there is no landmark {entry.id} in the files of its floors"
        yield _unknown(table, number, problem, entry.id, [name for floor, name in known if floor in floors])
    elif isinstance(entry, SetLandmarkFloor) and (entry.to, entry.id) not in known:
        problem = f"there is no landmark {entry.id} in the file of floor {entry.to}"
        yield _unknown(table, number, problem, entry.id, [name for floor, name in known if floor == entry.to])


def _unmatched(table: str, number: int, entry: Correction, keys: Sequence[SessionKey]) -> Finding:
    """An entry that matches no session, by the first of its names that no session has."""
    if entry.floor is not None and all(key.floor != entry.floor for key in keys):
        problem = f"no session is of floor {entry.floor}"
        return _unknown(table, number, problem, str(entry.floor), {str(key.floor) for key in keys})
    if entry.device is not None and all(key.device != entry.device for key in keys):
        return _unknown(table, number, f"there is no device {entry.device}", entry.device, {key.device for key in keys})
    session = entry.session
    if session is not None and all(key.session.replace(":", "") != session.replace(":", "") for key in keys):
        return _unknown(table, number, f"there is no session {session}", session, {key.session for key in keys})
    return _unused(table, number, "no session matches")


def _unknown(table: str, number: int, problem: str, name: str, known: Collection[str]) -> Finding:
    if (near := closest_id(name, known)) is None:
        return _unused(table, number, problem, "unknown_in_corrections", Severity.ERROR)
    message = f"[[{table}]] number {number} has no effect: {problem}; the closest is {near}: correct or remove it"
    return site_finding("unknown_in_corrections", CORRECTIONS_FILE, message, Severity.ERROR)


def _unused(
    table: str,
    number: int,
    problem: str,
    kind: FindingKind = "unused_correction",
    severity: Severity = Severity.WARNING,
) -> Finding:
    message = f"[[{table}]] number {number} has no effect: {problem}; correct or remove it"
    return site_finding(kind, CORRECTIONS_FILE, message, severity)


def _visited_floor(entry: Correction, keys: Sequence[SessionKey], known: set[_Place]) -> set[int]:
    """The floor of a landmark entry, where sessions of other floors may go there and find that landmark."""
    if entry.floor is None or not isinstance(entry, ExcludeLandmark | MoveLandmark):
        return set()
    possible = (entry.floor, entry.id) in known and any(entry.applies(replace(key, floor=entry.floor)) for key in keys)
    return {entry.floor} if possible else set()
