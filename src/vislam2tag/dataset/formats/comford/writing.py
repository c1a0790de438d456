"""Writing COMFORD's three files, session by session."""

from __future__ import annotations

from contextlib import ExitStack

import polars as pl

from vislam2tag.common.files.folder import Folder
from vislam2tag.common.findings import Finding, Severity
from vislam2tag.dataset.format_registry import ExportContext, ExportFormat
from vislam2tag.dataset.formats.comford.reading import FILES, FOLDER, SETS, TECHNOLOGIES, UNKNOWN
from vislam2tag.dataset.model import Dataset
from vislam2tag.dataset.writing.labelled_samples import (
    csv_file,
    labelled_by_session,
    labelled_fingerprints,
    seconds_text,
    with_unix_time,
)
from vislam2tag.dataset.writing.left_out import ONE_SPLIT, SET
from vislam2tag.dataset.writing.train_test_assignment import train_test_assignment

HOLDS = {
    SET: (ONE_SPLIT,),
    "fingerprints": (
        "scan_id",
        "technology",
        "building",
        "floor",
        "x",
        "y",
        "z",
        "heading_deg",
        "device",
        "user",
        "session",
        "start_ns",
        "date",
    ),
    "readings": ("scan_id", "bssid", "rssi_dbm", "frequency_mhz"),
    "access_points": ("bssid", "technology", "frequency_mhz"),
    "sessions": ("session", "building", "device", "user"),
}


def write(dataset: Dataset, folder: Folder, context: ExportContext) -> tuple[Finding, ...]:
    """Write the three files, session by session.

    Raises DatasetError where no fingerprint has a position, UsageError for a split that is not there.
    """
    parts = train_test_assignment(dataset, context)
    fingerprints, findings = labelled_fingerprints(dataset, uncertain=False)
    sets = parts.part.select("scan_id", set=pl.col("part").replace_strict(SETS))
    extra = sets.lazy().join(with_unix_time(dataset), on="scan_id", how="full", coalesce=True).collect()
    unknown_levels = 0
    with ExitStack() as stack:
        samples, rssi, aps = (
            stack.enter_context(csv_file(folder, f"{FOLDER}/{name}", separator=";", null=UNKNOWN)) for name in FILES
        )
        aps.add(_transmitter_rows(dataset.access_points.collect()))
        for tables in labelled_by_session(dataset, fingerprints, context.progress):
            samples.add(_sample_rows(tables.fingerprints, extra))
            rssi.add(_reading_rows(tables.readings))
            unknown_levels += tables.readings["rssi_dbm"].null_count()
    return (*findings, *parts.findings, *parts.neither(fingerprints), *_unknown_levels(unknown_levels))


def _sample_rows(fingerprints: pl.DataFrame, extra: pl.DataFrame) -> pl.DataFrame:
    joined = fingerprints.join(extra, on="scan_id", how="left", maintain_order="left")
    # The package compares buildings; one without a name must still be equal to itself.
    building = pl.when(pl.col("building") == "").then(pl.lit("0")).otherwise("building")
    return joined.select(
        pl.col("scan_id").alias("sample_id"),
        "x",
        "y",
        "z",
        seconds_text(pl.col("unix_ns")).alias("timestamp"),
        "set",
        "floor",
        building.alias("building"),
        "device",
        "user",
        pl.lit(None, pl.String).alias("config"),
        pl.col("heading_deg").alias("orientation"),
    )


def _reading_rows(readings: pl.DataFrame) -> pl.DataFrame:
    known = readings.filter(pl.col("rssi_dbm").is_not_null())
    return known.select(
        pl.col("scan_id").alias("sample_id"),
        pl.col("rssi_dbm").alias("rssi"),
        pl.col("bssid").alias("ap_id"),
        pl.col("frequency_mhz").round().cast(pl.Int32).alias("channel/freq"),
    )


def _transmitter_rows(transmitters: pl.DataFrame) -> pl.DataFrame:
    nowhere = pl.lit(None, pl.Float64)
    return transmitters.select(
        pl.col("bssid").alias("ap_id"),
        pl.col("technology").replace(old=TECHNOLOGIES),
        nowhere.alias("x"),
        nowhere.alias("y"),
        nowhere.alias("z"),
    )


def _unknown_levels(count: int) -> tuple[Finding, ...]:
    if not count:
        return ()
    message = "readings without a level are left out"
    return (Finding(kind="unknown_levels_left_out", file="", count=count, message=message, severity=Severity.INFO),)


WRITES = ExportFormat("comford", HOLDS, takes=("split",), write=write)
