"""Traps of the raw layout: faults in a session's tables or in the text of its files, and missing site files."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from itertools import cycle
from typing import TypeAlias

import numpy as np

from vislam2tag.common.errors import UsageError
from vislam2tag.core.arrays import BoolArray, FloatArray
from vislam2tag.core.tracks import LandmarkLog
from vislam2tag.simulation.model import TrackerLog
from vislam2tag.simulation.phones import SimulatedSession
from vislam2tag.simulation.radio import WifiLog
from vislam2tag.simulation.raw_files import SessionText
from vislam2tag.simulation.settings import TRAP_FINDINGS

OTHER_BASE_NS = 1_640_000_000_000_000_000
"""Approximate wall clock (Unix time, end of 2021) minus boot clock, which some phones use for sensor time stamps."""
GAP_S = 3.0
LOST_S = 2.0
POSE_LAG_S = 0.3
SCANS_SKIPPED = 8
"""With throttling only one scan in this many remains, about one in half a minute."""
RAISED_M = 2.5
UNLISTED_ID = "9999"


_InTables: TypeAlias = Callable[[SimulatedSession], SimulatedSession]
_InText: TypeAlias = Callable[[bytes], bytes | None]
"""Turns a file into its faulty version; None: the file is missing."""


def _other_clock(session: SimulatedSession) -> SimulatedSession:
    return replace(session, imu=replace(session.imu, time_ns=session.imu.time_ns + OTHER_BASE_NS))


def _non_finite(session: SimulatedSession) -> SimulatedSession:
    """Give a few frames and sensor rows a value that is NaN or infinite."""
    position, values = session.tracker.position_acs.copy(), session.imu.values.copy()
    position[len(position) // 3 :: 400, 0] = np.nan
    values[100::5000, 0] = np.inf
    tracker = replace(session.tracker, position_acs=position)
    return replace(session, tracker=tracker, imu=replace(session.imu, values=values))


def _in_wifi(change: Callable[[WifiLog], WifiLog]) -> _InTables:
    return lambda session: replace(session, wifi=change(session.wifi))


def _stale_wifi(wifi: WifiLog) -> WifiLog:
    """Repeat every fifth row in the next scan."""
    again = np.flatnonzero(wifi.scan < wifi.scan.max(initial=0))[::5]
    source = np.concatenate((np.arange(len(wifi.scan)), again))
    scan = np.concatenate((wifi.scan, wifi.scan[again] + 1))
    order = np.argsort(scan, kind="stable")
    return replace(wifi.rows(source[order]), scan=scan[order])


def _scan_throttling(wifi: WifiLog) -> WifiLog:
    return wifi.rows(np.flatnonzero((wifi.scan - wifi.scan[:1]) % SCANS_SKIPPED == 0))


def _in_tracker(change: Callable[[TrackerLog], TrackerLog]) -> _InTables:
    return lambda session: replace(session, tracker=change(session.tracker))


def _in_landmarks(change: Callable[[LandmarkLog], LandmarkLog]) -> _InTables:
    return _in_tracker(lambda tracker: replace(tracker, landmarks=change(tracker.landmarks)))


def _tracking_lost(tracker: TrackerLog) -> TrackerLog:
    """Give all landmarks the camera's pose for a while in the middle of the walk."""
    log = tracker.landmarks
    since_s = _since_middle_s(tracker)[log.frame]
    lost = (since_s >= 0) & (since_s < LOST_S)
    gone = replace(
        log,
        position_acs=np.where(lost[:, None], tracker.position_acs[log.frame], log.position_acs),
        orientation_acs=np.where(lost[:, None], tracker.orientation_acs[log.frame], log.orientation_acs),
        lost=log.lost | lost,
    )
    return replace(tracker, landmarks=gone)


def _unknown_landmark(log: LandmarkLog) -> LandmarkLog:
    """Give the landmark seen last an id that is not in marker_dict.csv."""
    return replace(log, ids=(*log.ids[:-1], UNLISTED_ID))


