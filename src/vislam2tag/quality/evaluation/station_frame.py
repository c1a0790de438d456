"""Files of a total station, and its frame in the building: from points known in both, or presses in its view.

Without shots of fixed points, presses at control points are the common points. Where the prism was at a press is only
known with the clock, and places give the clock only with the frame. So the clock comes from how fast phone and prism
move, which is the same in any frame.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import polars as pl

from vislam2tag.common.errors import SurveyError, first_line
from vislam2tag.common.files.table_files import read_csv
from vislam2tag.common.findings import Finding
from vislam2tag.core.arrays import BoolArray, FloatArray, IntArray
from vislam2tag.core.clocks import best_shift
from vislam2tag.core.limits import of_one_recording
from vislam2tag.core.tracks import Landmarks, Trajectory
from vislam2tag.core.transforms import Similarity2, as_complex
from vislam2tag.quality.evaluation.press_truth import PressTruth
from vislam2tag.quality.evaluation.truth import MAX_GAP_S, usable_path, walking_velocity
from vislam2tag.site.model import ControlPoints

TRACK_FILE = "tachy.csv"
SHOTS_FOLDER = "tachymeter"
"""Folder of a floor with the station's shots of fixed points."""
SHOT_KINDS = ("landmark", "point")
"""Columns that name what was shot."""
STATION_LANDMARKS = ("10", "9")
"""The landmarks in data rows 2 and 3 of a tachymeter file that names none (the published survey's)."""


@dataclass(frozen=True)
class StationTrack:
    """Measured positions (k, 2) in the station's frame, metres, at its wall clock (k,), Unix ns, rising strictly."""

    time_ns: IntArray
    position: FloatArray
    left_out: int = 0
    """Further rows: without a finite position, not later than one before them, or at a time of another recording."""


def read_station_track(path: Path) -> StationTrack:
    """Read ``tachy.csv`` (``;``, header ``time;X;Y``, date-times in ISO form); raises SurveyError where it is none."""
    table = _read(path, ("time", "X", "Y"))
    try:
        time = table["time"].str.to_datetime(time_unit="ns").cast(pl.Int64)
    except pl.exceptions.PolarsError as error:
        raise SurveyError(
            f"{path}: expected date-times like 2022-01-14 16:01:04.25 in column time ({first_line(error)})"
        ) from error
    rows = table.select("X", "Y").with_columns(time=time)
    finite = rows.filter(pl.all_horizontal(pl.all().is_not_null() & pl.all().is_finite()))
    later = finite.filter(pl.col("time") > pl.col("time").cum_max().shift(1).fill_null(np.iinfo(np.int64).min))
    later = later.filter(of_one_recording(later["time"].to_numpy()))
    if len(later) < 2:
        raise SurveyError(f"{path}: expected a track of at least two points; it has {len(later)}")
    return StationTrack(later["time"].to_numpy(), later.select("X", "Y").to_numpy(), len(rows) - len(later))


def read_shots(path: Path) -> tuple[FloatArray, list[tuple[int, str]]]:
    """Read a file of single shots: ``;``, header with ``X`` and ``Y``, optional columns ``landmark`` and ``point``.

    Returns the positions (k, 2) in the station's frame, metres, and which rows are shots of what: ``landmark 9`` or
    ``point 4``; :data:`STATION_LANDMARKS` where no row has a name. Raises SurveyError where it is not such a file.
    """
    table = _read(path, ("X", "Y"))
    names = {kind: table[kind].fill_null("").str.strip_chars() for kind in SHOT_KINDS if kind in table.columns}
    named = [(row, f"{kind} {name}") for kind, column in names.items() for row, name in enumerate(column) if name]
    published = [(row, f"landmark {name}") for row, name in enumerate(STATION_LANDMARKS, 1) if row < len(table)]
    return table.select(pl.col("X", "Y").fill_null(np.nan)).to_numpy(), named or published


def _read(path: Path, columns: tuple[str, ...]) -> pl.DataFrame:
    """Read a table with at least these columns; X and Y are numbers, all else text."""
    numbers = {"X": pl.Float64, "Y": pl.Float64}
    try:
        header = read_csv(path, separator=";", n_rows=0).columns
        schema = {name: numbers.get(name, pl.String) for name in header}
        return read_csv(path, separator=";", schema=schema).select(*columns, pl.exclude(columns))
    except (OSError, pl.exceptions.PolarsError) as error:
        wanted = f"{', '.join(columns[:-1])} and {columns[-1]}"
        raise SurveyError(f"{path}: expected columns {wanted} separated by ';' ({first_line(error)})") from error


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
    """How the station's frame is in the BCS: turned and moved, both in metres."""

    bcs_t_station: Similarity2
    """Of scale 1."""
    points: CommonPoints
    residual_m: FloatArray
    """(k,) distance of each common point from where the frame puts it; with two points they share what their distance
    differs by."""
    scale: float
    """The scale that would fit best: 1 except for errors, as both frames are in metres."""


