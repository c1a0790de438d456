"""UJIIndoorLoc's wide tables (Torres-Sospedra et al., IPIN 2014): one column for each access point, 100 if not heard.

``trainingData.csv`` and ``validationData.csv`` contain numbers for buildings, users and phones. Additional tables of
this program contain their names. Written piece by piece.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import polars as pl

from vislam2tag.common.errors import DatasetError, first_line
from vislam2tag.common.files.archives import folder_of
from vislam2tag.common.files.folder import Folder
from vislam2tag.common.files.table_files import read_csv, write_csv
from vislam2tag.common.findings import Finding
from vislam2tag.common.text_tables import spreadsheet_escaped, spreadsheet_unescaped
from vislam2tag.datasets import writing
from vislam2tag.datasets.fingerprint_tables import FILE, WALK, FingerprintTables, SetDescription
from vislam2tag.datasets.format_registry import (
    LEVEL_OPTIONS,
    ExportContext,
    ExportFormat,
    ImportContext,
    ImportFormat,
    register,
)
from vislam2tag.datasets.model import TEST, TRAIN, Dataset
from vislam2tag.datasets.point_fingerprints import PointFingerprints
from vislam2tag.intake.level_scales import NOT_HEARD, strength_of
from vislam2tag.intake.readings import MASKED, normal_addresses
from vislam2tag.intake.time_units import NS_OF, are_dates, not_in_seconds, unix_unit

TECHNOLOGY = "wifi"
STRENGTH = strength_of(["uji"])
"""UJIIndoorLoc states levels from -104 to 0 dBm (Torres-Sospedra et al., IPIN 2014): 0 was measured there."""
FILES = {TRAIN: "trainingData.csv", TEST: "validationData.csv"}
ACCESS_POINTS_FILE = "access_points.csv"
"""Additional file of this program: the address and name of each access point's column."""
_I64, _F64 = pl.Int64(), pl.Float64()
TAIL: Mapping[str, pl.DataType] = {
    "LONGITUDE": _F64,
    "LATITUDE": _F64,
    "FLOOR": _I64,
    "BUILDINGID": _I64,
    "SPACEID": _I64,
    "RELATIVEPOSITION": _I64,
    "USERID": _I64,
    "PHONEID": _I64,
    "TIMESTAMP": _I64,
}
"""Columns after those of the access points."""


@dataclass(frozen=True)
class Numbering:
    """The number of each name of one kind (``BUILDINGID``, ``USERID`` or ``PHONEID``), and the file with the names."""

    column: str
    file: str
    first: int
    """Number of the first name; if it is 1, 0 means unknown."""


NUMBERINGS = {
    "building": Numbering("BUILDINGID", "buildings.csv", 0),
    "user": Numbering("USERID", "users.csv", 1),
    "device": Numbering("PHONEID", "phones.csv", 1),
}
"""By the column of the fingerprints and of the file."""
_SECONDS = pl.when(pl.col("TIMESTAMP") > 0).then("TIMESTAMP")
_DATE = pl.from_epoch(_SECONDS, time_unit="s").dt.date()


TABLES = FingerprintTables(
    SetDescription("uji", frame="metres, as LONGITUDE and LATITUDE are"),
    files=re.compile(r"trainingData\.csv|validationData\.csv", re.IGNORECASE),
    none_found="contains neither trainingData.csv nor validationData.csv",
    columns=TAIL,
    access_points=re.compile(r"WAP\d+"),
    needed=("LONGITUDE", "LATITUDE", "FLOOR"),
    times=frozenset({"TIMESTAMP"}),
    strength=STRENGTH,
    by_header=True,
    lone_part=False,
    fields={
        **{name: pl.col(name) for name in NUMBERINGS},
        "floor": pl.col("FLOOR").cast(pl.Int32, strict=False),
        "x": pl.col("LONGITUDE"),
        "y": pl.col("LATITUDE"),
        "time_ns": _SECONDS * 1_000_000_000,
        "date": _DATE,
        "part": pl.col(WALK).replace_strict(
            {"trainingdata": TRAIN, "validationdata": TEST}, default=None, return_dtype=pl.String
        ),
        "session": pl.concat_str(
            pl.when(pl.col("building") != "").then(pl.lit("building_") + pl.col("building")),
            pl.lit("user_") + pl.col("user"),
            pl.lit("phone_") + pl.col("device"),
            _DATE.cast(pl.String),
            separator=".",
            ignore_nulls=True,
        ),
    },
)
"""Positions are metres; a session is the recording of one user with one phone in a building on one day."""


