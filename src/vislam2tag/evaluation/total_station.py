"""Label errors against a total station's track, as the paper takes them (section VI-B)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import polars as pl

from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.core.interpolation import label_by_interpolation
from vislam2tag.core.similarity import Similarity2
from vislam2tag.core.tracks import Landmarks, Trajectory
from vislam2tag.errors import SurveyError
from vislam2tag.evaluation.truth import MAX_GAP_S

STATION_LANDMARKS = ("10", "9")
"""Ids of the landmarks shot by the station, in data rows 2 and 3 of the tachymeter file."""
JUMP_M = 2.0
"""``local-corrected`` discards longer steps than this in the paper's total-station evaluation, metres."""
SEARCH_S = 20.0
"""How far from the guessed clock offset the best one is looked for, seconds to both sides."""
CLIP_M = 5.0
"""Errors count at most this much in the search: a wrongly mapped stretch must not decide it."""


@dataclass(frozen=True)
class StationTrack:
    """Measured positions (k, 2) in the station's frame, metres, at its wall clock (k,), Unix ns."""

    time_ns: IntArray
    position: FloatArray


def read_station_track(path: Path) -> StationTrack:
    """Read ``tachy.csv`` (``;``, header ``time;X;Y``, date-times in ISO form); raises SurveyError where it is none."""
    schema = {"time": pl.String, "X": pl.Float64, "Y": pl.Float64}
    try:
        table = pl.read_csv(path, separator=";", columns=list(schema), schema_overrides=schema)
        time = table["time"].str.to_datetime(time_unit="ns")
    except (OSError, pl.exceptions.PolarsError) as error:
        raise SurveyError(f"{path}: expected columns time, X and Y separated by ';' ({error})") from error
    return StationTrack(time.cast(pl.Int64).to_numpy(), table.select("X", "Y").to_numpy())


def station_frame(shots: StationTrack, landmarks: Landmarks, floor: int) -> Similarity2:
    """Find ``bcs_T_station`` from the station's shots of two landmarks of a floor.

    Raises SurveyError where the floor has no such landmarks or the file no such rows.
    """
    rows = [i for name in STATION_LANDMARKS for i in range(len(landmarks.ids)) if _is(landmarks, i, name, floor)]
    if len(rows) != len(STATION_LANDMARKS) or len(shots.position) < 3:
        raise SurveyError(f"floor {floor}: the station's frame needs landmarks 10 and 9 and its shots of them")
    return Similarity2.from_two_points(shots.position[1:3], landmarks.position_bcs[rows])


def _is(landmarks: Landmarks, row: int, name: str, floor: int) -> bool:
    return landmarks.ids[row] == name and int(landmarks.floor[row]) == floor


def station_errors(
    trajectory: Trajectory, track: StationTrack, bcs_t_station: Similarity2, clock_ns: int
) -> FloatArray:
    """Distance (k,) in the plane between each measured point and the label at its time, metres; NaN without one.

    ``clock_ns`` is the station's wall clock minus the phone's boot clock.
    """
    labels = label_by_interpolation(track.time_ns - clock_ns, trajectory, MAX_GAP_S)
    return np.asarray(np.linalg.norm(labels.position_bcs[:, :2] - bcs_t_station @ track.position, axis=1))


def clock_offset(walks: Sequence[tuple[Trajectory, StationTrack]], bcs_t_station: Similarity2) -> int:
    """Find the one clock offset of a device (ns) with the least error over all its walks.

    As in the paper the offset is fitted to the very errors it is then used for. The search starts where the first
    walk's track and trajectory begin together, and goes from half seconds down to ten milliseconds.
    """
    first, track = walks[0]
    best = int(track.time_ns[0] - first.time_ns[0])
    for reach_s, step_s in ((SEARCH_S, 0.5), (0.5, 0.05), (0.05, 0.01)):
        steps = np.arange(-reach_s, reach_s + step_s / 2, step_s)
        offsets = best + (steps * 1e9).astype(np.int64)
        costs = [_cost(walks, bcs_t_station, int(offset)) for offset in offsets]
        best = int(offsets[int(np.argmin(costs))])
    return best


def _cost(walks: Sequence[tuple[Trajectory, StationTrack]], bcs_t_station: Similarity2, clock_ns: int) -> float:
    """Mean clipped error over all points of all walks; points without a label count in full."""
    errors = [station_errors(trajectory, track, bcs_t_station, clock_ns) for trajectory, track in walks]
    return float(np.mean(np.nan_to_num(np.concatenate(errors), nan=CLIP_M).clip(max=CLIP_M)))
