"""Positions for any time-stamped table, from the trajectories of labelled walks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import polars as pl

from vislam2tag.common.errors import UsageError, first_line
from vislam2tag.common.plain_files import read_bytes, read_json
from vislam2tag.common.table_files import read_csv, read_parquet
from vislam2tag.core.interpolation import label_by_interpolation
from vislam2tag.core.status import STATUS_LABELS, Status
from vislam2tag.core.tracks import Trajectory
from vislam2tag.dataset.fingerprinting.labelled import LabelledSession, open_labelled
from vislam2tag.labeling.clocks import Clock, Heard, TableTimes, offset_by_wifi, table_times, time_column
from vislam2tag.labeling.schemas import SCHEMAS, TRAJECTORY
from vislam2tag.labeling.settings import LabelSettings
from vislam2tag.labeling.tables import trajectory_of
from vislam2tag.sessions.phone.record import RECORD_FILE
from vislam2tag.survey.corrections import read_corrections
from vislam2tag.survey.discover import session_folders
from vislam2tag.survey.model import SessionKey
from vislam2tag.survey.site_table import decoded

ADDED = ("x_m", "y_m", "z_m", "floor", "sigma", "status")
_YEARS_NS = 10**18
"""30 years: what is further ahead of a phone's boot is no clock that counts from a boot."""
_SEPARATORS = (";", "\t", ",")
_PARQUET = (".parquet", ".pq")
_LEVELS = ("rssi_dbm", "rssi", "rss", "level", "dbm", "signal")


@dataclass(frozen=True)
class TableLabels:
    """A table with its positions, and how they came about."""

    table: pl.DataFrame
    """The rows and columns as they were, then :data:`ADDED`; metres in the BCS of the floor."""
    notes: tuple[str, ...]
    """What was taken for what, a sentence each."""
    counts: Mapping[str, int]
    """Rows by status."""


@dataclass(frozen=True)
class _Walk:
    session: LabelledSession
    trajectory: Trajectory
    start_ns: int
    end_ns: int
    offset_ns: int = 0
    """Of the table's clock, ahead of the walk's."""


def label(
    table: Path | str | pl.DataFrame,
    labels: Path | str,
    *,
    time_name: str | None = None,
    clock: Clock | str | None = None,
    unit: str | None = None,
    zone: str | None = None,
    offset_s: float | None = None,
    session: str | None = None,
    survey: Path | str | None = None,
) -> TableLabels:
    """Give each row of a time-stamped table the position of the walk that it was taken on.

    ``table`` is CSV, Parquet or a data frame; ``labels`` an output folder of ``process``. Column, clock (``boot``,
    ``unix``) and unit of its times are found unless given; ``zone`` is that of ISO 8601 times without one. The table's
    clock is ahead of the phone's boot clock by ``offset_s``, or, of Unix times, as the phone app's ``session.json`` in
    the raw ``survey`` says, or as access points show that both heard (columns ``bssid`` and a level). ``session``, a
    part of its slug, chooses walks where phones walked at the same time. Raises UsageError where anything of that is
    not clear, DatasetError where the folder holds no labels.
    """
    rows = table if isinstance(table, pl.DataFrame) else read_table(Path(table))
    if taken := [name for name in ADDED if name in rows.columns]:
        raise UsageError(f"the table has a column {' and '.join(taken)} already; rename it")
    walks = _walks(Path(labels), session)
    spans_ns = np.array([(walk.start_ns, walk.end_ns) for walk in walks], dtype=np.int64)
    ahead_ns = 0 if offset_s is None else round(offset_s * 1e9)
    times = table_times(
        rows[time_column(rows.columns, time_name)],
        spans_ns + (0 if ahead_ns > _YEARS_NS else ahead_ns),
        clock=None if clock is None else Clock(clock),
        unit=unit,
        zone=zone,
    )
    walks, why = _with_offsets(walks, times, rows, offset_s, None if survey is None else Path(survey))
    settings = LabelSettings.model_validate(open_labelled(Path(labels)).settings.get("labels", {}))
    made, counts = _labelled(rows, times, walks, settings.max_gap_s)
    return TableLabels(made, (times.interpretation, *why), counts)


def read_table(path: Path) -> pl.DataFrame:
    """Read a CSV file, all columns as text, or a Parquet file; raises UsageError where it cannot be read."""
    try:
        if path.suffix.lower() in _PARQUET:
            return read_parquet(path)
        text, _ = decoded(read_bytes(path))
        head = text.partition("\n")[0]
        separator = max(_SEPARATORS, key=head.count)
        return read_csv(text.encode(), separator=separator, infer_schema=False)
    except (OSError, pl.exceptions.PolarsError) as error:
        why = error.strerror if isinstance(error, OSError) and error.strerror else first_line(error)
        raise UsageError(f"{path}: cannot be read as CSV or Parquet ({why})") from error


def _walks(folder: Path, wanted: str | None) -> list[_Walk]:
    found = []
    for session in open_labelled(folder).sessions:
        if (wanted is None or wanted in session.slug) and session.has(TRAJECTORY):
            trajectory = trajectory_of(session.table(TRAJECTORY, SCHEMAS[TRAJECTORY]))
            frames_ns = trajectory.time_ns[trajectory.status != Status.INVALID]
            if len(frames_ns):
                found.append(_Walk(session, trajectory, int(frames_ns.min()), int(frames_ns.max())))
    if not found:
        chosen = "" if wanted is None else f" whose name holds '{wanted}'"
        raise UsageError(f"{folder}: holds no walk{chosen} with a trajectory")
    return found


