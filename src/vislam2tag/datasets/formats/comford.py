"""COMFORD's intermediate format (Ferrato et al., IPIN 2026): ``Samples.csv``, ``RSSI.csv``, ``APs.csv``.

Columns are identified by position, as in the package's own loader; its documentation uses some other names. Written
session by session.
"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import ExitStack
from pathlib import Path

import polars as pl

from vislam2tag.common.errors import DatasetError, first_line
from vislam2tag.common.files.archives import folder_of, names_in
from vislam2tag.common.files.folder import Folder
from vislam2tag.common.files.table_files import read_csv
from vislam2tag.common.findings import Finding, Severity, finding_if
from vislam2tag.datasets import writing
from vislam2tag.datasets.fingerprint_tables import SetContent, SetDescription
from vislam2tag.datasets.folder import sha256_of
from vislam2tag.datasets.format_registry import ExportContext, ExportFormat, ImportContext, ImportFormat, register
from vislam2tag.datasets.model import TEST, TRAIN, Dataset
from vislam2tag.datasets.point_fingerprints import PointFingerprints
from vislam2tag.intake.readings import admitted, level_number

FOLDER = "intermediate"
"""Folder below a data set's root in which the package expects the three files."""
UNKNOWN = "None"
SETS = {TRAIN: "training", TEST: "testing"}
SAMPLES = (
    "sample_id",
    "x",
    "y",
    "z",
    "timestamp",
    "set",
    "floor",
    "building",
    "device",
    "user",
    "config",
    "orientation",
)
RSSI = ("sample_id", "rssi", "ap_id", "channel/freq")
APS = ("ap_id", "technology", "x", "y", "z")
FILES: Mapping[str, tuple[str, ...]] = {"Samples.csv": SAMPLES, "RSSI.csv": RSSI, "APs.csv": APS}
TECHNOLOGIES = {"wifi": "WiFi", "ble": "BLE"}
_OUR_ID = r"^(.+)/[a-z]+/\d{6}$"
"""Ids of this program begin with the walk."""
_VALIDATION = "validation"
"""Read as a test set, because the package uses this name for the test sets of some data sets."""
_ORPHANS = "levels of samples that are not in Samples.csv are skipped"


def recognises(path: Path) -> bool:
    """Whether the three files exist."""
    return set(FILES) <= {name.name for name in names_in(path)}


def read(path: Path, context: ImportContext) -> Dataset:
    """Read the three files. A device's samples of a day are a session, unless the ids name the walk as ours do.

    Raises DatasetError if a file has no such column, or a sample no position.
    """
    folder = folder_of(path, context.scratch, context.most_unpacked)
    files = {name: _file(path, folder, name) for name in FILES}
    samples, rssi, aps = (_table(file, FILES[name]) for name, file in files.items())
    rows = _rows(files["Samples.csv"], samples, _technologies(rssi, aps))
    heard, odd = _heard(files["RSSI.csv"], rssi, rows)
    unknown = rssi.filter(~pl.col("sample_id").is_in(rows["sample_id"].implode())).height
    findings = (*odd, *finding_if(unknown, "unknown_samples", _ORPHANS, "RSSI.csv", Severity.WARNING))
    inputs = {name: sha256_of(file) for name, file in files.items()}
    content = SetContent(PointFingerprints(rows.drop("sample_id"), heard), inputs, findings)
    return SetDescription("comford", frame="that of the files, metres").dataset(path, content)


def _file(path: Path, folder: Path, name: str) -> Path:
    found = sorted(file for file in folder.rglob("*") if file.name == name)
    if len(found) != 1:
        raise DatasetError(f"{path}: contains {len(found)} files {name}, expected one")
    return found[0]


def _table(file: Path, columns: tuple[str, ...]) -> pl.DataFrame:
    """Read a file as text by the column positions that the package uses, whatever its header."""
    try:
        table = read_csv(file, separator=";", infer_schema=False, null_values=[UNKNOWN, ""])
    except (OSError, pl.exceptions.PolarsError) as error:
        raise DatasetError(f"{file}: cannot be read ({first_line(error)})") from error
    if table.width < len(columns):
        raise DatasetError(f"{file}: line 1 has {table.width} columns; expected {', '.join(columns)}")
    return table.select(table.columns[: len(columns)]).rename(dict(zip(table.columns, columns, strict=False)))


def _technologies(rssi: pl.DataFrame, aps: pl.DataFrame) -> pl.DataFrame:
    """The technology of each sample, from its readings."""
    ours = {theirs: name for name, theirs in TECHNOLOGIES.items()}
    named = aps.select("ap_id", pl.col("technology").replace(old=ours).str.to_lowercase())
    joined = rssi.select("sample_id", "ap_id").join(named, on="ap_id", how="left")
    return joined.group_by("sample_id").agg(pl.col("technology").drop_nulls().min())


