"""``corrections.toml`` applied to a session that has been read, and to the taps of one without tracker."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import polars as pl

from vislam2tag.common.findings import Finding
from vislam2tag.core.arrays import IntArray
from vislam2tag.core.context import FixLog
from vislam2tag.core.status import Status
from vislam2tag.core.tracks import LandmarkLog
from vislam2tag.sessions.clocks import clock_mismatch, pose_lag_of
from vislam2tag.sessions.model import Session, too_few_fixes
from vislam2tag.sessions.readings import pressure_log, repeated_scans
from vislam2tag.sessions.without_poses import without_tracker
from vislam2tag.site.corrections.file import (
    CORRECTIONS_FILE,
    Corrections,
    DropRepeatedScans,
    ExcludeLandmark,
    ExcludeSpan,
    RenameLandmark,
    SetLandmarkFloor,
    SetTap,
    ShiftClock,
    SwapLandmarks,
)

_NS = 1_000_000_000
_LONGEST_S = 1e9
"""No session lasts longer; keeps sums within int64."""


def corrected_session(session: Session, corrections: Corrections) -> tuple[Session, tuple[str, ...]]:
    """Apply the corrections that concern a session, and give one sentence for each use.

    In this order: clocks are shifted, repeated scans marked, landmark ids swapped, then renamed, then assigned to other
    floors, landmarks excluded (by their corrected id), time spans excluded. Excluded frames become INVALID and lose
    their landmark rows.
    """
    entries = corrections.for_session(session.key)
    uses: list[str] = []
    for shift in entries.shift_clock:
        session = _shifted(session, shift, uses)
    if entries.drop_repeated_scans:
        session = _without_repeated_scans(session, entries.drop_repeated_scans[0], uses)
    for swap in entries.swap_landmarks:
        session = replace(session, landmarks=_swapped(session.landmarks, swap, uses))
    for rename in entries.rename_landmark:
        session = replace(session, landmarks=_renamed(session, rename, rename.to, uses))
    for other in entries.set_landmark_floor:
        session = replace(session, landmarks=_renamed(session, other, other.name, uses))
    for landmark in entries.exclude_landmark:
        session = replace(session, landmarks=_without(session.landmarks, landmark, uses))
    usable_ns = session.camera.time_ns[session.camera.usable]
    for span in entries.exclude_span if len(usable_ns) else ():
        session = _without_span(session, span, int(usable_ns[0]), uses)
    return (_with_clocks_judged_again(session) if entries.shift_clock else session), tuple(uses)


def _shifted(session: Session, entry: ShiftClock, uses: list[str]) -> Session:
    offset_ns = round(entry.offset_s * _NS)
    time_ns = _times_of(session, entry.table)
    if len(time_ns) == 0:
        return session
    uses.append(f"The clock of {entry.table} is shifted by {entry.offset_s:+g} s{entry.because()}.")
    shifted_ns = _add(time_ns, offset_ns)
    if entry.table == "camera":
        return replace(session, camera=replace(session.camera, time_ns=shifted_ns))
    if entry.table == "presses":
        return replace(session, presses_ns=shifted_ns)
    table = session.tables[entry.table].with_columns(pl.Series("time_ns", shifted_ns))
    tables = {**session.tables, entry.table: table}
    if entry.table != "sensors" or session.camera.pressure is None:
        return replace(session, tables=tables)
    return replace(session, tables=tables, camera=replace(session.camera, pressure=pressure_log(table)))


def _times_of(session: Session, table: str) -> IntArray:
    """Times (k,) of a table by its name in ``corrections.toml``, ns; none where it is missing."""
    if table == "camera":
        return session.camera.time_ns
    if table == "presses":
        return session.presses_ns
    if table not in session.tables:
        return np.empty(0, dtype=np.int64)
    return session.tables[table]["time_ns"].to_numpy()


def _add(time_ns: IntArray, offset_ns: int) -> IntArray:
    """Shift times (k,), ns, staying within int64."""
    limits = np.iinfo(np.int64)
    low, high = limits.min - min(offset_ns, 0), limits.max - max(offset_ns, 0)
    shifted: IntArray = np.clip(time_ns, low, high) + offset_ns
    return shifted


def _with_clocks_judged_again(session: Session) -> Session:
    findings = [finding for finding in session.findings if finding.kind != "clock_mismatch"]
    times = {name: table["time_ns"].to_numpy() for name, table in session.tables.items()}
    times["presses"] = session.presses_ns
    for record in session.files:
        if record.role in times:
            findings += clock_mismatch(times[record.role], record.name, session.camera)
    session = replace(session, findings=tuple(findings))
    if "sensors" not in session.tables:
        return session
    lag_s = pose_lag_of(session.camera, session.tables["sensors"])
    unchanged = lag_s == session.camera.pose_lag_s
    return session if unchanged else replace(session, camera=replace(session.camera, pose_lag_s=lag_s))


def _swapped(log: LandmarkLog, entry: SwapLandmarks, uses: list[str]) -> LandmarkLog:
    first, second = entry.ids
    if first not in log.ids and second not in log.ids:
        return log
    uses.append(f"Landmarks {first} and {second} are interchanged{entry.because()}.")
    other = {first: second, second: first}
    return replace(log, ids=tuple(other.get(landmark, landmark) for landmark in log.ids))


def _renamed(session: Session, entry: RenameLandmark | SetLandmarkFloor, to: str, uses: list[str]) -> LandmarkLog:
    """Give the rows of a landmark within the span to another one."""
    log, camera = session.landmarks, session.camera
    usable_ns = camera.time_ns[camera.usable]
    if entry.id not in log.ids or len(usable_ns) == 0:
        return log
    first_ns, end_ns = _span_ns(entry, int(usable_ns[0]))
    at_ns = camera.time_ns[log.frame]
    chosen = (log.landmark == log.ids.index(entry.id)) & (at_ns >= first_ns) & (at_ns < end_ns)
    if not chosen.any():
        return log
    uses.append(f"{int(chosen.sum())} rows of landmark {entry.id} are assigned to {to}{entry.because()}.")
    ids = log.ids if to in log.ids else (*log.ids, to)
    landmark = np.where(chosen, ids.index(to), log.landmark)
    order = np.lexsort((log.frame, landmark))
    same = (np.diff(landmark[order]) == 0) & (np.diff(log.frame[order]) == 0)
    order = order[np.concatenate(([True], ~same))]  # one row of a landmark in a frame
    return LandmarkLog(
        ids=ids,
        landmark=landmark[order],
        frame=log.frame[order],
        position_acs=log.position_acs[order],
        orientation_acs=log.orientation_acs[order],
        lost=log.lost[order],
        row=log.row[order] if len(log.row) else log.row,
        seen=None if log.seen is None else log.seen[order],
    ).rows_kept(np.ones(len(order), dtype=bool))


def _without_repeated_scans(session: Session, entry: DropRepeatedScans, uses: list[str]) -> Session:
    """Mark all rows of scans that repeat the one before as readings that were given already."""
    wifi = session.tables.get("wifi")
    if wifi is None or wifi.is_empty():
        return session
    again = repeated_scans(wifi)
    if not again:
        return session
    uses.append(f"{len(again)} Wi-Fi scans that repeat the one before are counted once{entry.because()}.")
    marked = wifi.with_columns((pl.col("repeated") | pl.col("scan").is_in(again)).alias("repeated"))
    return replace(session, tables={**session.tables, "wifi": marked})


def _without(log: LandmarkLog, entry: ExcludeLandmark, uses: list[str]) -> LandmarkLog:
    if entry.id not in log.ids:
        return log
    uses.append(f"Landmark {entry.id} is excluded{entry.because()}.")
    return log.select([i for i, landmark in enumerate(log.ids) if landmark != entry.id])


def _without_span(session: Session, entry: ExcludeSpan, start_ns: int, uses: list[str]) -> Session:
    """Make the span's frames INVALID and remember the span, so that its readings become invalid too."""
    first_ns, end_ns = _span_ns(entry, start_ns)
    camera = session.camera
    inside = (camera.time_ns >= first_ns) & (camera.time_ns < end_ns)
    if not inside.any():
        return replace(session, findings=(*session.findings, _outside(session, entry))) if entry.session else session
    frames = int(inside.sum())
    uses.append(f"frames excluded from {entry.from_s:g} s to {entry.to_s:g} s: {frames}{entry.because()}.")
    status = np.where(inside & camera.usable, np.int8(Status.INVALID), camera.status).astype(np.int8)
    keep = ~inside[session.landmarks.frame]
    return replace(
        session,
        camera=replace(camera, status=status),
        landmarks=session.landmarks.rows_kept(keep),
        excluded_ns=(*session.excluded_ns, (first_ns, end_ns)),
    )