def _with_offsets(
    walks: list[_Walk], times: TableTimes, rows: pl.DataFrame, offset_s: float | None, survey: Path | None
) -> tuple[list[_Walk], list[str]]:
    """Say how far the table's clock is ahead of each walk's; walks of which that is not known are left out."""
    if offset_s is not None or times.clock is Clock.BOOT:
        return [_shifted(walk, round((offset_s or 0.0) * 1e9)) for walk in walks], []
    notes: list[str] = []
    found: list[_Walk] = []
    heard, folders = _heard(rows, times), {} if survey is None else _folders(survey)
    for walk in walks:
        offset_ns = _by_recorder(folders, walk.session)
        how = "the recorder's own clocks (session.json)"
        if offset_ns is None and heard:
            offset_ns, how = offset_by_wifi(heard, _wifi_of(walk.session)), "access points that both heard"
        if offset_ns is not None:
            found.append(_shifted(walk, offset_ns))
            notes.append(f"{walk.session.slug}: the table's clock is {offset_ns / 1e9:.3f} s ahead of boot, by {how}")
    if not found:
        raise UsageError(
            "the table's times are Unix times, the walks' are since the phone's boot, and nothing tells how they "
            "relate: give --survey where the phone app recorded it, a column bssid with levels, or --offset-s, the "
            "seconds from one to the other"
        )
    return found, notes


def _shifted(walk: _Walk, offset_ns: int) -> _Walk:
    return replace(walk, offset_ns=offset_ns)


def _folders(survey: Path) -> dict[SessionKey, Path]:
    """Folders of a survey's sessions by the keys that labels have."""
    corrections = read_corrections(survey)
    return {corrections.true_key(key): folder for key, folder in session_folders(survey)[0]}


def _by_recorder(folders: Mapping[SessionKey, Path], session: LabelledSession) -> int | None:
    result = session.result()
    try:
        start = read_json(folders[SessionKey(result.floor, result.device, result.session)] / RECORD_FILE)["start"]
        return int(start["wall_ms"]) * 1_000_000 - int(start["boot_ns"])
    except (OSError, ValueError, KeyError, TypeError):
        return None


def _heard(rows: pl.DataFrame, times: TableTimes) -> Heard:
    """Times and levels of each access point in a table; empty where it has no such columns."""
    plain = {name.strip().lower(): name for name in rows.columns}
    level = next((plain[name] for name in _LEVELS if name in plain), None)
    if "bssid" not in plain or level is None:
        return {}
    numbers = rows[level].cast(pl.String).str.replace(",", ".", literal=True).cast(pl.Float64, strict=False)
    table = pl.DataFrame(
        {"bssid": rows[plain["bssid"]].cast(pl.String).str.to_lowercase(), "ns": times.time_ns, "dbm": numbers}
    ).filter(pl.Series(times.usable))
    return _by_bssid(table)


def _wifi_of(session: LabelledSession) -> Heard:
    table = session.table("wifi", ("bssid", "time_ns", "rssi_dbm"))
    return _by_bssid(
        table.select(pl.col("bssid").str.to_lowercase(), pl.col("time_ns").alias("ns"), pl.col("rssi_dbm").alias("dbm"))
    )


def _by_bssid(table: pl.DataFrame) -> Heard:
    parts = table.drop_nulls().sort("ns").partition_by("bssid", as_dict=True)
    return {
        str(key[0]): (part["ns"].to_numpy(), part["dbm"].cast(pl.Float64).to_numpy()) for key, part in parts.items()
    }


def _labelled(
    rows: pl.DataFrame, times: TableTimes, walks: list[_Walk], max_gap_s: float
) -> tuple[pl.DataFrame, dict[str, int]]:
    count = rows.height
    owner = np.full(count, -1)
    for index, walk in enumerate(walks):
        boot_ns = times.time_ns - walk.offset_ns
        inside = times.usable & (boot_ns >= walk.start_ns) & (boot_ns <= walk.end_ns)
        if (both := inside & (owner >= 0)).any():
            other = walks[int(owner[both][0])].session.slug
            raise UsageError(
                f"{int(both.sum())} rows were taken while {other} and {walk.session.slug} walked; say which phone "
                "the table is of by --session"
            )
        owner[inside] = index
    position, sigma = np.full((count, 3), np.nan), np.full(count, np.nan)
    status = np.where(times.usable, np.int8(Status.OUTSIDE_FRAMES), np.int8(Status.INVALID)).astype(np.int8)
    floor = np.full(count, np.nan)
    for index, walk in enumerate(walks):
        mine = np.flatnonzero(owner == index)
        found = label_by_interpolation(times.time_ns[mine] - walk.offset_ns, walk.trajectory, max_gap_s)
        position[mine], sigma[mine], status[mine] = found.position_bcs, found.sigma_m, found.status
        floor[mine] = found.floor if len(found.floor) else walk.session.result().floor
    names = pl.Series(STATUS_LABELS, dtype=pl.String)
    columns = [
        *(pl.Series(name, values, nan_to_null=True) for name, values in zip(ADDED, position.T, strict=False)),
        pl.Series("floor", floor, nan_to_null=True).cast(pl.Int32),
        pl.Series("sigma", sigma, nan_to_null=True),
        names.gather(status).rename("status"),
    ]
    made = rows.with_columns(columns)
    counts = made["status"].value_counts(sort=True)
    return made, dict(zip(counts["status"].to_list(), counts["count"].to_list(), strict=True))
