"""Corrections of landmarks, applied."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from vislam2tag.core.arrays import IntArray
from vislam2tag.core.tracks import Landmarks
from vislam2tag.site.corrections.file import (
    UNITS_M,
    Corrections,
    ExcludeLandmark,
    LandmarkUnits,
    MoveLandmark,
    TurnLandmarks,
)
from vislam2tag.site.model import Floor, SessionKey, Site
from vislam2tag.site.settings import SurveySettings


def corrected_landmarks(
    landmarks: Landmarks,
    corrections: Corrections,
    key: SessionKey,
    default_sigma_m: float = SurveySettings().landmark_sigma_m,
) -> tuple[Landmarks, tuple[str, ...]]:
    """Landmarks that a session may use with its corrections applied, and one sentence for each use.

    An entry's ``floor`` is the landmark's. Tables are put into metres, then mirrored, turned and shifted. Excluded
    landmarks go. A moved one has the entry's sigma, else its own (``default_sigma_m`` if it was unsurveyed), and loses
    its heading.
    """
    landmarks, table_uses = _with_tables_corrected(landmarks, corrections, key)
    plain = {entry.name: entry.id for entry in corrections.set_landmark_floor}
    places = [
        (plain.get(name, name), floor) for name, floor in zip(landmarks.ids, landmarks.floor.tolist(), strict=True)
    ]

    def concerns(entry: ExcludeLandmark | MoveLandmark, name: str, floor: int) -> bool:
        return entry.id == name and entry.applies(replace(key, floor=floor))

    gone = {place for place in places for entry in corrections.exclude_landmark if concerns(entry, *place)}
    kept = [place for place in places if place not in gone]
    chosen = landmarks.select([i for i, place in enumerate(places) if place not in gone])
    uses = list(table_uses)
    for entry in corrections.move_landmark:
        for index, place in enumerate(kept):
            if concerns(entry, *place):
                _move(chosen, index, entry, default_sigma_m)
                uses.append(f"Landmark {entry.id} is placed at ({entry.x:g}, {entry.y:g}){entry.because()}.")
    # A correction by hand is more reliable than what the others shared with them.
    return replace(chosen, joint_covariance=None) if uses else chosen, tuple(uses)


def named_by_floor(landmarks: Landmarks, corrections: Corrections, key: SessionKey) -> Landmarks:
    """Call sheets of other floors as the session's corrections do; of their ids only these and the own floor's stay."""
    named = {(entry.to, entry.id): entry.name for entry in corrections.set_landmark_floor if entry.applies(key)}
    if not named:
        return landmarks
    told = {name for _, name in named}
    places = list(zip(landmarks.floor.tolist(), landmarks.ids, strict=True))
    kept = landmarks.select(
        [
            i
            for i, (floor, name) in enumerate(places)
            if name not in told or floor == key.floor or (floor, name) in named
        ]
    )
    return replace(
        kept, ids=tuple(named.get(place, place[1]) for place in zip(kept.floor.tolist(), kept.ids, strict=True))
    )


def with_control_points_corrected(site: Site, corrections: Corrections) -> Site:
    """The site with its control points where corrections put them."""
    if not corrections.move_control_point:
        return site
    return replace(site, floors=tuple(_with_points_moved(floor, corrections) for floor in site.floors))


def _with_points_moved(floor: Floor, corrections: Corrections) -> Floor:
    points = floor.control_points
    position = points.position_bcs.copy()
    for entry in corrections.move_control_point:
        if entry.floor == floor.number and entry.id in points.ids:
            position[points.ids.index(entry.id)] = entry.x, entry.y
    return replace(floor, control_points=replace(points, position_bcs=position))


def _with_tables_corrected(
    landmarks: Landmarks, corrections: Corrections, key: SessionKey
) -> tuple[Landmarks, tuple[str, ...]]:
    """Correct units, mirror and turn whole floors."""
    chosen, uses = landmarks, []
    entries: tuple[LandmarkUnits | TurnLandmarks, ...] = (*corrections.landmark_units, *corrections.turn_landmarks)
    for entry in entries:
        rows = np.flatnonzero(chosen.floor == entry.floor)
        if len(rows) == 0 or not entry.applies(replace(key, floor=int(chosen.floor[rows[0]]))):
            continue
        if chosen is landmarks:
            chosen = landmarks.select(list(range(len(landmarks.ids))))
        if isinstance(entry, LandmarkUnits):
            chosen.position_bcs[rows] *= UNITS_M[entry.unit]
            chosen.z_m[rows] *= UNITS_M[entry.unit]
            uses.append(f"The landmarks of floor {entry.floor} are read in {entry.unit}{entry.because()}.")
        else:
            _turn(chosen, rows, entry)
            steps = {"mirrored": entry.mirrored, "turned": entry.turn_deg != 0, "shifted": any(entry.shift_m)}
            how = ", ".join(step for step, done in steps.items() if done) or "unchanged"
            uses.append(f"The landmarks of floor {entry.floor} are {how}{entry.because()}.")
    return chosen, tuple(uses)


def _turn(own: Landmarks, rows: IntArray, entry: TurnLandmarks) -> None:
    """Mirror, turn and shift landmarks in arrays of our own."""
    turn_rad = np.radians(entry.turn_deg)
    cosine, sine = np.cos(turn_rad), np.sin(turn_rad)
    matrix = np.array([[cosine, -sine], [sine, cosine]]) @ np.diag([-1.0 if entry.mirrored else 1.0, 1.0])
    own.position_bcs[rows] = own.position_bcs[rows] @ matrix.T + entry.shift_m
    surveyed = rows[own.surveyed[rows]]
    own.covariance_bcs[surveyed] = matrix @ own.covariance_bcs[surveyed] @ matrix.T
    heading = np.pi - own.heading_rad[rows] if entry.mirrored else own.heading_rad[rows]
    own.heading_rad[rows] = heading + turn_rad


def _move(own: Landmarks, index: int, entry: MoveLandmark, default_sigma_m: float) -> None:
    """Write the new place of a landmark into arrays of our own (a selection copies)."""
    own.position_bcs[index] = entry.x, entry.y
    if entry.sigma_m is not None or not np.isfinite(own.covariance_bcs[index]).all():
        own.covariance_bcs[index] = np.eye(2) * (entry.sigma_m or default_sigma_m) ** 2
    own.heading_rad[index] = own.heading_sigma_rad[index] = np.nan
