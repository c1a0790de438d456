"""Writing giaIndoorLoc's labelled layout: annotated tables by floor, phone and session, the raw files beside."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import polars as pl

from vislam2tag.common.errors import DatasetError, UsageError
from vislam2tag.common.files.folder import Folder
from vislam2tag.common.files.plain_files import read_bytes
from vislam2tag.common.files.table_files import write_csv
from vislam2tag.common.finding_kinds import FindingKind
from vislam2tag.common.findings import Finding, Severity
from vislam2tag.dataset.fingerprinting.labelled import LabelledSession
from vislam2tag.dataset.folder import sha256_of
from vislam2tag.dataset.format_registry import ExportContext, ExportFormat
from vislam2tag.dataset.formats.gia.annotated_tables import SENSORS_FILE, WIFI_FILE
from vislam2tag.dataset.formats.gia.private_labels import PrivateLabels, hidden_wifi_file
from vislam2tag.dataset.writing.shared_labels import shared_labels
from vislam2tag.labeling.results import SessionResult
from vislam2tag.labeling.schemas import SCHEMAS
from vislam2tag.sessions.formats.published import FILE_NAMES
from vislam2tag.sessions.registry import at_hand, format_of, open_survey
from vislam2tag.survey.links import left_out_files, outside_link
from vislam2tag.survey.model import SessionKey, SessionRef

WIFI_TYPE = "WLAN"
OUTSIDE = ("after_last_landmark", "outside_frames")
"""Rows that the published program leaves out: nothing is mapped from there on."""
_WITHOUT_ADDRESSES = frozenset(
    name for role in ("poses", "landmarks", "sensors", "presses") for name in FILE_NAMES[role]
) | {"AnchorPose.csv", "tachy.csv", "truth.csv", "route.csv"}
"""Raw files that hold no address or name of a network."""
HOLDS = {
    "wifi": ("floor", "device", "session", "row", "scan", "time_ns", "bssid", "ssid", "rssi_dbm", "x", "y"),
    "sensors": ("floor", "device", "session", "row", "time_ns", "sensor", "v1", "v2", "v3", "v4", "v5", "v6", "x", "y"),
}


@dataclass
class _LossCounts:
    """Rows that lose something, over all sessions."""

    counts: dict[tuple[FindingKind, str], int] = field(default_factory=dict)

    def add(self, kind: FindingKind, message: str, count: int) -> None:
        if count:
            self.counts[kind, message] = self.counts.get((kind, message), 0) + count

    def findings(self) -> Iterator[Finding]:
        for (kind, message), count in self.counts.items():
            yield Finding(kind=kind, file="", count=count, message=message, severity=Severity.INFO)


def write(labels: Path, folder: Folder, context: ExportContext) -> tuple[Finding, ...]:
    """Write the annotated tables of every session that has a label.

    Raises DatasetError where none has, or ``labels`` is no finished output of ``process``, UsageError where
    ``--survey`` is another survey.
    """
    opened, left_out = shared_labels(labels, context)
    private = PrivateLabels.of(opened.sessions, context.privacy)
    raw = {ref.key: ref for ref in open_survey(context.survey).sessions} if context.survey else {}
    count = _LossCounts()
    written = 0
    for session in opened.sessions:
        result = session.result()
        own = folder.folder(f"floor_{result.floor}/{result.device}/{result.session}")
        if _write_session(session, result, own, private, count):
            written += 1
            if context.survey:
                with at_hand(_raw_session(raw, result, context.survey), whole=True) as here:
                    _refuse_other_files(here, result, context.survey)
                    _copy_session(here.folder, own, session, private, count)
        context.progress(result.session, len(opened.sessions))
    if not written:
        raise DatasetError(f"{labels}: no reading of it has a position; its report.html says why")
    if context.survey:
        left_out = (*left_out, *_copy_site(context.survey, folder, context))
    return (*left_out, *private.findings, *count.findings())


def _write_session(
    session: LabelledSession, result: SessionResult, folder: Folder, private: PrivateLabels, count: _LossCounts
) -> bool:
    wifi = _placed(session.table("wifi", SCHEMAS["wifi"]), result.floor, count)
    sensors = _placed(session.table("sensors", SCHEMAS["sensors"]), result.floor, count)
    if not wifi["x"].count() and not sensors["x"].count():
        count.add("unmapped_sessions", "sessions without a labelled reading are left out", 1)
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
    # An empty name is written as nothing at all, as published, not as a pair of quotes.
    write_csv(annotated.with_columns(pl.col("ssid").replace("", None)), folder, WIFI_FILE)
    if sensors.height:
        values = (f"v{number}" for number in range(1, 7))
        rows = sensors.select(pl.col("time_ns").alias("time"), pl.col("sensor").alias("type"), *values, *place)
        write_csv(rows, folder, SENSORS_FILE)
    return True


def _placed(rows: pl.DataFrame, floor: int, count: _LossCounts) -> pl.DataFrame:
    """Sort by time, leave out what lies outside the mapped part, and keep the positions that the layout can hold."""
    outside = pl.col("status").is_in(OUTSIDE)
    elsewhere = pl.col("x").is_not_null() & (pl.col("floor") != floor)
    uncertain = pl.col("x").is_not_null() & (pl.col("status") == "uncertain")
    losses: tuple[tuple[FindingKind, pl.Expr, str], ...] = (
        ("rows_outside", outside, "rows outside the frames, or after the mapped part of their walk, are left out"),
        (
            "other_floor",
            elsewhere,
            "rows on another floor than their folder's lose their position: the layout has no column for a floor",
        ),
        (
            "uncertain_left_out",
            uncertain & ~elsewhere,
            "uncertain rows lose their position: the layout cannot say how sure one is; process --max-sigma-m decides",
        ),
    )
    for kind, mask, message in losses:
        count.add(kind, message, int(rows.select(mask.sum()).item()))
    kept = ~elsewhere & ~uncertain
    placed = rows.filter(~outside).sort("time_ns", "row")
    return placed.with_columns(pl.when(kept).then(name).alias(name) for name in ("x", "y"))


def _shortest(levels: pl.Series) -> pl.Expr:
    """Levels as whole numbers where all are, as the published files have them."""
    known = levels.drop_nulls()
    return pl.col("rssi_dbm").cast(pl.Int32) if (known == known.round()).all() else pl.col("rssi_dbm")


def _raw_session(raw: Mapping[SessionKey, SessionRef], result: SessionResult, survey: Path) -> SessionRef:
    key = SessionKey(result.floor, result.device, result.session)
    if key not in raw:
        raise UsageError(f"--survey {survey}: has no session {key}; give the survey that the labels were made of")
    return raw[key]


def _refuse_other_files(here: SessionRef, result: SessionResult, survey: Path) -> None:
    for account in result.files:
        file = here.folder / account.name
        if account.role != "companion" and (not file.is_file() or sha256_of(file) != account.sha256):
            raise UsageError(
                f"--survey {survey}: {here.key}: {account.name} is not what the labels were made of; run `vislam2tag "
                "process` again"
            )


def _copy_session(
    source: Path, target: Folder, session: LabelledSession, private: PrivateLabels, count: _LossCounts
) -> None:
    """Copy a session's raw files; those that would tell what is hidden are rewritten or left out."""
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
            count.add("raw_files_left_out", "raw files that may tell what is hidden are left out", 1)


def _copy_site(survey: Path, folder: Folder, context: ExportContext) -> list[Finding]:
    """Copy the files that describe the site, of the survey and of each of its floors; return what is left out."""
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


WRITES = ExportFormat("gia", HOLDS, takes=("survey",), write_labels=write)