def _outside(session: Session, entry: ExcludeSpan) -> Finding:
    usable_ns = session.camera.time_ns[session.camera.usable]
    message = (
        f"[[exclude_span]] from {entry.from_s:g} s has no effect: the session's frames are from 0 to "
        f"{(usable_ns[-1] - usable_ns[0]) / _NS:.1f} s; write seconds since its first frame"
    )
    return Finding(kind="unused_correction", file=CORRECTIONS_FILE, count=1, message=message)


def _span_ns(entry: ExcludeSpan | RenameLandmark | SetLandmarkFloor, start_ns: int) -> tuple[int, int]:
    """From and to when an entry applies, boot-clock ns, given the session's first usable frame."""
    return start_ns + _nanoseconds(entry.from_s), start_ns + _nanoseconds(entry.to_s)


def _nanoseconds(seconds: float) -> int:
    """Whole nanoseconds, an infinite time as one that no clock reaches."""
    return round(min(max(seconds, -_LONGEST_S), _LONGEST_S) * _NS)


SAME_TAP_S = 0.25
"""An entry means the tap within this of its moment: no one taps two places so quickly."""
_NO_FIXES = FixLog(np.empty(0, dtype=np.int64), np.empty((0, 2)), ())


def with_taps_corrected(session: Session, entries: Sequence[SetTap]) -> tuple[Session, tuple[str, ...]]:
    """Apply entries to a session's fixes, and give one sentence for each use.

    One entry after the other: each moves the tap of its moment, takes it out, or places one where none is. A session
    with poses uses them where a plan places it; one without poses and fixes is walked by dead reckoning from then on.
    """
    if not entries:
        return session, ()
    if not session.camera.tracked and not session.camera.without_poses:
        begun = without_tracker(session, _NO_FIXES)
        if begun is None:
            return session, ()
        session = begun
    fixes, uses = session.camera.fixes or _NO_FIXES, list[str]()
    for entry in entries:
        fixes = _with_tap(fixes, entry, int(session.camera.time_ns[0]), uses)
    if session.camera.tracked:
        return replace(session, camera=replace(session.camera, fixes=fixes)), tuple(uses)
    return _with_fixes_judged_again(session, fixes), tuple(uses)


