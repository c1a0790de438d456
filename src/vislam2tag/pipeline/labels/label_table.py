"""Positions for any time-stamped table, from the trajectories of labelled walks.

The table's clock is aligned with a walk's by motion or by signal levels that both recorded.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from os import PathLike
from pathlib import Path
from typing import ClassVar, TypedDict, Unpack

import numpy as np
import polars as pl

from vislam2tag.common.errors import UsageError
from vislam2tag.common.files.given_files import AnyPath, path_or_none, read_json
from vislam2tag.common.findings import Finding
from vislam2tag.common.given_tables import GivenTable, frame_of, times_in_text
from vislam2tag.common.tabular import TabularResult
from vislam2tag.core.arrays import BoolArray, IntArray
from vislam2tag.core.clocks import ClockAlignment
from vislam2tag.core.interpolation import label_by_interpolation
from vislam2tag.core.status import Status, counts_by_label
from vislam2tag.core.tracks import Trajectory
from vislam2tag.datasets.labelled import LabelledSession, open_labelled
from vislam2tag.intake.clock_ties import MIN_SPREAD, motion_mismatch
from vislam2tag.intake.foreign_table import read_foreign_table, table_of_frame
from vislam2tag.intake.time_units import HOUR_NS, OTHER_HOURS, Span, other_day, unix_span
from vislam2tag.labeling.settings import LabelSettings
from vislam2tag.labeling.tables import SCHEMAS, TRAJECTORY, status_text, trajectory_of, walked_within_sigma
from vislam2tag.pipeline.labels.table_clocks import (
    MEASURED,
    level_findings_of,
    motion_in,
    motion_of,
    sentence_of,
    table_aligners,
    with_findings,
)
from vislam2tag.sessions.clocks import agreement_by_motion, first_clear, unix_ahead_ns
from vislam2tag.sessions.foreign_tables import (
    MOST_NS,
    MOTION_COLUMNS,
    Clock,
    TableTimes,
    sensor_columns,
    table_times,
    time_column,
    time_findings,
    with_readings,
)
from vislam2tag.sessions.formats.phone import RECORD_FILE
from vislam2tag.site.corrections.file import read_corrections
from vislam2tag.site.discover import session_folders
from vislam2tag.site.model import SessionKey

ADDED = ("x_m", "y_m", "z_m", "floor", "sigma", "status")
_YEARS_NS = 10**18
"""30 years: times further after a phone's boot do not count from its boot."""


@dataclass(frozen=True, repr=False)
class TableLabels(TabularResult):
    """A table with its positions, and how they were assigned; ``to_pandas()`` returns the table for pandas."""

    main_table: ClassVar[str] = "table"

    table: pl.DataFrame
    """The original rows and columns, then :data:`ADDED`; metres in the BCS of the floor."""
    notes: tuple[str, ...]
    """Assumptions about columns and clocks, one sentence each."""
    counts: Mapping[str, int]
    """Rows by status."""

    def _facts(self) -> dict[str, object]:
        return {"rows": self.table.height, **self.counts}

    def _frames(self) -> dict[str, Callable[[], pl.DataFrame]]:
        return {self.main_table: lambda: self.table}


_SAME_CLOCK = ClockAlignment(0)


@dataclass(frozen=True)
class _Walk:
    session: LabelledSession
    trajectory: Trajectory
    start_ns: int
    end_ns: int
    clock: ClockAlignment = _SAME_CLOCK
    """The table's clock against the walk's."""

    @property
    def unix_span(self) -> Span | None:
        """First and last frame as Unix time, ns, if the table's clock is that; None if unknown."""
        return unix_span(np.array((self.start_ns, self.end_ns)), self.clock.offset_ns)


class TableTimesRead(TypedDict, total=False):
    """How to read the times of a table: column, clock (``boot``, ``unix``) and unit.

    ``zone`` is that of ISO 8601 times without one.
    """

    time_name: str | None
    clock: Clock | str | None
    unit: str | None
    zone: str | None


