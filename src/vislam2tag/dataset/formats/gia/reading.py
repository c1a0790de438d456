"""Reading giaIndoorLoc's labelled layout: ``floor_K/DEVICE/SESSION/wifi_annotated.csv`` (Laska et al., IPIN 2022)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import polars as pl

from vislam2tag import __version__
from vislam2tag.common.errors import DatasetError
from vislam2tag.common.files.archives import folder_of, names_in
from vislam2tag.common.files.folder import Folder
from vislam2tag.common.files.table_files import scan_parquet, write_parquet
from vislam2tag.common.findings import Finding, pooled
from vislam2tag.dataset.fingerprinting.fingerprints import SessionWalk, fingerprints_of
from vislam2tag.dataset.fingerprinting.magnetic import magnetic_windows
from vislam2tag.dataset.fingerprinting.motion import PhoneMotion
from vislam2tag.dataset.folder import sha256_of
from vislam2tag.dataset.format_registry import ImportContext, ImportFormat
from vislam2tag.dataset.formats.gia.annotated_tables import SENSORS_FILE, WIFI_FILE, sensor_rows, wifi_rows
from vislam2tag.dataset.model import Dataset, DatasetInfo, DatasetSource, FloorInfo, Grouping
from vislam2tag.dataset.schema import ACCESS_POINTS, FINGERPRINTS, MAGNETIC, READINGS, SCHEMAS, SESSIONS, in_schema
from vislam2tag.dataset.settings import DatasetSettings
from vislam2tag.dataset.transmitters.access_points import access_point_table
from vislam2tag.intake.readings import admitted
from vislam2tag.labeling.schemas import SCHEMAS as LABELLED
from vislam2tag.labeling.schemas import TRAJECTORY
from vislam2tag.survey.corrections.file import session_start
from vislam2tag.survey.discover import read_site, session_folders
from vislam2tag.survey.model import SessionKey
from vislam2tag.survey.names import session_slugs
from vislam2tag.survey.plans.load import plan_file

TECHNOLOGY = "wifi"
_NAMES = "names"
_SITE_KINDS = ("missing_file", "missing_plan")
"""The published data need no landmarks, and a plan only for pictures."""


@dataclass(frozen=True)
class _AnnotatedSession:
    key: SessionKey
    slug: str
    wifi: Path
    sensors: Path
    """May be missing."""


def recognises(path: Path) -> bool:
    """Whether there is an annotated Wi-Fi table."""
    return any(name.name == WIFI_FILE for name in names_in(path))


def read(path: Path, context: ImportContext) -> Dataset:
    """Read every session's Wi-Fi readings and group them by scan, one session in memory at a time.

    Raises DatasetError where a table has other columns or a number is none.
    """
    root = _root(path, folder_of(path, context.scratch, context.most_unpacked))
    sessions = _sessions(path, root)
    findings: list[Finding] = []
    settings = DatasetSettings()
    for number, session in enumerate(sessions):
        parts, odd = _parts(session, settings)
        findings += odd
        for name, table in parts.items():
            write_parquet(table, context.scratch, f"{name}/{number:06d}.parquet")
        context.progress(session.slug, len(sessions))
    tables = {name: _scanned(context.scratch / name) for name in SCHEMAS if (context.scratch / name).is_dir()}
    names = _scanned(context.scratch / _NAMES).collect(engine="streaming")
    heard = access_point_table(tables[FINGERPRINTS], tables[READINGS], names)
    floors, plans, about_site = _site(root, context.scratch.folder("plans"))
    info = DatasetInfo(
        name=path.stem,
        floors=floors,
        groupings=(Grouping(technology=TECHNOLOGY, by="scan"),),
        sources=(
            DatasetSource(
                kind="gia",
                name=path.name,
                version=__version__,
                inputs={
                    file.relative_to(root).as_posix(): sha256_of(file)
                    for session in sessions
                    for file in (session.wifi, session.sensors)
                    if file.is_file()
                },
            ),
        ),
        findings=(*about_site, *pooled(findings)),
    )
    return Dataset(info, {**tables, ACCESS_POINTS: heard.lazy()}, files=plans)


def _root(path: Path, folder: Path) -> Path:
    """The folder that holds the floors: an archive may have it inside another."""
    found = sorted(folder.rglob(WIFI_FILE))
    if not found:
        raise DatasetError(f"{path}: holds no floor_K/DEVICE/SESSION/{WIFI_FILE}")
    if len(found[0].relative_to(folder).parts) < 4:
        raise DatasetError(f"{found[0]}: lies not in a folder floor_K/DEVICE/SESSION, which says where it is from")
    return found[0].parents[3]


def _sessions(path: Path, root: Path) -> list[_AnnotatedSession]:
    folders, _ = session_folders(root)
    found = [(key, folder) for key, folder in folders if (folder / WIFI_FILE).is_file()]
    if not found:
        raise DatasetError(f"{path}: holds no floor_K/DEVICE/SESSION/{WIFI_FILE}")
    slugs = session_slugs([key for key, _ in found])
    sessions = [
        _AnnotatedSession(key, slug, folder / WIFI_FILE, folder / SENSORS_FILE)
        for (key, folder), slug in zip(found, slugs, strict=True)
    ]
    return sorted(sessions, key=lambda session: session.slug)


def _parts(
    session: _AnnotatedSession, settings: DatasetSettings
) -> tuple[dict[str, pl.DataFrame], tuple[Finding, ...]]:
    """Make one session's rows of each table; headings and speeds come from a trajectory, which the layout lacks."""
    rows, odd = admitted(wifi_rows(session.wifi, session.key), "bssid", WIFI_FILE)
    nowhere = pl.DataFrame(schema=LABELLED[TRAJECTORY])
    walk = SessionWalk(session.slug, "", session.key.device, session.key.session, PhoneMotion.of(nowhere))
    made = fingerprints_of(rows, TECHNOLOGY, walk, settings, math.inf)
    tables = {
        FINGERPRINTS: made.fingerprints,
        READINGS: made.readings,
        _NAMES: made.names,
        SESSIONS: _session_row(session, made.fingerprints),
    }
    if session.sensors.is_file():
        sensors = sensor_rows(session.sensors, session.key)
        magnetic = magnetic_windows(sensors, session.slug, "", settings.magnetic_window_s)
        tables |= {MAGNETIC: magnetic} if len(magnetic) else {}
    return tables, (*odd, *made.findings)


