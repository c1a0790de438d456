"""The truth of all sessions before a total station: a device's sessions share a clock, so they are looked at together.

Each is mapped once, by the strategy whose labels the station's clock is found with; only track and labels are kept.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from vislam2tag.core.tracks import Trajectory
from vislam2tag.errors import SessionError, SurveyError
from vislam2tag.evaluation.control_points import press_truth
from vislam2tag.evaluation.route_file import read_route
from vislam2tag.evaluation.station_alignment import DeviceAlignment, StationWalk, align_device
from vislam2tag.evaluation.station_file import TRACK_FILE, StationTrack, read_station_track
from vislam2tag.evaluation.station_fit import Freedom
from vislam2tag.evaluation.station_frame import CommonPoints, StationFrame, fit_frame, shot_points
from vislam2tag.evaluation.station_presses import pressed_points
from vislam2tag.evaluation.total_station import station_findings
from vislam2tag.evaluation.truth import Truth
from vislam2tag.findings import Finding
from vislam2tag.mapping import strategy_named
from vislam2tag.pipeline.mappable import mappable_session
from vislam2tag.pipeline.pose_lag import pose_lag_of
from vislam2tag.sessions.model import Session
from vislam2tag.settings import Settings
from vislam2tag.survey.corrections import Corrections
from vislam2tag.survey.files import is_file
from vislam2tag.survey.model import SessionRef, Site

REFERENCE = "smoother"
"""The strategy whose labels tell the station's clock, for all strategies alike."""


@dataclass(frozen=True)
class SessionStation:
    """What a total station tells of a session: its ``truth`` on the labels' clock, or what is ``missing`` for one."""

    truth: Truth | None
    missing: str = ""
    findings: tuple[Finding, ...] = ()
    estimates: dict[str, float | None] = field(default_factory=dict)
    """Clock, frame, prism and pose lag of its device; names end with the unit."""


@dataclass(frozen=True)
class _Seen:
    """A session and the station's track of it."""

    ref: SessionRef
    session: Session
    reference: Trajectory
    track: StationTrack


def station_truths(
    root: Path,
    refs: Sequence[SessionRef],
    site: Site,
    corrections: Corrections,
    settings: Settings,
    freedom: Freedom | None = None,
) -> dict[str, SessionStation]:
    """Align the total station with every session that has a track (``tachy.csv``), device by device; by slug."""
    found: dict[str, SessionStation] = {}
    seen: dict[str, list[_Seen]] = defaultdict(list)
    for ref in refs:
        if not is_file(ref.folder / TRACK_FILE):
            continue
        try:
            track = read_station_track(ref.folder / TRACK_FILE)
            session, landmarks = mappable_session(ref, site, corrections, settings)
            if not session.camera.usable.any():
                raise SessionError(f"{ref.key}: no usable camera frame to compare the station's track with")
            reference = strategy_named(REFERENCE, settings).map(session.camera, session.landmarks, landmarks)
            seen[ref.key.device].append(_Seen(ref, session, reference, track))
        except (SessionError, SurveyError) as error:
            found[ref.slug] = SessionStation(None, str(error))
    for walks in seen.values():
        found |= _of_device(root, walks, site, freedom)
    return found


def _of_device(root: Path, seen: list[_Seen], site: Site, freedom: Freedom | None) -> dict[str, SessionStation]:
    """Align the sessions of a device; where that cannot be, each is told why."""
    try:
        frames = {floor: _frame(root, floor, seen, site) for floor in {one.ref.key.floor for one in seen}}
        walks = [StationWalk(one.reference, one.track, frames[one.ref.key.floor]) for one in seen]
        alignment = align_device(walks, freedom)
    except SurveyError as error:
        return {one.ref.slug: SessionStation(None, str(error)) for one in seen}
    lag_s = [lag for lag in (pose_lag_of(one.session) for one in seen) if lag is not None]
    found = {}
    for number, (one, walk) in enumerate(zip(seen, walks, strict=True)):
        findings = tuple(station_findings(walk, alignment, number))
        estimates = _estimates(alignment, walk.frame, float(np.median(lag_s)) if lag_s else None)
        found[one.ref.slug] = SessionStation(alignment.truths[number], "", findings, estimates)
    return found


def _frame(root: Path, floor: int, seen: list[_Seen], site: Site) -> StationFrame:
    """The station's frame on a floor, by shots of fixed points, and where these are too few by presses as well."""
    control_points = site.floor(floor).control_points
    points = shot_points(root / f"floor_{floor}", floor, site.landmarks, control_points)
    if len(points.names) < 2:
        points = CommonPoints.joined(
            [points, *(_pressed(root, one, site) for one in seen if one.ref.key.floor == floor)]
        )
    return fit_frame(points)


def _pressed(root: Path, one: _Seen, site: Site) -> CommonPoints:
    """Control points pressed at in the station's view; none where the session has no usable presses."""
    floor = site.floor(one.ref.key.floor)
    try:
        route = read_route(root, one.ref.folder, floor.control_points.ids)
        return pressed_points(
            one.reference, one.track, press_truth(one.reference, one.session.presses_ns, floor, route)
        )
    except SessionError:
        return CommonPoints((), np.empty((0, 2)), np.empty((0, 2)))


def _estimates(alignment: DeviceAlignment, frame: StationFrame, pose_lag_s: float | None) -> dict[str, float | None]:
    ahead, left, drift = alignment.prism.ahead_m, alignment.prism.left_m, alignment.drift_ppm
    values = {
        "station_clock_s": alignment.adjustment.clock_ns * 1e-9,
        "station_clock_sigma_s": alignment.clock_sigma_s,
        "station_drift_ppm": None if drift is None else drift.value,
        "station_drift_sigma_ppm": None if drift is None else drift.sigma,
        "station_frame_residual_m": float(frame.residual_m.max()),
        "prism_ahead_m": ahead.value,
        "prism_ahead_sigma_m": ahead.sigma,
        "prism_left_m": left.value,
        "prism_left_sigma_m": left.sigma,
        "pose_lag_s": pose_lag_s,
    }
    return {name: None if value is None else round(value, 4) for name, value in values.items()}