def label(
    table: AnyPath | GivenTable,
    labels: AnyPath,
    *,
    offset_s: float | None = None,
    align: str | None = None,
    session: str | None = None,
    survey: AnyPath | None = None,
    **read: Unpack[TableTimesRead],
) -> TableLabels:
    """Add to each row of a time-stamped table its position on the walk.

    ``table`` is CSV, Parquet or a table of Polars, pandas or Arrow; ``labels`` an output folder of ``process``.
    Column, clock and unit of its times are found unless given (:class:`TableTimesRead`). The offset of the table's
    clock from the phone's boot clock is ``offset_s`` or, for Unix times, comes from the phone app's
    ``session.json`` in the raw ``survey``. Otherwise, for Unix times or if no row is within a walk, the clocks are
    aligned by common turn rates or accelerations (columns such as ``gyro_x``, ``acc_x``), or by common access
    points. ``align`` (``motion``, ``levels``) requires one of these. ``session``, a part of its slug, chooses a
    walk if several phones walked at the same time.

    Raises UsageError, with figures, if the result is not clear, DatasetError if the folder does not contain labels.
    """
    if isinstance(table, str | PathLike):
        read_in = read_foreign_table(Path(table))
    else:
        read_in = table_of_frame(frame_of(table, "table"))
    rows, lines = read_in.rows, read_in.lines
    if taken := [name for name in ADDED if name in rows.columns]:
        raise UsageError(f"the table already has a column {' and '.join(taken)}; rename it")
    walks = _walks(Path(labels), session)
    spans_ns = np.array([(walk.start_ns, walk.end_ns) for walk in walks], dtype=np.int64)
    if offset_s is not None and not abs(offset_s) * 1e9 < MOST_NS:
        raise UsageError(f"--offset-s {offset_s:g}: the offset is too large; give it in seconds")
    ahead_ns = 0 if offset_s is None else round(offset_s * 1e9)
    spans_ns += 0 if ahead_ns > _YEARS_NS else ahead_ns
    alignable = align is not None or any(sensor_columns(rows.columns, sensor)[0] for sensor in MOTION_COLUMNS)
    times, odd = _times(rows, spans_ns, alignable, lines, **read)
    readable, unreadable = with_readings(rows.with_columns(lines), "")
    if offset_s is not None:
        walks, why = [replace(walk, clock=ClockAlignment(ahead_ns)) for walk in walks], list[str]()
    else:
        walks, why = _with_clocks(walks, times, readable, align, path_or_none(survey))
    why += _other_times(walks, times)
    why += map(sentence_of, (*odd, *unreadable, *level_findings_of(readable)))
    settings = LabelSettings.model_validate(open_labelled(Path(labels), follow_links=True).settings.get("labels", {}))
    made, counts = _labelled(rows, times, walks, settings.max_gap_s)
    return TableLabels(made, (times.interpretation, *read_in.notes, *why), counts)


def _times(
    rows: pl.DataFrame,
    spans_ns: IntArray,
    aligned: bool,
    lines: pl.Series,
    time_name: str | None = None,
    clock: Clock | str | None = None,
    unit: str | None = None,
    zone: str | None = None,
) -> tuple[TableTimes, list[Finding]]:
    column = times_in_text(rows[time_column(rows.columns, time_name)])
    known = None if clock is None else Clock(clock)
    times = table_times(column, spans_ns, clock=known, unit=unit, zone=zone, aligned=aligned, lines=lines)
    return times, time_findings(column, times, "", lines)


def _walks(folder: Path, wanted: str | None) -> list[_Walk]:
    found = []
    for session in open_labelled(folder, follow_links=True).sessions:
        if (wanted is None or wanted in session.slug) and session.has(TRAJECTORY):
            trajectory = trajectory_of(session.table(TRAJECTORY, SCHEMAS[TRAJECTORY]))
            frames_ns = trajectory.time_ns[trajectory.status != Status.INVALID]
            if len(frames_ns):
                found.append(_Walk(session, trajectory, int(frames_ns.min()), int(frames_ns.max())))
    if not found:
        chosen = "" if wanted is None else f" with '{wanted}' in its name"
        raise UsageError(f"{folder}: the folder has no walk{chosen} with a trajectory")
    return found


