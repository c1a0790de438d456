"""Reading giaIndoorLoc's labelled layout: ``floor_K/DEVICE/SESSION/wifi_annotated.csv`` (Laska et al., IPIN 2022).

The published files lead text fields with a blank; ours do not. Both are read.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import polars as pl

from vislam2tag import __version__
from vislam2tag.dataset.access_points import access_point_table
from vislam2tag.dataset.fingerprints import SessionFingerprints, Walk, fingerprints_of
from vislam2tag.dataset.folder import sha256_of
from vislam2tag.dataset.formats.archives import folder_of, names_in
from vislam2tag.dataset.formats.gia_export import WIFI_FILE
from vislam2tag.dataset.formats.registry import ImportContext, register_import
from vislam2tag.dataset.model import Dataset, DatasetInfo, FloorInfo, Grouping, Source
from vislam2tag.dataset.motion import TRAJECTORY_COLUMNS, Motion
from vislam2tag.dataset.schema import ACCESS_POINTS, FINGERPRINTS, READINGS, SCHEMAS, SESSIONS, in_schema
from vislam2tag.errors import DatasetError
from vislam2tag.findings import Finding
from vislam2tag.labeling.schemas import SCHEMAS as LABELLED
from vislam2tag.labeling.schemas import TRAJECTORY
from vislam2tag.settings import DatasetSettings
from vislam2tag.survey.corrections import session_start
from vislam2tag.survey.discover import read_site, session_folders
from vislam2tag.survey.model import SessionKey
from vislam2tag.survey.slugs import session_slugs

TECHNOLOGY = "wifi"
COLUMNS = ("id", "time", "type", "ssid", "mac", "rss", "x_coord", "y_coord")
IMPORT_HELP = f"giaIndoorLoc's labelled layout: folder or archive with floor_K/DEVICE/SESSION/{WIFI_FILE}; its Wi-Fi"
_NAMES = "names"
_SITE_KINDS = ("missing_file", "missing_plan")
"""The published data need no landmarks, and a plan only for pictures."""


@dataclass(frozen=True)
class _Session:
    key: SessionKey
    slug: str
    file: Path


def recognises(path: Path) -> bool:
    """Whether there is an annotated Wi-Fi table."""
    return any(name.name == WIFI_FILE for name in names_in(path))


def read(path: Path, context: ImportContext) -> Dataset:
    """Read every session's Wi-Fi readings and group them by scan, one session in memory at a time.

    Raises DatasetError where a table has other columns or a number is none.
    """
    root = _root(path, folder_of(path, context.scratch))
    sessions = _sessions(path, root)
    findings: list[Finding] = []
    for number, session in enumerate(sessions):
        made = _fingerprints(session)
        findings += made.findings
        for name, table in _parts(session, made):
            folder = context.scratch / name
            folder.mkdir(exist_ok=True)
            table.write_parquet(folder / f"{number:06d}.parquet")
        context.advance(len(sessions))
    tables = {name: _scanned(context.scratch / name) for name in (FINGERPRINTS, READINGS, SESSIONS)}
    names = _scanned(context.scratch / _NAMES).collect(engine="streaming")
    heard = access_point_table(tables[FINGERPRINTS], tables[READINGS], names)
    floors, plans, odd = _site(root)
    info = DatasetInfo(
        name=path.stem,
        floors=floors,
        groupings=(Grouping(technology=TECHNOLOGY, by="scan"),),
        sources=(
            Source(
                kind="gia",
                name=path.name,
                version=__version__,
                inputs={str(session.file.relative_to(root)): sha256_of(session.file) for session in sessions},
            ),
        ),
        findings=(*odd, *_pooled(findings)),
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


def _sessions(path: Path, root: Path) -> list[_Session]:
    folders, _ = session_folders(root)
    found = [(key, folder / WIFI_FILE) for key, folder in folders if (folder / WIFI_FILE).is_file()]
    if not found:
        raise DatasetError(f"{path}: holds no floor_K/DEVICE/SESSION/{WIFI_FILE}")
    slugs = session_slugs([key for key, _ in found])
    sessions = [_Session(key, slug, file) for (key, file), slug in zip(found, slugs, strict=True)]
    return sorted(sessions, key=lambda session: session.slug)


def _fingerprints(session: _Session) -> SessionFingerprints:
    rows = _rows(session)
    nowhere = pl.DataFrame(schema={name: LABELLED[TRAJECTORY][name] for name in TRAJECTORY_COLUMNS})
    walk = Walk(session.slug, "", session.key.device, session.key.session, Motion.of(nowhere))
    return fingerprints_of(rows, TECHNOLOGY, walk, DatasetSettings(), float("inf"))


def _rows(session: _Session) -> pl.DataFrame:
    """Bring an annotated table to the columns that ``process`` writes; an unlabelled row has the likeliest cause."""
    texts = _texts(session.file)
    numbers = {
        "scan": pl.col("id").cast(pl.Int32, strict=False),
        "time_ns": pl.col("time")
        .cast(pl.Int64, strict=False)
        .fill_null(pl.col("time").cast(pl.Float64, strict=False).round().cast(pl.Int64, strict=False)),
        "rssi_dbm": pl.col("rss").cast(pl.Float32, strict=False),
        "x": pl.col("x_coord").cast(pl.Float64, strict=False),
        "y": pl.col("y_coord").cast(pl.Float64, strict=False),
    }
    rows = texts.with_columns(**numbers).with_row_index("row", offset=1)
    _refuse_no_numbers(session.file, rows)
    placed = pl.all_horizontal(pl.col("x", "y").is_finite()).fill_null(value=False)
    rows = rows.with_columns(pl.when(placed).then(name).alias(name) for name in ("x", "y"))
    own = {"floor": session.key.floor, "device": session.key.device, "session": session.key.session}
    made = rows.with_columns(
        _status(rows),
        bssid=pl.col("mac"),
        ssid=pl.col("ssid").fill_null(""),
        **{name: pl.lit(value) for name, value in own.items()},
        **{name: pl.lit(None) for name in ("frequency_mhz", "z", "sigma")},
    )
    return made.select(pl.col(name).cast(kind) for name, kind in LABELLED[TECHNOLOGY].items())


def _texts(file: Path) -> pl.DataFrame:
    """Read all columns as text, without the blank that leads them in the published files."""
    try:
        table = pl.read_csv(file, infer_schema=False, encoding="utf8-lossy")
    except (OSError, pl.exceptions.PolarsError) as error:
        raise DatasetError(f"{file}: cannot be read ({str(error).splitlines()[0]})") from error
    table = table.rename({name: name.strip() for name in table.columns})
    missing = [name for name in COLUMNS if name not in table.columns]
    if missing:
        raise DatasetError(f"{file}: line 1 has no column {missing[0]}; expected {','.join(COLUMNS)}")
    # A name may begin with a blank of its own: only where the type has one is one taken away.
    led = pl.col("type").str.starts_with(" ")
    unled = pl.when(led).then(pl.col("ssid").str.strip_prefix(" ")).otherwise("ssid")
    others = [name for name in COLUMNS if name != "ssid"]
    stripped = table.with_columns(unled.alias("ssid"), pl.col(others).str.strip_chars())
    return stripped.with_columns(pl.when(pl.col(name) != "").then(name).alias(name) for name in others)


def _refuse_no_numbers(file: Path, rows: pl.DataFrame) -> None:
    """Raise DatasetError at the first line whose id, time or address is missing, or whose number is none."""
    bad = pl.any_horizontal(pl.col("scan", "time_ns", "mac").is_null())
    for number, text in (("rssi_dbm", "rss"), ("x", "x_coord"), ("y", "y_coord")):
        bad |= pl.col(number).is_null() & pl.col(text).is_not_null()
    wrong = rows.filter(bad)
    if wrong.height:
        raise DatasetError(
            f"{file}: line {wrong['row'][0] + 1}: expected {','.join(COLUMNS)} with numbers for id, time, rss and "
            "coordinates"
        )


def _status(rows: pl.DataFrame) -> pl.Expr:
    """``ok``, ``duplicate`` for what an earlier row gave, or where in the walk a row without position lies."""
    placed = rows.filter(pl.col("x").is_not_null())["time_ns"]
    first, last = placed.min(), placed.max()
    time_ns = pl.col("time_ns")
    return (
        pl.when(pl.struct("mac", "time_ns").is_first_distinct().not_())
        .then(pl.lit("duplicate"))
        .when(pl.col("x").is_not_null())
        .then(pl.lit("ok"))
        .when(pl.lit(first, pl.Int64).is_null())
        .then(pl.lit("no_mapping"))
        .when(time_ns < first)
        .then(pl.lit("before_first_landmark"))
        .when(time_ns > last)
        .then(pl.lit("after_last_landmark"))
        .otherwise(pl.lit("gap"))
        .alias("status")
    )


def _parts(session: _Session, made: SessionFingerprints) -> Iterator[tuple[str, pl.DataFrame]]:
    fingerprints = made.fingerprints
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
        "source": sha256_of(session.file),
    }
    yield FINGERPRINTS, fingerprints
    yield READINGS, made.readings
    yield _NAMES, made.names
    yield SESSIONS, in_schema(SESSIONS, pl.DataFrame([row]))


def _scanned(folder: Path) -> pl.LazyFrame:
    table = pl.scan_parquet(sorted(folder.glob("*.parquet")))
    return table.select(*SCHEMAS[folder.name]) if folder.name in SCHEMAS else table


def _site(root: Path) -> tuple[tuple[FloorInfo, ...], dict[str, Path], tuple[Finding, ...]]:
    """Floors with their extents and plans, where the layout's site files are beside."""
    site, findings = read_site(root)
    floors, plans = [], {}
    for floor in site.floors:
        plan = f"plans/floor_{floor.number}{floor.plan.suffix}" if floor.plan else None
        if plan and floor.plan:
            plans[plan] = floor.plan
        floors.append(
            FloorInfo(
                number=floor.number,
                name=floor.name,
                elevation_m=floor.elevation_m,
                width_m=floor.width_m,
                height_m=floor.height_m,
                plan=plan,
            )
        )
    return tuple(floors), plans, tuple(finding for finding in findings if finding.kind not in _SITE_KINDS)


def _pooled(findings: Iterable[Finding]) -> tuple[Finding, ...]:
    """Sum the findings of all sessions by kind."""
    pooled: dict[tuple[str, str], Finding] = {}
    for finding in findings:
        key = (finding.kind, finding.message)
        before = pooled[key].count if key in pooled else 0
        pooled[key] = finding.model_copy(update={"count": before + finding.count})
    return tuple(pooled.values())


register_import("gia", read, IMPORT_HELP, recognises)
