"""giaIndoorLoc's labelled layout (Laska et al., IPIN 2022): ``floor_K/DEVICE/SESSION/wifi_annotated.csv``.

Annotated tables by floor, phone and session, with the raw files next to them; written from labels, and read.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import polars as pl

from vislam2tag import __version__
from vislam2tag.common.errors import DatasetError
from vislam2tag.common.files.archives import folder_of, names_in
from vislam2tag.common.files.folder import Folder
from vislam2tag.common.files.given_files import read_bytes
from vislam2tag.common.files.table_files import write_csv
from vislam2tag.common.findings import Finding, FindingKind, finding_if, pooled
from vislam2tag.datasets.annotated_tables import (
    SENSORS_FILE,
    WIFI_FILE,
    PrivateLabels,
    hidden_wifi_file,
    sensor_rows,
    wifi_rows,
)
from vislam2tag.datasets.fingerprints import (
    SessionWalk,
    access_points_of,
    fingerprints_of,
    radio_parts,
    tables_of,
    write_part,
)
from vislam2tag.datasets.folder import sha256_of
from vislam2tag.datasets.format_registry import ExportContext, ExportFormat, ImportContext, ImportFormat, register
from vislam2tag.datasets.labelled import LabelledSession
from vislam2tag.datasets.model import Dataset, DatasetInfo, DatasetSource, FloorInfo, Grouping
from vislam2tag.datasets.phone_motion import PhoneMotion
from vislam2tag.datasets.schema import ACCESS_POINTS, FINGERPRINTS, MAGNETIC, READINGS, SESSIONS, in_schema
from vislam2tag.datasets.sensor_windows import magnetic_windows
from vislam2tag.datasets.settings import DatasetSettings
from vislam2tag.datasets.writing import raw_session, refuse_changed_files, shared_labels
from vislam2tag.intake.readings import admitted
from vislam2tag.labeling.results import SessionResult
from vislam2tag.labeling.tables import SCHEMAS as LABELLED
from vislam2tag.labeling.tables import TRAJECTORY
from vislam2tag.sessions.formats.published import FILE_NAMES
from vislam2tag.sessions.registry import at_hand, format_of, open_survey
from vislam2tag.site.corrections.file import session_start
from vislam2tag.site.discover import read_site, session_folders
from vislam2tag.site.links import left_out_files, outside_link
from vislam2tag.site.model import SessionKey, session_slugs
from vislam2tag.site.plans.load import plan_file

TECHNOLOGY = "wifi"
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

    Raises DatasetError if a table has other columns or a number is invalid.
    """
    root = _root(path, folder_of(path, context.scratch, context.most_unpacked))
    sessions = _sessions(path, root)
    findings: list[Finding] = []
    settings = DatasetSettings()
    for number, session in enumerate(sessions):
        parts, odd = _parts(session, settings)
        findings += odd
        write_part(context.scratch, number, parts)
        context.progress(session.slug, len(sessions))
    tables = tables_of(context.scratch.path)
    heard = access_points_of(context.scratch.path, tables[FINGERPRINTS], tables[READINGS])
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
    """The folder that contains the floors, which may be inside another in an archive."""
    found = sorted(folder.rglob(WIFI_FILE))
    if not found:
        raise DatasetError(f"{path}: contains no floor_K/DEVICE/SESSION/{WIFI_FILE}")
    if len(found[0].relative_to(folder).parts) < 4:
        raise DatasetError(f"{found[0]}: not in a folder floor_K/DEVICE/SESSION, so floor and device are unknown")
    return found[0].parents[3]


def _sessions(path: Path, root: Path) -> list[_AnnotatedSession]:
    folders, _ = session_folders(root)
    found = [(key, folder) for key, folder in folders if (folder / WIFI_FILE).is_file()]
    if not found:
        raise DatasetError(f"{path}: contains no floor_K/DEVICE/SESSION/{WIFI_FILE}")
    slugs = session_slugs([key for key, _ in found])
    sessions = [
        _AnnotatedSession(key, slug, folder / WIFI_FILE, folder / SENSORS_FILE)
        for (key, folder), slug in zip(found, slugs, strict=True)
    ]
    return sorted(sessions, key=lambda session: session.slug)


