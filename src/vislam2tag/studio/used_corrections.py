"""Corrections that affect one session: its own, and those of the site that it uses."""

from __future__ import annotations

from dataclasses import replace

from vislam2tag.labeling.results import SessionResult
from vislam2tag.site.corrections.file import (
    Correction,
    Corrections,
    ExcludeLandmark,
    LandmarkUnits,
    MoveControlPoint,
    MoveLandmark,
    RenameLandmark,
    SetDevice,
    SetFloor,
    SetLandmarkFloor,
    SwapLandmarks,
    TurnLandmarks,
)
from vislam2tag.site.model import SessionKey
from vislam2tag.studio.messages import UsedCorrection


def used_corrections(
    corrections: Corrections, folder: SessionKey, key: SessionKey, result: SessionResult | None
) -> list[UsedCorrection]:
    """Entries of the file that affect a session, by the key of its folder and its corrected one."""
    floors = {key.floor, *(() if result is None else (result.floor, *result.elsewhere))}

    def affects(entry: Correction) -> bool:
        if isinstance(entry, SetFloor | SetDevice):
            return entry.applies(folder)
        if isinstance(entry, ExcludeLandmark | MoveLandmark | LandmarkUnits | TurnLandmarks):
            # The floor of these is the landmark's.
            there = any(entry.applies(replace(key, floor=floor)) for floor in floors)
            return there and _concerns_landmarks(entry, result)
        return entry.applies(key) and _concerns_landmarks(entry, result)

    tables: dict[str, tuple[Correction, ...]] = {
        name: entries
        for name in Corrections.model_fields
        if (entries := getattr(corrections, name)) and isinstance(entries[0], Correction)
    }
    found = [_used(name, entry) for name, entries in tables.items() for entry in entries if affects(entry)]
    points = [_used("move_control_point", entry) for entry in corrections.move_control_point if entry.floor in floors]
    return [*found, *points]


def _concerns_landmarks(entry: Correction, result: SessionResult | None) -> bool:
    """Whether a session saw a landmark of the entry; a session without labels may have seen any."""
    if result is None:
        return True
    seen = {*result.landmarks_logged, *(visit.landmark for visit in result.visits)}
    if isinstance(entry, SwapLandmarks):
        return bool(seen & set(entry.ids))
    if isinstance(entry, RenameLandmark):
        return bool(seen & {entry.id, entry.to})
    if isinstance(entry, SetLandmarkFloor):
        return bool(seen & {entry.id, entry.name})
    if isinstance(entry, ExcludeLandmark):  # it is not in the log any more
        return entry.id in seen or any(use.startswith(f"Landmark {entry.id} is excluded") for use in result.corrections)
    return not isinstance(entry, MoveLandmark) or entry.id in seen


def _used(table: str, entry: Correction | MoveControlPoint) -> UsedCorrection:
    values = entry.model_dump(mode="json", by_alias=True, exclude_unset=True, exclude={"reason"})
    return UsedCorrection(table=table, values=values)