def _with_clocks(
    walks: list[_Walk], times: TableTimes, rows: pl.DataFrame, align: str | None, survey: Path | None
) -> tuple[list[_Walk], list[str]]:
    """Relate the table's clock to each walk's; walks with an unknown relation are skipped."""
    if align is None and times.clock is Clock.BOOT and any(_inside(walk, times).any() for walk in walks):
        return walks, [sentence_of(each) for walk in walks for each in _other_motion(walk, times, rows)]
    notes: list[str] = []
    found: list[_Walk] = []
    refused: list[str] = []
    aligners = table_aligners(rows, times, align)
    folders = {} if survey is None or align is not None else _folders(survey)
    for walk in walks:
        clock, how = _by_recorder(folders, walk.session), "the recorder's own clocks (session.json)"
        if clock is None:
            tried = {name: partial(aligned, walk.session) for name, aligned in aligners.items()}
            how, clock, why = first_clear(tried, partial(_matched, walk, times))
            refused += (f"{walk.session.slug}: {each}" for each in why)
        if clock is not None and clock.offset_ns is not None:
            found.append(replace(walk, clock=clock))
            notes.append(f"{walk.session.slug}: the table's clock is {_words(clock)} ahead of boot, according to {how}")
    if not found:
        raise UsageError(with_findings(_nothing_tells(times, refused, align), rows))
    return found, notes


def _other_motion(walk: _Walk, times: TableTimes, rows: pl.DataFrame) -> list[Finding]:
    """Report rows that are within a walk by their times, but not by their motion: by the first sensor that shows it."""
    inside = _inside(walk, times)
    within = replace(times, usable=inside)
    for sensor, theirs in motion_in(rows, within).items():
        agreement = agreement_by_motion(*theirs, *motion_of(walk.session, sensor), MIN_SPREAD[sensor])
        if agreement is not None:
            return motion_mismatch(agreement, MEASURED[sensor], walk.session.slug, int(inside.sum()))
    return []


def _matched(walk: _Walk, times: TableTimes, clock: ClockAlignment) -> float:
    """Share of the table, or of a shorter walk, that is within the time of the other."""
    ours = clock.ours(times.time_ns[times.usable])
    first, last = int(ours.min()), int(ours.max())
    shorter_ns = min(last - first, walk.end_ns - walk.start_ns)
    return (min(last, walk.end_ns) - max(first, walk.start_ns)) / max(shorter_ns, 1)


def _words(clock: ClockAlignment) -> str:
    offset = f"{(clock.offset_ns or 0) / 1e9:.3f} s"
    if not clock.figures:
        return offset
    rate = f", gaining {1e6 * clock.rate:.0f} us per second," if clock.rate else ""
    return f"{offset} (+- {clock.sigma_s:.3f} s; {clock.figures}){rate}"


def _nothing_tells(times: TableTimes, refused: list[str], wanted: str | None) -> str:
    what = "Unix times" if times.clock is Clock.UNIX else "not within any walk"
    why = f" ({'; '.join(refused)})" if refused else ""
    if wanted is not None:
        return (
            f"--by {wanted}: the offset of the table's clock is not clear{why}. Use --survey or another method, or "
            "give the offset in seconds with --offset-s"
        )
    return (
        f"the table's times are {what}, those of walks count from the phone's boot, and their offset is unknown{why}. "
        "Use --survey if the phone app recorded it, add columns of a gyroscope or accelerometer (gyro_x, gyro_y, "
        "gyro_z) or a column bssid with levels to the table, or give the offset in seconds with --offset-s"
    )


