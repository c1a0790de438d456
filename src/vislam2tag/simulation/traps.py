"""Traps of the raw layout: made in a session's tables or in the text of its files, or site files that are left out."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from itertools import cycle

import numpy as np

from vislam2tag.common.errors import UsageError
from vislam2tag.core.arrays import BoolArray
from vislam2tag.core.tracks import LandmarkLog
from vislam2tag.simulation.choices import TRAP_FINDINGS
from vislam2tag.simulation.model import TrackerLog
from vislam2tag.simulation.phones import SimulatedSession
from vislam2tag.simulation.radio import WifiLog
from vislam2tag.simulation.raw_files import SessionText

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


PHONE_FILES = ("poses", "landmarks", "sensors", "wifi", "presses")
NUMBER_FILES = ("poses", "landmarks", "sensors")
ODD_SSIDS = (b"", b"a;b", b"; ; ", b'"quoted", name', b"o'clock, free", "Büro ☕ 東京".encode(), b" spaced ")
BROKEN_SSIDS = (b"caf\xe9", b"\xff\xfe\xfa", b"half \xe6\x9d")
GARBAGE = (b"#### restarted ####", b"1; 2; 3", b"1; ACC; x; y; z; 0; 0; 0; 0")
SPACING = 97
"""Lines between the faults of a file."""


def _decimal_comma(text: SessionText) -> SessionText:
    return _changed(text, NUMBER_FILES, lambda content: content.replace(b".", b","))


def _mixed_decimal_marks(text: SessionText) -> SessionText:
    """The second half of each file has the other mark."""
    return _changed(text, NUMBER_FILES, _swap_marks_in_second_half)


def _swap_marks_in_second_half(content: bytes) -> bytes:
    middle = content.find(b"\n", len(content) // 2) + 1
    return content[:middle] + content[middle:].translate(bytes.maketrans(b".,", b",."))


def _no_space_separator(text: SessionText) -> SessionText:
    return _changed(text, PHONE_FILES, lambda content: content.replace(b"; ", b";"))


def _odd_ssids(text: SessionText) -> SessionText:
    return _changed(text, ("wifi",), lambda content: _with_ssids(content, ODD_SSIDS))


def _broken_ssid_bytes(text: SessionText) -> SessionText:
    return _changed(text, ("wifi",), lambda content: _with_ssids(content, BROKEN_SSIDS))


def _with_ssids(content: bytes, ssids: Sequence[bytes]) -> bytes:
    rows = (line.split(b"; ") for line in content.splitlines())
    return _joined(b"; ".join((*row[:3], ssid, *row[4:])) for row, ssid in zip(rows, cycle(ssids), strict=False))


def _partial_last_line(text: SessionText) -> SessionText:
    """The landmark, sensor and Wi-Fi files end in the middle of a line."""
    return _changed(text, ("landmarks", "sensors", "wifi"), _cut_last_line)


def _cut_last_line(content: bytes) -> bytes:
    start = content.rfind(b"\n", 0, max(len(content) - 1, 0)) + 1
    return content[: (start + len(content)) // 2]


def _garbage_lines(text: SessionText) -> SessionText:
    return _changed(text, ("poses", "landmarks", "sensors", "wifi"), _with_garbage)


def _with_garbage(content: bytes) -> bytes:
    lines = content.splitlines()
    middle = len(lines) // 2
    return _joined((*lines[:middle], *GARBAGE, *lines[middle:]))


def _empty_file(text: SessionText) -> SessionText:
    return _changed(text, ("wifi",), lambda _: b"")


def _missing_file(text: SessionText) -> SessionText:
    return {role: content for role, content in text.items() if role != "wifi"}


def _duplicate_times(text: SessionText) -> SessionText:
    """Now and then a pose is logged twice."""
    return _changed(text, ("poses",), _with_repeated_lines)


def _duplicate_landmark_rows(text: SessionText) -> SessionText:
    return _changed(text, ("landmarks",), _with_repeated_lines)


def _with_repeated_lines(content: bytes) -> bytes:
    lines = content.splitlines()
    return _joined(copy for row, line in enumerate(lines) for copy in [line] * (2 if row % SPACING == 50 else 1))


def _backward_times(text: SessionText) -> SessionText:
    """Now and then two neighbouring poses are swapped."""
    return _changed(text, ("poses",), _with_swapped_lines)


def _with_swapped_lines(content: bytes) -> bytes:
    lines = content.splitlines()
    for row in range(50, len(lines) - 1, SPACING):
        lines[row], lines[row + 1] = lines[row + 1], lines[row]
    return _joined(lines)


def _landmark_rows_without_frame(text: SessionText) -> SessionText:
    """Now and then a pose is missing whose landmark rows are there."""
    return _changed(text, ("poses",), _without_some_lines)


def _without_some_lines(content: bytes) -> bytes:
    return _joined(line for row, line in enumerate(content.splitlines()) if row % SPACING != 50)


def _joined(lines: Iterable[bytes]) -> bytes:
    return b"".join(line + b"\n" for line in lines)


def _changed(text: SessionText, roles: Sequence[str], change: Callable[[bytes], bytes]) -> SessionText:
    return text | {role: change(text[role]) for role in roles if role in text}


TEXT_TRAPS: dict[str, Callable[[SessionText], SessionText]] = {
    "decimal_comma": _decimal_comma,
    "mixed_decimal_marks": _mixed_decimal_marks,
    "no_space_separator": _no_space_separator,
    "odd_ssids": _odd_ssids,
    "broken_ssid_bytes": _broken_ssid_bytes,
    "partial_last_line": _partial_last_line,
    "garbage_lines": _garbage_lines,
    "empty_file": _empty_file,
    "missing_file": _missing_file,
    "duplicate_times": _duplicate_times,
    "duplicate_landmark_rows": _duplicate_landmark_rows,
    "backward_times": _backward_times,
    "landmark_rows_without_frame": _landmark_rows_without_frame,
}
"""What each of these traps does to a session's files."""


SITE_TRAPS = {
    "missing_plan": "floorplan.jpg",
    "missing_dimensions": "floor_dimensions.csv",
    "missing_markers": "marker_dict.csv",
}
"""The site file that each of these traps leaves out."""


def check_traps(names: Iterable[str]) -> frozenset[str]:
    """Return the names as a set; raises UsageError for one that is no trap."""
    traps = frozenset(names)
    unknown = sorted(traps - TRAP_FINDINGS.keys())
    if unknown:
        raise UsageError(f"no such trap: {', '.join(unknown)}; known: {', '.join(TRAP_FINDINGS)}")
    return traps


def trap_tables(session: SimulatedSession, traps: frozenset[str]) -> SimulatedSession:
    """Put the chosen traps into a session's tables."""
    for name, change in TABLE_TRAPS.items():
        if name in traps:
            session = change(session)
    return session


def trap_text(text: SessionText, traps: frozenset[str]) -> SessionText:
    """Put the chosen traps into the text of a session's files."""
    for name, change in TEXT_TRAPS.items():
        if name in traps:
            text = change(text)
    return text


def left_out(path: str, traps: frozenset[str]) -> bool:
    """Tell whether a trap leaves out the site file at this path."""
    return any(path.endswith(name) for trap, name in SITE_TRAPS.items() if trap in traps)