def fit_frame(points: CommonPoints) -> StationFrame:
    """Least-squares rotation and translation; raises SurveyError below two points, or where they coincide."""
    if len(points.names) < 2:
        has = f"only {points.names[0]} is" if points.names else "none is"
        raise SurveyError(
            f"the total station's frame needs at least two common points, but {has} known: measure landmarks "
            f"({SHOTS_FOLDER}/*.csv with the columns landmark;X;Y), or press at control points in view of the "
            "station"
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
        f"the total station's frame differs by {frame.residual_m[worst]:.2f} m at {frame.points.names[worst]}: check "
        "the ids and coordinates of its common points"
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
        position, shots = read_shots(path)
        for row, name in shots:
            if name not in known:
                raise SurveyError(
                    f"{path}: row {row + 1} is a shot of {name}, whose position on floor {floor} is unknown"
                )
            if np.isfinite(position[row]).all():
                names.append(name)
                pairs.append((position[row], known[name]))
    both = np.array(pairs, dtype=np.float64).reshape(-1, 2, 2)
    return CommonPoints(tuple(names), both[:, 0], both[:, 1])


def _known_points(landmarks: Landmarks, floor: int, control_points: ControlPoints | None) -> dict[str, FloatArray]:
    """Positions (2,) of what can be shot on a floor, by name, BCS metres."""
    usable = np.flatnonzero((landmarks.floor == floor) & np.isfinite(landmarks.position_bcs).all(axis=1))
    known = {f"landmark {landmarks.ids[row]}": landmarks.position_bcs[row] for row in usable.tolist()}
    if control_points is not None:
        known |= {f"point {n}": p for n, p in zip(control_points.ids, control_points.position_bcs, strict=True)}
    return known


STEP_S = 0.1
"""Step of the speeds and of the search."""
FEWEST_S = 20.0
"""Track and walk must overlap for so long."""
MIN_CORRELATION = 0.6
"""Below this the two speeds are not of one motion."""
PRESS_RESIDUAL_M = 1.5
"""A press that fits the frame worse than this is odd: a finger is some tenths of a second off."""


def pressed_points(reference: Trajectory, track: StationTrack, presses: PressTruth) -> CommonPoints:
    """Control points pressed at while the station saw the prism: their surveyed places, and the prism's.

    Presses are taken earlier by the session's lead. Raises SurveyError where no clock makes the speeds of the labels
    and of the track alike.
    """
    lead_s = presses.lead.lead_s if np.isfinite(presses.lead.lead_s) else 0.0
    moment_ns = presses.time_ns[presses.identified] - round(lead_s * 1e9) + clock_by_speed(reference, track)
    point = presses.point[presses.identified]
    prism = _position_at(track, moment_ns)
    seen = np.isfinite(prism).all(axis=1)
    names = tuple(f"point {number}" for number in point[seen].tolist())
    return CommonPoints(names, prism[seen], presses.points_bcs[point[seen]], PRESS_RESIDUAL_M)


def clock_by_speed(reference: Trajectory, track: StationTrack) -> int:
    """The station's wall clock minus the labels' (ns) that makes the two speeds most alike, to :data:`STEP_S`.

    Raises SurveyError where they are alike at no offset.
    """
    time_ns, position_bcs = usable_path(reference)
    mapped, measured = _speeds(time_ns, position_bcs), _speeds(track.time_ns, track.position)
    found = best_shift(measured, mapped, STEP_S, FEWEST_S) if len(mapped) else None
    if found is None or found.correlation < MIN_CORRELATION:
        raise SurveyError(
            "the total station's track and the labels never move alike. Check that tachy.csv and the session are of "
            f"the same measurement, and overlap for at least {FEWEST_S:.0f} s"
        )
    return int(track.time_ns[0] - time_ns[0]) + round(found.shift_s * 1e9)


def _speeds(time_ns: IntArray, position: FloatArray) -> FloatArray:
    """Speed (j,) every :data:`STEP_S` from the first of the times (k,) on, by positions (k, 2), m/s; NaN where not
    known or far from any time.
    """
    if not len(time_ns):
        return np.empty(0)
    at_ns = np.arange(time_ns[0], time_ns[-1], round(STEP_S * 1e9), dtype=np.int64)
    speed = np.linalg.norm(walking_velocity(at_ns, time_ns, position), axis=1)
    return np.where(_in_gap(at_ns, time_ns), np.nan, speed)


def _in_gap(at_ns: IntArray, time_ns: IntArray) -> BoolArray:
    """Mask (k,) of the times between two points too far apart."""
    after = np.searchsorted(time_ns, at_ns).clip(1, len(time_ns) - 1)
    return np.asarray(time_ns[after] - time_ns[after - 1] > MAX_GAP_S * 1e9)


def _position_at(track: StationTrack, at_ns: IntArray) -> FloatArray:
    """Position (k, 2) in the station's frame at its times (k,); NaN outside the track and in its gaps."""
    at_s, knots_s = (at_ns - track.time_ns[0]) * 1e-9, (track.time_ns - track.time_ns[0]) * 1e-9
    place = np.column_stack([np.interp(at_s, knots_s, track.position[:, axis], np.nan, np.nan) for axis in (0, 1)])
    return np.where(_in_gap(at_ns, track.time_ns)[:, None], np.nan, place)
