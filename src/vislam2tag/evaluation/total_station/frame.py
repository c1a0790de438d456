"""The total station's frame in the building: from points known in both."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from vislam2tag.common.errors import SurveyError
from vislam2tag.common.findings import Finding
from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.similarity import Similarity2, as_complex
from vislam2tag.core.tracks import Landmarks
from vislam2tag.evaluation.total_station.station_file import SHOTS_FOLDER, Shots, read_shots
from vislam2tag.site.model import ControlPoints

STATION_LANDMARKS = ("10", "9")
"""The landmarks in data rows 2 and 3 of a tachymeter file that names none (the published survey's)."""
SHOT_RESIDUAL_M = 0.1
"""A shot that fits the frame worse than this is odd, metres."""


@dataclass(frozen=True)
class CommonPoints:
    """``k`` points known in both frames: what they are, and where in the ``station``'s (k, 2) and the BCS (k, 2)."""

    names: tuple[str, ...]
    station: FloatArray
    bcs: FloatArray
    odd_m: float = SHOT_RESIDUAL_M
    """A point that fits the frame worse than this is a finding, metres."""

    @classmethod
    def joined(cls, parts: Sequence[CommonPoints]) -> CommonPoints:
        """All points of several sessions before one station (one at least)."""
        names = tuple(name for part in parts for name in part.names)
        station, bcs = np.concatenate([part.station for part in parts]), np.concatenate([part.bcs for part in parts])
        return cls(names, station, bcs, max(part.odd_m for part in parts))


@dataclass(frozen=True)
class StationFrame:
    """How the station's frame lies in the BCS: turned and moved, both in metres."""

    bcs_t_station: Similarity2
    """Of scale 1."""
    points: CommonPoints
    residual_m: FloatArray
    """(k,) distance of each common point from where the frame puts it; with two points they share what their distance
    differs by."""
    scale: float
    """The scale that would fit best: 1 but for errors, as both frames are in metres."""


def fit_frame(points: CommonPoints) -> StationFrame:
    """Least-squares rotation and translation; raises SurveyError below two points, or where they coincide."""
    if len(points.names) < 2:
        has = f"only {points.names[0]} is" if points.names else "none is"
        raise SurveyError(
            f"the total station's frame needs two common points at least, {has} known: shoot landmarks "
            f"({SHOTS_FOLDER}/*.csv with the columns landmark;X;Y) or press at control points in its view"
        )
    try:
        free = Similarity2.fit(points.station, points.bcs)
    except ValueError as error:
        raise SurveyError("the total station's frame needs two common points at different places") from error
    if not free.scale > 0:
        raise SurveyError("the total station's frame needs two common points at different places")
    turn = free.a / free.scale
    offset = complex(as_complex(points.bcs).mean() - turn * as_complex(points.station).mean())
    bcs_T_station = Similarity2(turn, offset)
    residual = np.linalg.norm(bcs_T_station @ points.station - points.bcs, axis=1)
    return StationFrame(bcs_T_station, points, residual, free.scale)


def frame_findings(frame: StationFrame) -> list[Finding]:
    """Report common points that do not fit."""
    off = np.flatnonzero(frame.residual_m > frame.points.odd_m)
    if not len(off):
        return []
    worst = int(frame.residual_m.argmax())
    message = (
        f"the total station's frame misses {frame.points.names[worst]} by {frame.residual_m[worst]:.2f} m: "
        "check the ids and coordinates of its common points"
    )
    return [Finding(kind="station_frame", file="", count=len(off), message=message)]


def shot_points(
    folder: Path, floor: int, landmarks: Landmarks, control_points: ControlPoints | None = None
) -> CommonPoints:
    """The landmarks and control points of a floor that the station shot, by all tachymeter files in ``folder``.

    ``folder`` is the floor's (``floor_K/tachymeter/*.csv``). Raises SurveyError where a file cannot be used, or names
    what the floor does not have.
    """
    known = _known_points(landmarks, floor, control_points)
    names: list[str] = []
    pairs: list[tuple[FloatArray, FloatArray]] = []
    for path in sorted((folder / SHOTS_FOLDER).glob("*.csv")):
        shots = read_shots(path)
        for row, name in _named_rows(shots):
            if name not in known:
                raise SurveyError(
                    f"{path}: row {row + 1} is a shot of {name}, whose position on floor {floor} is unknown"
                )
            if np.isfinite(shots.position[row]).all():
                names.append(name)
                pairs.append((shots.position[row], known[name]))
    both = np.array(pairs, dtype=np.float64).reshape(-1, 2, 2)
    return CommonPoints(tuple(names), both[:, 0], both[:, 1])


def _known_points(landmarks: Landmarks, floor: int, control_points: ControlPoints | None) -> dict[str, FloatArray]:
    """Positions (2,) of what can be shot on a floor, by name, BCS metres."""
    usable = np.flatnonzero((landmarks.floor == floor) & np.isfinite(landmarks.position_bcs).all(axis=1))
    known = {f"landmark {landmarks.ids[row]}": landmarks.position_bcs[row] for row in usable.tolist()}
    if control_points is not None:
        known |= {f"point {n}": p for n, p in zip(control_points.ids, control_points.position_bcs, strict=True)}
    return known


def _named_rows(shots: Shots) -> list[tuple[int, str]]:
    """Data rows that are shots of named points; the published rule where no row has a name."""
    named = [(row, f"landmark {name}") for row, name in enumerate(shots.landmark) if name]
    named += [(row, f"point {name}") for row, name in enumerate(shots.point) if name]
    if named:
        return named
    published = [(row + 1, f"landmark {name}") for row, name in enumerate(STATION_LANDMARKS)]
    return [(row, name) for row, name in published if row < len(shots.position)]