def _with_tap(fixes: FixLog, entry: SetTap, start_ns: int, uses: list[str]) -> FixLog:
    at_ns = start_ns + round(entry.at_s * 1e9)
    away_ns = np.abs(fixes.time_ns - at_ns)
    place = int(away_ns.argmin()) if len(away_ns) and away_ns.min() <= SAME_TAP_S * 1e9 else None
    kept = np.arange(len(fixes.time_ns)) != place
    times, positions = fixes.time_ns[kept], fixes.position_bcs[kept]
    names = tuple(name for name, stays in zip(fixes.name, kept.tolist(), strict=True) if stays)
    sigma_m = None if fixes.sigma_m is None else fixes.sigma_m[kept]
    if entry.x is None or entry.y is None:
        if place is not None:
            uses.append(f"The tap at {entry.at_s:g} s is excluded{entry.because()}.")
        return FixLog(times, positions, names, sigma_m)
    uses.append(f"The walk is placed at ({entry.x:g}, {entry.y:g}) at {entry.at_s:g} s{entry.because()}.")
    time_ns = at_ns if place is None else int(fixes.time_ns[place])
    row = int(np.searchsorted(times, time_ns))
    return FixLog(
        np.insert(times, row, time_ns),
        np.insert(positions, row, (entry.x, entry.y), axis=0),
        (*names[:row], f"tap at {entry.at_s:g} s", *names[row:]),
        None if sigma_m is None else np.insert(sigma_m, row, np.nan),
    )


def _with_fixes_judged_again(session: Session, fixes: FixLog) -> Session:
    findings = [each for each in session.findings if each.kind != "too_few_fixes"]
    if len(fixes.time_ns) < 2:
        findings.append(too_few_fixes(CORRECTIONS_FILE, "taps on the plan"))
    return replace(session, camera=replace(session.camera, fixes=fixes), findings=tuple(findings))
