"""The paper's evaluation of a whole survey: one error for each walk and strategy."""

from __future__ import annotations

from collections import defaultdict
from pathlib import Path

from vislam2tag.core.tracks import Trajectory
from vislam2tag.evaluation.control_points import is_faulty, nearest_point_errors, walk_error
from vislam2tag.evaluation.tables import WalkErrors
from vislam2tag.evaluation.total_station import (
    JUMP_M,
    StationTrack,
    clock_offset,
    read_station_track,
    station_errors,
    station_frame,
)
from vislam2tag.mapping import strategy_named
from vislam2tag.sessions import read_session
from vislam2tag.sessions.model import Session
from vislam2tag.settings import LocalSettings, Settings
from vislam2tag.survey.model import SessionRef, Survey

STRATEGIES = ("local", "local-corrected", "global-affine")
TRACK_FILE = "tachy.csv"


def map_all(session: Session, survey: Survey, settings: Settings) -> dict[str, Trajectory]:
    """Map a session with each of the paper's strategies."""
    everywhere = survey.site.landmarks
    landmarks = everywhere.on_floor(session.key.floor)
    return {
        name: strategy_named(name, settings).map(session.camera, session.landmarks, landmarks) for name in STRATEGIES
    }


def control_point_walks(survey: Survey, settings: Settings | None = None) -> list[WalkErrors]:
    """Evaluate every session with presses at its floor's control points (Table I)."""
    walks = []
    for ref in survey.sessions:
        floor = survey.site.floor(ref.key.floor)
        session = read_session(ref)
        if not len(session.presses_ns) or not len(floor.control_points.ids):
            continue
        mapped = map_all(session, survey, settings or Settings())
        presses_ns = session.presses_ns
        errors = {
            name: walk_error(nearest_point_errors(one, presses_ns, floor).error_m) for name, one in mapped.items()
        }
        walks.append(WalkErrors(ref.key, errors, is_faulty(mapped["local"], mapped["local-corrected"])))
    return walks


def total_station_walks(survey: Survey, shots: Path) -> list[WalkErrors]:
    """Evaluate every session with a ``tachy.csv`` (Table II); ``shots`` is the tachymeter file of the same floor.

    Raises SurveyError where a file of the station cannot be used.
    """
    settings = Settings(local=LocalSettings(max_step_m=JUMP_M))
    by_device: dict[tuple[int, str], list[SessionRef]] = defaultdict(list)
    for ref in survey.sessions:
        if (ref.folder / TRACK_FILE).is_file():
            by_device[ref.key.floor, ref.key.device].append(ref)
    walks: list[WalkErrors] = []
    for (floor, _), refs in by_device.items():
        frame = station_frame(read_station_track(shots), survey.site.landmarks, floor)
        mapped = [map_all(read_session(ref), survey, settings) for ref in refs]
        tracks: list[StationTrack] = [read_station_track(ref.folder / TRACK_FILE) for ref in refs]
        clock = clock_offset([(m["local-corrected"], t) for m, t in zip(mapped, tracks, strict=True)], frame)
        for ref, one, track in zip(refs, mapped, tracks, strict=True):
            errors = {name: walk_error(station_errors(one[name], track, frame, clock)) for name in STRATEGIES}
            walks.append(WalkErrors(ref.key, errors, is_faulty(one["local"], one["local-corrected"])))
    return walks