def _rows(file: Path, samples: pl.DataFrame, technologies: pl.DataFrame) -> pl.DataFrame:
    seconds, rest = pl.col("timestamp").str.extract(r"^(\d+)"), pl.col("timestamp").str.extract(r"^\d+\.(\d{1,9})")
    time_ns = seconds.cast(pl.Int64, strict=False) * 1_000_000_000 + rest.str.pad_end(9, "0").cast(pl.Int64).fill_null(
        0
    )
    rows = samples.with_row_index("row").join(technologies, on="sample_id", how="left", maintain_order="left")
    typed = rows.select(
        pl.col("row").cast(pl.Int64),
        "sample_id",
        pl.col("technology").fill_null("wifi"),
        pl.col("x", "y", "z").cast(pl.Float64, strict=False),
        pl.col("floor").cast(pl.Float64, strict=False).cast(pl.Int32, strict=False),
        "building",
        "device",
        "user",
        time_ns=time_ns,
        heading_deg=pl.col("orientation").cast(pl.Float64, strict=False),
        part=_part(samples["set"]),
    ).with_columns(date=pl.from_epoch("time_ns", time_unit="ns").dt.date())
    wrong = typed.filter(pl.any_horizontal(pl.col("x", "y", "floor").is_null()))
    if wrong.height:
        raise DatasetError(f"{file}: line {wrong['row'][0] + 2}: x, y and floor must be numbers")
    together = pl.concat_str("device", "user", pl.col("date").cast(pl.String), separator=".", ignore_nulls=True)
    return typed.with_columns(session=pl.coalesce(pl.col("sample_id").str.extract(_OUR_ID), together))


def _part(sets: pl.Series) -> pl.Series:
    """``train`` and ``test``; a validation set is the test set if there is no other, else it is in neither part."""
    named = {SETS[TRAIN]: TRAIN, "train": TRAIN, SETS[TEST]: TEST, "test": TEST}
    part = sets.replace_strict(named, default=None, return_dtype=pl.String)
    if TEST not in part:
        part = sets.replace_strict(named | {_VALIDATION: TEST}, default=None, return_dtype=pl.String)
    return part if part.n_unique() > 1 else pl.repeat(None, len(part), dtype=pl.String, eager=True)


def _heard(file: Path, rssi: pl.DataFrame, rows: pl.DataFrame) -> tuple[pl.DataFrame, list[Finding]]:
    typed = rssi.with_row_index("row", offset=2).with_columns(rssi_dbm=level_number(pl.col("rssi")).cast(pl.Float32))
    wrong = typed.filter(pl.col("rssi_dbm").is_null())
    if wrong.height:
        raise DatasetError(f"{file}: line {wrong['row'][0]}: rssi must be a number")
    named, odd = admitted(typed, "ap_id", file.name)
    heard = named.drop("row").join(rows.select("row", "sample_id"), on="sample_id", maintain_order="left")
    return heard.drop_nulls("rssi_dbm").select(
        "row",
        pl.col("ap_id").alias("bssid"),
        "rssi_dbm",
        pl.col("channel/freq").cast(pl.Float32, strict=False).alias("frequency_mhz"),
    ), odd


HOLDS = {
    writing.SET: (writing.ONE_SPLIT,),
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

    Raises DatasetError if no fingerprint has a position, and UsageError for an unknown split.
    """
    parts, chosen = writing.train_test_assignment(dataset, context)
    fingerprints, findings = writing.labelled_fingerprints(dataset, uncertain=False)
    sets = parts.select("scan_id", set=pl.col("part").replace_strict(SETS))
    extra = sets.lazy().join(writing.with_unix_time(dataset), on="scan_id", how="full", coalesce=True).collect()
    unknown_levels = 0
    with ExitStack() as stack:
        samples, rssi, aps = (
            stack.enter_context(writing.csv_file(folder, f"{FOLDER}/{name}", separator=";", null=UNKNOWN))
            for name in FILES
        )
        aps(_transmitter_rows(dataset.access_points.collect()))
        for tables in writing.labelled_by_session(dataset, fingerprints, context.progress):
            samples(_sample_rows(tables.fingerprints, extra))
            rssi(_reading_rows(tables.readings))
            unknown_levels += tables.readings["rssi_dbm"].null_count()
    return (
        *findings,
        *chosen,
        *writing.in_neither_part(fingerprints, parts),
        *finding_if(unknown_levels, "unknown_levels_left_out", writing.UNKNOWN_LEVELS),
    )


def _sample_rows(fingerprints: pl.DataFrame, extra: pl.DataFrame) -> pl.DataFrame:
    joined = fingerprints.join(extra, on="scan_id", how="left", maintain_order="left")
    # The package compares buildings; one without a name must still be equal to itself.
    building = pl.when(pl.col("building") == "").then(pl.lit("0")).otherwise("building")
    return joined.select(
        pl.col("scan_id").alias("sample_id"),
        "x",
        "y",
        "z",
        writing.seconds_text(pl.col("unix_ns")).alias("timestamp"),
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
    named = transmitters.select(ap_id="bssid", technology=pl.col("technology").replace(old=TECHNOLOGIES))
    return named.with_columns(pl.lit(None, pl.Float64).alias(name) for name in "xyz")


register(ImportFormat("comford", read, recognises), ExportFormat("comford", HOLDS, takes=("split",), write=write))