def _parts(
    session: _AnnotatedSession, settings: DatasetSettings
) -> tuple[dict[str, pl.DataFrame], tuple[Finding, ...]]:
    """Make one session's rows of each table; headings and speeds need a trajectory, which the layout does not have."""
    rows, odd = admitted(wifi_rows(session.wifi, session.key), "bssid", WIFI_FILE)
    nowhere = pl.DataFrame(schema=LABELLED[TRAJECTORY])
    walk = SessionWalk(session.slug, "", session.key.device, session.key.session, PhoneMotion.of(nowhere))
    made = fingerprints_of({TECHNOLOGY: rows}, TECHNOLOGY, walk, settings, math.inf)
    tables, findings = radio_parts([made])
    tables[SESSIONS] = _session_row(session, made.fingerprints)
    if session.sensors.is_file():
        sensors = sensor_rows(session.sensors, session.key)
        magnetic = magnetic_windows(sensors, session.slug, "", settings.magnetic_window_s)
        tables |= {MAGNETIC: magnetic} if len(magnetic) else {}
    return tables, (*odd, *findings)


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


def _site(root: Path, scratch: Folder) -> tuple[tuple[FloorInfo, ...], dict[str, Path], tuple[Finding, ...]]:
    """Floors with their extents and plans, if the layout's site files exist."""
    site, findings = read_site(root)
    floors, plans = [], {}
    for floor in site.floors:
        drawn = plan_file(floor, scratch)
        plan = f"plans/floor_{floor.number}{drawn.suffix}" if drawn else None
        if plan and drawn:
            plans[plan] = drawn
        same = ("number", "name", "elevation_m", "width_m", "height_m", "lower_left_m", "georeference")
        floors.append(FloorInfo(plan=plan, **{name: getattr(floor, name) for name in same}))
    return tuple(floors), plans, tuple(finding for finding in findings if finding.kind not in _SITE_KINDS)


WIFI_TYPE = "WLAN"
OUTSIDE = ("after_last_landmark", "outside_frames")
"""Status of rows that the published program skips, because nothing is mapped from there on."""
_WITHOUT_ADDRESSES = frozenset(
    name for role in ("poses", "landmarks", "sensors", "presses") for name in FILE_NAMES[role]
) | {"AnchorPose.csv", "tachy.csv", "truth.csv", "route.csv"}
"""Raw files that contain no address or name of a network."""
HOLDS = {
    "wifi": ("floor", "device", "session", "row", "scan", "time_ns", "bssid", "ssid", "rssi_dbm", "x", "y"),
    "sensors": ("floor", "device", "session", "row", "time_ns", "sensor", "v1", "v2", "v3", "v4", "v5", "v6", "x", "y"),
}


def write(labels: Path, folder: Folder, context: ExportContext) -> tuple[Finding, ...]:
    """Write the annotated tables of every session that has a label.

    Raises DatasetError if there is none, or if ``labels`` is not a finished output of ``process``, and UsageError if
    ``--survey`` is another survey.
    """
    opened, left_out = shared_labels(labels, context)
    private = PrivateLabels.of(opened.sessions, context.privacy)
    raw = {ref.key: ref for ref in open_survey(context.survey).sessions} if context.survey else {}
    lost: list[Finding] = []
    written = 0
    for session in opened.sessions:
        result = session.result()
        own = folder.folder(f"floor_{result.floor}/{result.device}/{result.session}")
        if _write_session(session, result, own, private, lost):
            written += 1
            if context.survey:
                with at_hand(raw_session(raw, result, context.survey), whole=True) as here:
                    refuse_changed_files(here, result, context.survey)
                    _copy_session(here.folder, own, session, private, lost)
        context.progress(result.session, len(opened.sessions))
    if not written:
        raise DatasetError(
            f"{labels}: none of its readings has a position that is certain and on the floor of its folder; "
            "report.html gives the reason"
        )
    if context.survey:
        left_out = (*left_out, *_copy_site(context.survey, folder, context))
    return (*left_out, *private.findings, *pooled(lost))


