"""Scans of a recording as a phone or an app wrote it: a session folder, its zip, or a table of Wi-Fi readings."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import polars as pl

from vislam2tag.common.errors import DatasetError, SessionError, UsageError
from vislam2tag.common.files.folder import scratch_folder
from vislam2tag.common.files.given_files import read_bytes
from vislam2tag.common.findings import Finding
from vislam2tag.common.folder_kinds import kind_of
from vislam2tag.core.status import Status
from vislam2tag.datasets.fingerprints import grouped_readings, radio_rows
from vislam2tag.datasets.model import Grouping
from vislam2tag.datasets.settings import DatasetSettings
from vislam2tag.datasets.table_columns import access_point_columns
from vislam2tag.datasets.technologies import BLE, WIFI, parts_of
from vislam2tag.intake.foreign_table import SUFFIXES, read_foreign_table
from vislam2tag.intake.readings import admitted
from vislam2tag.positioning.model_files import ModelOrigin
from vislam2tag.positioning.radio_scans import scans_from_readings
from vislam2tag.positioning.scan_file import COLUMNS, ScanBlock
from vislam2tag.positioning.tracks import Tracks
from vislam2tag.sessions.companions import read_recording, unpacked
from vislam2tag.sessions.model import Session
from vislam2tag.sessions.registry import UNKNOWN_FORMAT, format_of, read_session
from vislam2tag.site.model import SessionKey, SessionRef, session_slugs

_PUBLISHED_LINE = re.compile(rb"[^;\n]*;[^;\n]*;\s*WLAN\s*;")
_FLOOR_FOLDER = re.compile(r"floor_(-?\d{1,6})")
_WIFI_FILE = "wifi.csv"
_TABLE = (
    f"Pass a Wi-Fi table with the columns {', '.join(COLUMNS)}, one with times, bssid and rssi, or a session folder"
)

_MELTED = (
    f"Make a table with the columns {', '.join(COLUMNS)} of it, in pandas: "
    'table.rename_axis("scan_id").melt(value_vars=ACCESS_POINTS, var_name="bssid", value_name="rssi_dbm", '
    'ignore_index=False).dropna().sort_index(kind="stable").to_csv("scans.csv"), without the level that means \'not '
    "heard'"
)


@dataclass(frozen=True)
class RecordedScans:
    """Scans of one walk, and the walk by its tracker."""

    block: ScanBlock
    track: Tracks | None
    """None if the recording has no poses."""
    findings: tuple[Finding, ...]


def recorded_scans(path: Path, origin: ModelOrigin, name: Callable[[str], str]) -> RecordedScans:
    """Read the scans of a recording, grouped as the fingerprints of the model; ``name`` gives the model's names.

    Raises DatasetError if it is not a recording, or has no readings of the model's technology.
    """
    try:
        tables, poses = _tables(path)
    except SessionError as error:
        if (points := _access_points(path)) is not None:
            raise DatasetError(
                f"{path}: is a wide table, with {len(points)} columns of access points such as {points[0]}; expected "
                f"a row for each reading. {_MELTED}"
            ) from error
        why = str(error).replace("; name it with --time-column", "")
        if path.is_file():
            place = _TABLE if format_of(path.parent) in (None, UNKNOWN_FORMAT) else f"Pass its session, {path.parent}"
            why = f"{path}: {why.removeprefix(f'{path}: ')}. {place}"
        raise DatasetError(why) from error
    wanted = parts_of(origin.technology)
    rows, findings = dict[str, pl.DataFrame](), list[Finding]()
    for technology in wanted:
        if technology in (WIFI, BLE) and technology in tables and tables[technology].height:
            raw = radio_rows(_unlabelled(tables[technology]), technology)
            rows[technology], odd = admitted(raw, "bssid", technology)
            findings += odd
    if wanted[0] not in rows:
        there = next((name for name in (WIFI, BLE) if name in tables and tables[name].height), "")
        cure = f"; for these, use a model of `vislam2tag train --technology {there}`" if there else ""
        raise DatasetError(
            f"{path}: has no readings of {wanted[0]}, which the model was trained on (readings of: {there or 'none'})"
            f"{cure}"
        )
    grouped, odd_groups = grouped_readings(rows, _settings(origin.technology, origin.grouping))
    session = _session_name(path)
    block = _block(grouped, session, name)
    return RecordedScans(block, None if poses is None else Tracks.of_walk(session, poses), (*findings, *odd_groups))


def _access_points(path: Path) -> list[str] | None:
    """The columns of access points of a wide table; None if it is none."""
    if not path.is_file() or path.suffix.lower() not in SUFFIXES:
        return None
    try:
        columns = read_foreign_table(path, only_head=True).columns
    except UsageError:
        return None
    points = access_point_columns(columns)
    return points if len(points) > 1 else None


def _session_name(path: Path) -> str:
    """Name of a recording: that in the labels of its survey, or its own."""
    own = path.resolve()
    folder = own if own.is_dir() else own.parent
    device, floor = folder.parent, folder.parent.parent
    if found := _FLOOR_FOLDER.fullmatch(floor.name):
        return session_slugs([SessionKey(int(found[1]), device.name, folder.name)])[0]
    return own.name if own.is_dir() else own.stem


def _tables(path: Path) -> tuple[dict[str, pl.DataFrame], pl.DataFrame | None]:
    """Tables of a recording, and its level track if it has poses."""
    if path.is_file() and (kept := _wifi_file(path)) is not None:
        return dict(kept.tables), None
    if not path.is_dir() and path.suffix.lower() != ".zip":
        return dict(read_recording(path, zone="UTC").tables), None
    with unpacked(path) as folder:
        assert folder is not None, path
        found = format_of(folder)
        if found is None or found == UNKNOWN_FORMAT:
            raise SessionError(f"{path}: not a data set, and not a recording of a known app{_inside(folder)}")
        session = _session(folder, found, path.stem)
    camera = session.camera
    used = camera.usable
    if not used.any():
        return dict(session.tables), None
    x, _, z = camera.position_acs[used].T
    return dict(session.tables), pl.DataFrame({"time_ns": camera.time_ns[used], "x": x, "y": -z})


def _inside(folder: Path) -> str:
    """What to pass instead of a folder of sessions or labels."""
    kind = kind_of(folder)
    if (folder / "trajectory").is_dir():
        return f". It is {kind}: run `vislam2tag dataset {folder} --out fingerprints` first"
    session = next((each for each in sorted(folder.glob("floor_*/*/*")) if each.is_dir()), None)
    if session is None:
        return f". It is {kind}" if kind else ""
    return f". It is a survey: pass one of its sessions, such as {session}"


def _wifi_file(path: Path) -> Session | None:
    """The session of only this file, if it is a Wi-Fi file of the published layout or of the phone app."""
    data = read_bytes(path)
    with scratch_folder() as scratch:
        folder = scratch.folder("recording").make()
        folder.write(_WIFI_FILE, data)
        found = format_of(folder.path)
        if found is None or found == UNKNOWN_FORMAT:
            return None
        if found == "published" and _PUBLISHED_LINE.match(data) is None:
            return None
        return _session(folder.path, found, path.stem)


def _session(folder: Path, found: str, name: str) -> Session:
    return read_session(SessionRef(SessionKey(0, "", name), folder, found, name))


def _unlabelled(table: pl.DataFrame) -> pl.DataFrame:
    status = pl.when(pl.col("repeated")).then(pl.lit(Status.DUPLICATE.label)).otherwise(pl.lit(Status.OK.label))
    return table.with_columns(status=status)


def _settings(technology: str, grouping: Grouping | None) -> DatasetSettings:
    """Settings with which the model's fingerprints were grouped."""
    if grouping is None or grouping.window_s is None:
        return DatasetSettings()
    if grouping.by == "scan" or technology == BLE:
        return DatasetSettings(ble_window_s=grouping.window_s)
    return DatasetSettings(wifi_window_s=grouping.window_s)


def _block(grouped: pl.DataFrame, session: str, name: Callable[[str], str]) -> ScanBlock:
    starts = grouped.filter("current").group_by("number").agg(start_ns=pl.col("time_ns").min())
    starts = starts.sort("start_ns", "number").with_row_index("scan_row")
    readings = grouped.join(starts, on="number", maintain_order="left")
    scans = scans_from_readings(
        readings["scan_row"].to_numpy().astype(np.int64),
        np.array([name(one) for one in readings["bssid"]], dtype=np.str_),
        readings["rssi_dbm"].to_numpy().astype(np.float64),
        starts.height,
        session=np.full(starts.height, session),
        time_ns=starts["start_ns"].to_numpy(),
    )
    return ScanBlock(starts["number"].cast(pl.String).to_numpy().astype(np.str_), scans)