def _high_landmark(log: LandmarkLog) -> LandmarkLog:
    """Move the landmark seen last far above the camera."""
    raised = (log.landmark == len(log.ids) - 1) & ~log.lost
    return replace(log, position_acs=log.position_acs + np.outer(raised, (0.0, RAISED_M, 0.0)))


def _few_landmarks(log: LandmarkLog) -> LandmarkLog:
    return log.rows_kept(log.landmark == 0)


def _frame_gap(tracker: TrackerLog) -> TrackerLog:
    since_s = _since_middle_s(tracker)
    return _frames_kept(tracker, (since_s < 0) | (since_s >= GAP_S))


def _since_middle_s(tracker: TrackerLog) -> FloatArray:
    """Seconds (f,) since the frame in the middle of the walk."""
    return np.asarray((tracker.time_ns - tracker.time_ns[len(tracker.time_ns) // 2]) / 1e9)


def _known_from_start(tracker: TrackerLog) -> TrackerLog:
    frames = np.arange(len(tracker.time_ns))
    first = int(np.argmax(np.isin(frames, tracker.landmarks.frame)))
    return _frames_kept(tracker, frames >= first)


def _frames_kept(tracker: TrackerLog, kept: BoolArray) -> TrackerLog:
    """Keep the frames of a mask (f,) and their landmark rows."""
    rows = tracker.landmarks.rows_kept(kept[tracker.landmarks.frame])
    return TrackerLog(
        time_ns=tracker.time_ns[kept],
        exposure_ns=tracker.exposure_ns[kept],
        position_acs=tracker.position_acs[kept],
        orientation_acs=tracker.orientation_acs[kept],
        landmarks=replace(rows, frame=(np.cumsum(kept) - 1)[rows.frame]),
        events=tracker.events,
    )


def _pose_lag(tracker: TrackerLog) -> TrackerLog:
    return replace(tracker, time_ns=tracker.time_ns + int(POSE_LAG_S * 1e9))


TABLE_TRAPS: dict[str, _InTables] = {
    "other_clock": _other_clock,
    "stale_wifi": _in_wifi(_stale_wifi),
    "scan_throttling": _in_wifi(_scan_throttling),
    "tracking_lost": _in_tracker(_tracking_lost),
    "unknown_landmark": _in_landmarks(_unknown_landmark),
    "high_landmark": _in_landmarks(_high_landmark),
    "few_landmarks": _in_landmarks(_few_landmarks),
    "frame_gap": _in_tracker(_frame_gap),
    "known_from_start": _in_tracker(_known_from_start),
    "pose_lag": _in_tracker(_pose_lag),
    "non_finite": _non_finite,
}
"""What each of these traps does to a session's tables."""

ODD_SSIDS = (b"", b"a;b", b"; ; ", b'"quoted", name', b"o'clock, free", "Büro ☕ 東京".encode(), b" spaced ")
BROKEN_SSIDS = (b"caf\xe9", b"\xff\xfe\xfa", b"half \xe6\x9d")
GARBAGE = (b"#### restarted ####", b"1; 2; 3", b"1; ACC; x; y; z; 0; 0; 0; 0")
SPACING = 97
"""Lines between the faults of a file."""


def _swap_marks_in_second_half(content: bytes) -> bytes:
    middle = content.find(b"\n", len(content) // 2) + 1
    return content[:middle] + content[middle:].translate(bytes.maketrans(b".,", b",."))


def _cut_last_line(content: bytes) -> bytes:
    """Cut the file in the middle of its last line."""
    start = content.rfind(b"\n", 0, max(len(content) - 1, 0)) + 1
    return content[: (start + len(content)) // 2]


def _in_lines(change: Callable[[list[bytes]], Iterable[bytes]]) -> _InText:
    return lambda content: b"".join(line + b"\n" for line in change(content.splitlines()))


def _with_ssids(ssids: Sequence[bytes]) -> _InText:
    def change(lines: list[bytes]) -> Iterator[bytes]:
        rows = (line.split(b"; ") for line in lines)
        return (b"; ".join((*row[:3], ssid, *row[4:])) for row, ssid in zip(rows, cycle(ssids), strict=False))

    return _in_lines(change)


def _with_garbage(lines: list[bytes]) -> list[bytes]:
    middle = len(lines) // 2
    return [*lines[:middle], *GARBAGE, *lines[middle:]]


def _with_some_repeated(lines: list[bytes]) -> Iterator[bytes]:
    return (copy for row, line in enumerate(lines) for copy in [line] * (2 if row % SPACING == 50 else 1))


def _with_some_swapped(lines: list[bytes]) -> list[bytes]:
    """Exchange some neighbouring lines."""
    for row in range(50, len(lines) - 1, SPACING):
        lines[row], lines[row + 1] = lines[row + 1], lines[row]
    return lines


def _without_some(lines: list[bytes]) -> Iterator[bytes]:
    return (line for row, line in enumerate(lines) if row % SPACING != 50)


_NUMBERS, _POSES, _WIFI = ("poses", "landmarks", "sensors"), ("poses",), ("wifi",)
TEXT_TRAPS: dict[str, tuple[tuple[str, ...], _InText]] = {
    "decimal_comma": (_NUMBERS, lambda content: content.replace(b".", b",")),
    "mixed_decimal_marks": (_NUMBERS, _swap_marks_in_second_half),
    "no_space_separator": ((*_NUMBERS, "wifi", "presses"), lambda content: content.replace(b"; ", b";")),
    "odd_ssids": (_WIFI, _with_ssids(ODD_SSIDS)),
    "broken_ssid_bytes": (_WIFI, _with_ssids(BROKEN_SSIDS)),
    "partial_last_line": (("landmarks", "sensors", "wifi"), _cut_last_line),
    "garbage_lines": ((*_NUMBERS, "wifi"), _in_lines(_with_garbage)),
    "empty_file": (_WIFI, lambda _: b""),
    "missing_file": (_WIFI, lambda _: None),
    "duplicate_times": (_POSES, _in_lines(_with_some_repeated)),
    "duplicate_landmark_rows": (("landmarks",), _in_lines(_with_some_repeated)),
    "backward_times": (_POSES, _in_lines(_with_some_swapped)),
    "landmark_rows_without_frame": (_POSES, _in_lines(_without_some)),
}
"""Which files, by role, each of these traps changes, and how."""

SITE_TRAPS = {
    "missing_plan": "floorplan.jpg",
    "missing_dimensions": "floor_dimensions.csv",
    "missing_markers": "marker_dict.csv",
}
"""The site file that each of these traps removes."""


def check_traps(names: Iterable[str]) -> frozenset[str]:
    """Return the names as a set; raises UsageError for an unknown trap."""
    traps = frozenset(names)
    unknown = sorted(traps - TRAP_FINDINGS.keys())
    if unknown:
        raise UsageError(f"no such trap: {', '.join(unknown)}; traps are: {', '.join(TRAP_FINDINGS)}")
    return traps


def trap_tables(session: SimulatedSession, traps: frozenset[str]) -> SimulatedSession:
    """Put the chosen traps into a session's tables."""
    for name, change in TABLE_TRAPS.items():
        if name in traps:
            session = change(session)
    return session


def trap_text(text: SessionText, traps: frozenset[str]) -> SessionText:
    """Put the chosen traps into the text of a session's files."""
    for name, (roles, change) in TEXT_TRAPS.items():
        if name in traps:
            changed = {role: change(content) if role in roles else content for role, content in text.items()}
            text = {role: content for role, content in changed.items() if content is not None}
    return text


def left_out(path: str, traps: frozenset[str]) -> bool:
    """Return whether a trap removes the site file at this path."""
    return any(path.endswith(name) for trap, name in SITE_TRAPS.items() if trap in traps)