def _write_session(
    session: LabelledSession, result: SessionResult, folder: Folder, private: PrivateLabels, lost: list[Finding]
) -> bool:
    wifi = _placed(session.table("wifi", LABELLED["wifi"]), result.floor, lost)
    sensors = _placed(session.table("sensors", LABELLED["sensors"]), result.floor, lost)
    if not wifi["x"].count() and not sensors["x"].count():
        lost += finding_if(1, "unmapped_sessions", "sessions without a labelled reading are skipped")
        return False
    place = (pl.col("x").alias("x_coord"), pl.col("y").alias("y_coord"))
    annotated = private.hidden(wifi).select(
        pl.col("scan").alias("id"),
        pl.col("time_ns").alias("time"),
        pl.lit(WIFI_TYPE).alias("type"),
        "ssid",
        pl.col("bssid").alias("mac"),
        _shortest(wifi["rssi_dbm"]).alias("rss"),
        *place,
    )
    # An empty name is written as nothing, as in the published files, not as a pair of quotes.
    write_csv(annotated.with_columns(pl.col("ssid").replace("", None)), folder, WIFI_FILE)
    if sensors.height:
        values = (f"v{number}" for number in range(1, 7))
        rows = sensors.select(pl.col("time_ns").alias("time"), pl.col("sensor").alias("type"), *values, *place)
        write_csv(rows, folder, SENSORS_FILE)
    return True


def _placed(rows: pl.DataFrame, floor: int, lost: list[Finding]) -> pl.DataFrame:
    """Sort by time, skip rows outside the mapped part, and keep the positions that the layout supports."""
    outside = pl.col("status").is_in(OUTSIDE)
    elsewhere = pl.col("x").is_not_null() & (pl.col("floor") != floor)
    uncertain = pl.col("x").is_not_null() & (pl.col("status") == "uncertain")
    losses: tuple[tuple[FindingKind, pl.Expr, str], ...] = (
        ("rows_outside", outside, "rows outside the frames, or after the mapped part of their walk, are skipped"),
        (
            "other_floor",
            elsewhere,
            (
                "rows on a floor other than that of their folder lose their position, because the layout has no floor "
                "column"
            ),
        ),
        (
            "uncertain_left_out",
            uncertain & ~elsewhere,
            "uncertain rows lose their position, because the layout cannot store a standard deviation; "
            "`process --max-sigma-m` sets the limit",
        ),
    )
    for kind, mask, message in losses:
        lost += finding_if(int(rows.select(mask.sum()).item()), kind, message)
    kept = ~elsewhere & ~uncertain
    placed = rows.filter(~outside).sort("time_ns", "row")
    return placed.with_columns(pl.when(kept).then(name).alias(name) for name in ("x", "y"))


def _shortest(levels: pl.Series) -> pl.Expr:
    """Levels as whole numbers if all are, as in the published files."""
    known = levels.drop_nulls()
    return pl.col("rssi_dbm").cast(pl.Int32) if (known == known.round()).all() else pl.col("rssi_dbm")


def _copy_session(
    source: Path, target: Folder, session: LabelledSession, private: PrivateLabels, lost: list[Finding]
) -> None:
    """Copy a session's raw files; files that would reveal hidden data are rewritten or skipped."""
    published = format_of(source) == "published"
    read = next((name for name in FILE_NAMES["wifi"] if published and (source / name).is_file()), None)
    for file in sorted(entry for entry in source.iterdir() if entry.is_file() and not entry.name.startswith(".")):
        if file.name in (WIFI_FILE, SENSORS_FILE):
            continue
        if not private.hides or file.name in _WITHOUT_ADDRESSES:
            target.copy(file, file.name)
        elif file.name == read:
            rows = session.table("wifi", ("row", "bssid", "ssid"))
            target.write(file.name, hidden_wifi_file(read_bytes(file), private.hidden(rows)))
        else:
            lost += finding_if(1, "raw_files_left_out", "raw files that may reveal hidden data are skipped")


def _copy_site(survey: Path, folder: Folder, context: ExportContext) -> list[Finding]:
    """Copy the files that describe the site, of the survey and of each of its floors; return findings."""
    outside = set[str]()
    for file in sorted([*survey.glob("*"), *survey.glob("floor_*/*")]):
        if not file.is_file() or file.name.startswith("."):
            continue
        link = None if context.follow_links else outside_link(survey, file)
        if link is not None:
            outside.add(link)
            continue
        folder.copy(file, file.relative_to(survey).as_posix())
    left_out = [left_out_files(sorted(outside))] if outside else []
    context.tell(left_out)
    return left_out


register(ImportFormat("gia", read, recognises), ExportFormat("gia", HOLDS, takes=("survey",), write_labels=write))