def read(path: Path, context: ImportContext) -> Dataset:
    """Read one or both files, and the names of their numbers from additional files.

    Raises DatasetError if a file is not such a table.
    """
    folder = folder_of(path, context.scratch, context.most_unpacked)
    found = TABLES.rows(path, context)
    rows, odd = _in_seconds(found.points.rows.with_columns(_named(folder, name) for name in NUMBERINGS))
    transmitters = _transmitters(folder / ACCESS_POINTS_FILE)
    heard = _with_addresses(found.points.heard, transmitters)
    points = PointFingerprints(rows, heard)
    content = TABLES.content(replace(found, points=points, findings=(*found.findings, *odd)))
    return TABLES.about.dataset(path, content, _ssids(heard, transmitters))


def _in_seconds(rows: pl.DataFrame) -> tuple[pl.DataFrame, list[Finding]]:
    """The rows with TIMESTAMP in seconds, and a finding for each file that has another unit of Unix time."""
    parts, findings = [], []
    for (file,), part in rows.group_by(FILE, maintain_order=True):
        times = part["TIMESTAMP"].drop_nulls()
        unit = unix_unit(times.filter(times > 0).to_numpy())
        parts.append(part.with_columns(pl.col("TIMESTAMP") // (NS_OF["seconds"] // NS_OF[unit])))
        if unit != "seconds":
            findings.append(not_in_seconds(unit, f"{file}.csv", len(times)))
        elif odd := times.filter(times > 0).filter(~are_dates(times.filter(times > 0))).to_list():
            message = (
                f"times such as {odd[0]} are no dates from 2010 to 2035 in seconds since 1970, so sessions and splits "
                "by day may be wrong: correct TIMESTAMP"
            )
            findings.append(Finding(kind="unreadable_dates", file=f"{file}.csv", count=len(odd), message=message))
    return pl.concat(parts), findings


def _named(folder: Path, name: str) -> pl.Expr:
    """The names of buildings, users or phones from the additional file, else their numbers."""
    numbering = NUMBERINGS[name]
    file, number, names = folder / numbering.file, pl.col(numbering.column), dict[int, str]()
    if file.is_file():
        table = _beside(file, {numbering.column: pl.Int64(), name: pl.String()})
        names = dict(table.select(numbering.column, pl.col(name).fill_null("")).rows())
    unknown = pl.when(number >= numbering.first).then(number.cast(pl.String))
    return number.replace_strict(names, default=unknown, return_dtype=pl.String).alias(name)


def _transmitters(file: Path) -> pl.DataFrame:
    columns = {"column": pl.String(), "bssid": pl.String(), "ssid": pl.String(), "frequency_mhz": pl.Float32()}
    if not file.is_file():
        return pl.DataFrame(schema=columns)
    table = _beside(file, columns)
    return table.with_columns(normal_addresses(table["bssid"]).replace(old=dict.fromkeys(MASKED)))


def _beside(file: Path, columns: Mapping[str, pl.DataType]) -> pl.DataFrame:
    try:
        return spreadsheet_unescaped(read_csv(file, schema_overrides=dict(columns)).select(*columns))
    except pl.exceptions.PolarsError as error:
        what = first_line(error)
        raise DatasetError(f"{file}: cannot be read ({what}); expected the columns {', '.join(columns)}") from error


def _with_addresses(heard: pl.DataFrame, transmitters: pl.DataFrame) -> pl.DataFrame:
    known = transmitters.select("bssid", "frequency_mhz", pl.col("column"))
    return (
        heard.rename({"bssid": "column"})
        .join(known, on="column", how="left", maintain_order="left")
        .with_columns(bssid=pl.coalesce("bssid", "column"))
        .drop("column")
    )


def _ssids(heard: pl.DataFrame, transmitters: pl.DataFrame) -> pl.DataFrame:
    counts = heard.group_by("bssid", maintain_order=True).agg(count=pl.len().cast(pl.Int64))
    named = transmitters.filter(pl.col("ssid").is_not_null()).join(counts, on="bssid")
    return named.select("bssid", pl.lit(TECHNOLOGY).alias("technology"), "ssid", "count")


HOLDS = {
    writing.SET: (writing.ONE_SPLIT,),
    "fingerprints": ("technology", "building", "floor", "x", "y", "user", "device", "start_ns", "date"),
    "readings": ("scan_id", "bssid", "rssi_dbm"),
    "access_points": ("bssid", "technology", "ssid", "frequency_mhz"),
    "sessions": ("building", "user", "device"),
}


def write(dataset: Dataset, folder: Folder, context: ExportContext) -> tuple[Finding, ...]:
    """Write ``trainingData.csv`` and ``validationData.csv``, and the names of their numbers.

    The wide matrix is made piece by piece. Raises DatasetError if no Wi-Fi fingerprint has a position, and UsageError
    for an unknown split.
    """
    parts, chosen = writing.train_test_assignment(dataset, context)
    fingerprints, findings = writing.labelled_fingerprints(dataset, TECHNOLOGY, uncertain=False)
    transmitters = (
        dataset.access_points.filter(pl.col("technology") == TECHNOLOGY)
        .select("bssid", "technology", "ssid", "frequency_mhz")
        .collect()
    )
    columns = wap_columns(transmitters.height)
    numbered = transmitters.insert_column(0, pl.Series("column", columns, dtype=pl.String))
    write_csv(spreadsheet_escaped(numbered, formulas=context.escape_formulas), folder, ACCESS_POINTS_FILE)
    numbers = {name: _write_numbers(folder, name, fingerprints, context.escape_formulas) for name in NUMBERINGS}
    level = pl.col("rssi_dbm")  # whole numbers, as phones report them, are written as whole numbers
    whole = dataset.readings.select((level == level.round()).all()).collect(engine="streaming").item()
    extra = parts.lazy().join(writing.with_unix_time(dataset), on="scan_id", how="left").collect(engine="streaming")
    lost = np.zeros(3, dtype=np.int64)
    with ExitStack() as stack:
        there = fingerprints.join(parts.lazy(), on="scan_id").select(pl.col("part").unique()).collect()["part"]
        files = {
            part: stack.enter_context(writing.csv_file(folder, name)) for part, name in FILES.items() if part in there
        }
        for tables in writing.labelled_by_session(dataset, fingerprints, context.progress):
            lost += writing.matrix_losses(tables.readings, NOT_HEARD)
            for rows, levels in writing.matrices(tables, transmitters["bssid"], NOT_HEARD):
                cells = pl.from_numpy(levels.astype(np.int32) if whole else levels, schema=columns)
                table = pl.concat([cells, _with_numbers(rows, extra, numbers)], how="horizontal")
                for part, add in files.items():
                    add(table.filter(pl.col("part") == part).drop("part"))
    losses = writing.matrix_loss_findings(lost, NOT_HEARD)
    return (*findings, *chosen, *writing.in_neither_part(fingerprints, parts), *losses)


def wap_columns(count: int) -> list[str]:
    """Name the columns of the access points: ``WAP001``, ..."""
    digits = max(3, len(str(count)))
    return [f"WAP{number:0{digits}d}" for number in range(1, count + 1)]


def _write_numbers(folder: Folder, name: str, fingerprints: pl.LazyFrame, escape_formulas: bool) -> dict[str, int]:
    numbering = NUMBERINGS[name]
    names = fingerprints.select(name).drop_nulls().unique().collect(engine="streaming")[name].sort()
    table = pl.DataFrame({name: names}).with_row_index(numbering.column, offset=numbering.first)
    write_csv(spreadsheet_escaped(table, formulas=escape_formulas), folder, numbering.file)
    return dict(zip(names, table[numbering.column], strict=True))


def _with_numbers(rows: pl.DataFrame, extra: pl.DataFrame, numbers: Mapping[str, dict[str, int]]) -> pl.DataFrame:
    """Make the columns after the access points' and ``part``."""

    def number(name: str) -> pl.Expr:
        return pl.col(name).replace_strict(numbers[name], default=0, return_dtype=pl.Int64)

    return rows.join(extra, on="scan_id", how="left", maintain_order="left").select(
        "part",
        LONGITUDE="x",
        LATITUDE="y",
        FLOOR="floor",
        BUILDINGID=number("building"),
        SPACEID=0,
        RELATIVEPOSITION=0,
        USERID=number("user"),
        PHONEID=number("device"),
        TIMESTAMP=(pl.col("unix_ns") // 1_000_000_000).fill_null(0),
    )


register(
    ImportFormat("uji", read, TABLES.recognises, takes=LEVEL_OPTIONS),
    ExportFormat("uji", HOLDS, takes=("split",), write=write),
)
