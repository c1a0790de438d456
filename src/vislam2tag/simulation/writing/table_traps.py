"""Traps that are made in the tables of a simulated session, before they become text."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from vislam2tag.core.arrays import BoolArray
from vislam2tag.core.tracks import LandmarkLog
from vislam2tag.simulation.model import TrackerLog
from vislam2tag.simulation.sensors.radio import WifiLog
from vislam2tag.simulation.writing.session import SimulatedSession

OTHER_BASE_NS = 1_640_000_000_000_000_000
"""Wall clock (Unix time, end of 2021) minus boot clock, about: what some phones stamp sensors with."""
GAP_S = 3.0
LOST_S = 2.0
POSE_LAG_S = 0.3
SCANS_SKIPPED = 8
"""One scan in this many is left by throttling: about one in half a minute."""
RAISED_M = 2.5
UNLISTED_ID = "9999"


def _other_clock(session: SimulatedSession) -> SimulatedSession:
    return replace(session, imu=replace(session.imu, time_ns=session.imu.time_ns + OTHER_BASE_NS))


def _stale_wifi(session: SimulatedSession) -> SimulatedSession:
    """Every fifth row comes again in the next scan."""
    wifi = session.wifi
    again = np.flatnonzero(wifi.scan < wifi.scan.max(initial=0))[::5]
    source = np.concatenate((np.arange(len(wifi.scan)), again))
    scan = np.concatenate((wifi.scan, wifi.scan[again] + 1))
    order = np.argsort(scan, kind="stable")
    return replace(session, wifi=replace(_wifi_rows(wifi, source[order]), scan=scan[order]))


def _scan_throttling(session: SimulatedSession) -> SimulatedSession:
    wifi = session.wifi
    kept = np.flatnonzero((wifi.scan - wifi.scan[:1]) % SCANS_SKIPPED == 0)
    return replace(session, wifi=_wifi_rows(wifi, kept))


def _wifi_rows(wifi: WifiLog, rows: np.ndarray[tuple[int], np.dtype[np.int64]]) -> WifiLog:
    return WifiLog(wifi.scan[rows], wifi.time_us[rows], wifi.access_point[rows], wifi.rss_dbm[rows])


def _tracking_lost(session: SimulatedSession) -> SimulatedSession:
    """All landmarks take the camera's pose for a while in the middle of the walk."""
    tracker = session.tracker
    log = tracker.landmarks
    start_ns = tracker.time_ns[len(tracker.time_ns) // 2]
    since_s = (tracker.time_ns[log.frame] - start_ns) / 1e9
    lost = (since_s >= 0) & (since_s < LOST_S)
    log = replace(
        log,
        position_acs=np.where(lost[:, None], tracker.position_acs[log.frame], log.position_acs),
        orientation_acs=np.where(lost[:, None], tracker.orientation_acs[log.frame], log.orientation_acs),
        lost=log.lost | lost,
    )
    return _with_tracker(session, replace(tracker, landmarks=log))


def _unknown_landmark(session: SimulatedSession) -> SimulatedSession:
    """The landmark seen last bears an id that marker_dict.csv does not list."""
    log = session.tracker.landmarks
    return _with_landmarks(session, replace(log, ids=(*log.ids[:-1], UNLISTED_ID)))


def _high_landmark(session: SimulatedSession) -> SimulatedSession:
    """The landmark seen last hangs far above the camera."""
    log = session.tracker.landmarks
    raised = (log.landmark == len(log.ids) - 1) & ~log.lost
    position = log.position_acs + np.outer(raised, (0.0, RAISED_M, 0.0))
    return _with_landmarks(session, replace(log, position_acs=position))


def _few_landmarks(session: SimulatedSession) -> SimulatedSession:
    log = session.tracker.landmarks
    return _with_landmarks(session, _landmark_rows(log, log.landmark == 0))


def _frame_gap(session: SimulatedSession) -> SimulatedSession:
    time_ns = session.tracker.time_ns
    since_s = (time_ns - time_ns[len(time_ns) // 2]) / 1e9
    return _with_tracker(session, _frames(session.tracker, (since_s < 0) | (since_s >= GAP_S)))


def _known_from_start(session: SimulatedSession) -> SimulatedSession:
    frames = np.arange(len(session.tracker.time_ns))
    first = int(np.argmax(np.isin(frames, session.tracker.landmarks.frame)))
    return _with_tracker(session, _frames(session.tracker, frames >= first))


def _pose_lag(session: SimulatedSession) -> SimulatedSession:
    tracker = session.tracker
    return _with_tracker(session, replace(tracker, time_ns=tracker.time_ns + int(POSE_LAG_S * 1e9)))


def _non_finite(session: SimulatedSession) -> SimulatedSession:
    """A few frames and sensor rows hold a value that is no number, or infinite."""
    position, values = session.tracker.position_acs.copy(), session.imu.values.copy()
    position[len(position) // 3 :: 400, 0] = np.nan
    values[100::5000, 0] = np.inf
    spoilt = replace(session, imu=replace(session.imu, values=values))
    return _with_tracker(spoilt, replace(session.tracker, position_acs=position))


def _frames(tracker: TrackerLog, kept: BoolArray) -> TrackerLog:
    """Keep the frames of a mask (f,) and their landmark rows."""
    rows = _landmark_rows(tracker.landmarks, kept[tracker.landmarks.frame])
    new_frame = np.cumsum(kept) - 1
    return TrackerLog(
        time_ns=tracker.time_ns[kept],
        exposure_ns=tracker.exposure_ns[kept],
        position_acs=tracker.position_acs[kept],
        orientation_acs=tracker.orientation_acs[kept],
        landmarks=replace(rows, frame=new_frame[rows.frame]),
        events=tracker.events,
    )


def _landmark_rows(log: LandmarkLog, kept: BoolArray) -> LandmarkLog:
    """Keep the rows of a mask (k,)."""
    return replace(
        log,
        landmark=log.landmark[kept],
        frame=log.frame[kept],
        position_acs=log.position_acs[kept],
        orientation_acs=log.orientation_acs[kept],
        lost=log.lost[kept],
    )


def _with_tracker(session: SimulatedSession, tracker: TrackerLog) -> SimulatedSession:
    return replace(session, tracker=tracker)


def _with_landmarks(session: SimulatedSession, log: LandmarkLog) -> SimulatedSession:
    return replace(session, tracker=replace(session.tracker, landmarks=log))


TABLE_TRAPS: dict[str, Callable[[SimulatedSession], SimulatedSession]] = {
    "other_clock": _other_clock,
    "stale_wifi": _stale_wifi,
    "scan_throttling": _scan_throttling,
    "tracking_lost": _tracking_lost,
    "unknown_landmark": _unknown_landmark,
    "high_landmark": _high_landmark,
    "few_landmarks": _few_landmarks,
    "frame_gap": _frame_gap,
    "known_from_start": _known_from_start,
    "pose_lag": _pose_lag,
    "non_finite": _non_finite,
}
"""What each of these traps does to a session's tables."""