def _folders(survey: Path) -> dict[SessionKey, Path]:
    """Folders of a survey's sessions by the keys that labels have."""
    corrections = read_corrections(survey)
    return {corrections.true_key(key): folder for key, folder in session_folders(survey)[0]}


def _by_recorder(folders: Mapping[SessionKey, Path], session: LabelledSession) -> ClockAlignment | None:
    result = session.result()
    try:
        record = read_json(folders[SessionKey(result.floor, result.device, result.session)] / RECORD_FILE)
        ahead_ns = unix_ahead_ns(record["start"])
    except (OSError, ValueError, KeyError, TypeError):
        return None
    return None if ahead_ns is None else ClockAlignment(ahead_ns)


def _inside(walk: _Walk, times: TableTimes) -> BoolArray:
    """(n,) rows of the table that were taken on a walk."""
    boot_ns = walk.clock.ours(times.time_ns)
    return times.usable & (boot_ns >= walk.start_ns) & (boot_ns <= walk.end_ns)


def _other_times(walks: list[_Walk], times: TableTimes) -> list[str]:
    """Say why no row is within a walk, if its clock is known: another day, or a clock that differs by hours."""
    if times.clock is not Clock.UNIX or any(_inside(walk, times).any() for walk in walks):
        return []
    for hours in OTHER_HOURS:
        moved = replace(times, time_ns=times.time_ns + hours * HOUR_NS)
        inside = sum(int(_inside(walk, moved).sum()) for walk in walks)
        if 2 * inside > times.usable.sum():
            return [
                f"no row is within a walk, but {inside} would be if the table's clock were {abs(hours)} h "
                f"{'later' if hours > 0 else 'earlier'}, as with daylight saving or another time zone; correct --zone "
                "or --offset-s"
            ]
    theirs = unix_span(times.time_ns[times.usable], None)
    closest = min(walks, key=lambda walk: abs(walk.clock.ours(times.time_ns[times.usable]) - walk.start_ns).min())
    day = other_day("the table", theirs, f"the walk {closest.session.slug}", closest.unix_span)
    return [] if day is None else [f"no row is within a walk: {day}"]


def _labelled(
    rows: pl.DataFrame, times: TableTimes, walks: list[_Walk], max_gap_s: float
) -> tuple[pl.DataFrame, dict[str, int]]:
    count = rows.height
    owner = np.full(count, -1)
    for index, walk in enumerate(walks):
        inside = _inside(walk, times)
        if (both := inside & (owner >= 0)).any():
            other = walks[int(owner[both][0])].session.slug
            raise UsageError(
                f"{int(both.sum())} rows are within both {other} and {walk.session.slug}; choose the walk of the "
                "table with --session"
            )
        owner[inside] = index
    position, sigma = np.full((count, 3), np.nan), np.full(count, np.nan)
    status = np.where(times.usable, np.int8(Status.OUTSIDE_FRAMES), np.int8(Status.INVALID)).astype(np.int8)
    floor = np.full(count, np.nan)
    for index, walk in enumerate(walks):
        mine = np.flatnonzero(owner == index)
        boot_ns = walk.clock.ours(times.time_ns[mine])
        found = label_by_interpolation(boot_ns, walk.trajectory, max_gap_s)
        position[mine], status[mine] = found.position_bcs, found.status
        walked_m = walked_within_sigma(boot_ns, walk.trajectory, max_gap_s, walk.clock.sigma_s)
        sigma[mine] = np.hypot(found.sigma_m, walked_m)
        floor[mine] = found.floor if len(found.floor) else walk.session.result().floor
    columns = [
        *(pl.Series(name, values, nan_to_null=True) for name, values in zip(ADDED, position.T, strict=False)),
        pl.Series("floor", floor, nan_to_null=True).cast(pl.Int32),
        pl.Series("sigma", sigma, nan_to_null=True),
        status_text(status),
    ]
    return rows.with_columns(columns), counts_by_label(status)