def _session_row(session: _AnnotatedSession, fingerprints: pl.DataFrame) -> pl.DataFrame:
    start, end = fingerprints["start_ns"].min(), fingerprints["end_ns"].max()
    row = {
        "session": session.slug,
        "building": "",
        "floor": session.key.floor,
        "device": session.key.device,
        "name": session.key.session,
        "started": session_start(session.key.session),
        "duration_s": (end - start) / 1e9 if isinstance(start, int) and isinstance(end, int) else 0.0,
        "fingerprints": fingerprints.height,
        "source": sha256_of(session.wifi),
    }
    return in_schema(SESSIONS, pl.DataFrame([row]))


def _scanned(folder: Path) -> pl.LazyFrame:
    table = scan_parquet(sorted(folder.glob("*.parquet")))
    return table.select(*SCHEMAS[folder.name]) if folder.name in SCHEMAS else table


def _site(root: Path, scratch: Folder) -> tuple[tuple[FloorInfo, ...], dict[str, Path], tuple[Finding, ...]]:
    """Floors with their extents and plans, where the layout's site files are beside."""
    site, findings = read_site(root)
    floors, plans = [], {}
    for floor in site.floors:
        drawn = plan_file(floor, scratch)
        plan = f"plans/floor_{floor.number}{drawn.suffix}" if drawn else None
        if plan and drawn:
            plans[plan] = drawn
        floors.append(
            FloorInfo(
                number=floor.number,
                name=floor.name,
                elevation_m=floor.elevation_m,
                width_m=floor.width_m,
                height_m=floor.height_m,
                plan=plan,
                lower_left_m=floor.lower_left_m,
                georeference=floor.georeference,
            )
        )
    return tuple(floors), plans, tuple(finding for finding in findings if finding.kind not in _SITE_KINDS)


READS = ImportFormat("gia", read, recognises)
