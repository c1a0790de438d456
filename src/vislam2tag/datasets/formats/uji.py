"""UJIIndoorLoc's wide tables (Torres-Sospedra et al., IPIN 2014): a column an access point, 100 where not heard.

``trainingData.csv`` and ``validationData.csv``; numbers stand for buildings, users and phones, which tables beside
ours tell by name. Written piece by piece.
"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
import polars as pl

from vislam2tag import __version__
from vislam2tag.common.errors import DatasetError, first_line
from vislam2tag.common.files.archives import folder_of, names_in
from vislam2tag.common.files.folder import Folder
from vislam2tag.common.files.table_files import read_csv, write_csv
from vislam2tag.common.findings import Finding
from vislam2tag.common.spreadsheet_text import escaped, unescaped
from vislam2tag.datasets.folder import sha256_of
from vislam2tag.datasets.format_registry import ExportContext, ExportFormat, ImportContext, ImportFormat, register
from vislam2tag.datasets.model import TEST, TRAIN, Dataset, DatasetInfo, DatasetSource, Grouping
from vislam2tag.datasets.point_fingerprints import PointFingerprints, floor_infos, point_dataset
from vislam2tag.datasets.wide_tables import LevelRules, WideTable, is_wide, read_wide
from vislam2tag.datasets.writing import (
    ONE_SPLIT,
    SET,
    CsvFile,
    MatrixLosses,
    csv_file,
    labelled_by_session,
    labelled_fingerprints,
    matrices,
    train_test_assignment,
    with_unix_time,
)
from vislam2tag.intake.addresses import MASKED, normal_addresses
from vislam2tag.intake.signal_strength import NOT_HEARD, strength_of

TECHNOLOGY = "wifi"
STRENGTH = strength_of(["uji"])
"""UJIIndoorLoc states levels from -104 to 0 dBm (Torres-Sospedra et al., IPIN 2014): 0 was measured there."""
FILES = {TRAIN: "trainingData.csv", TEST: "validationData.csv"}
ACCESS_POINTS_FILE = "access_points.csv"
"""Ours, beside: the address and name of each access point's column."""
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
    """The number of each name of one kind (``BUILDINGID``, ``USERID`` or ``PHONEID``) and the file that tells them."""

    column: str
    file: str
    name: str
    first: int
    """Number of the first name; where it is 1, 0 stands for not known."""


NUMBERINGS = {
    "building": Numbering("BUILDINGID", "buildings.csv", "building", 0),
    "user": Numbering("USERID", "users.csv", "user", 1),
    "device": Numbering("PHONEID", "phones.csv", "device", 1),
}
"""By the column of the fingerprints."""


def recognises(path: Path) -> bool:
    """Whether there is one of the two files, with its columns where it can be looked into."""
    if path.is_file() and path.suffix.lower() == ".csv":
        return is_wide(path, frozenset(TAIL))
    wanted = {name.lower() for name in FILES.values()}
    return any(name.name.lower() in wanted for name in names_in(path))


def read(path: Path, context: ImportContext) -> Dataset:
    """Read one or both files; ``LONGITUDE`` and ``LATITUDE`` are metres.

    A session is what one user recorded with one phone in a building on a day. Raises DatasetError where a file is no
    such table.
    """
    folder = folder_of(path, context.scratch, context.most_unpacked)
    files = {TRAIN: path} if path.suffix.lower() == ".csv" and path.is_file() else _files(path, folder)
    names = {name: _names(folder / numbering.file, numbering) for name, numbering in NUMBERINGS.items()}
    rows, heard, first_row = [], [], 0
    findings: list[Finding] = []
    for part, file in files.items():
        table = read_wide(file, TAIL, _is_access_point, LevelRules(NOT_HEARD, STRENGTH, context.not_heard))
        _refuse_lacking(file, table)
        rows.append(_rows(table, names, part if len(files) > 1 else None).with_columns(pl.col("row") + first_row))
        heard.append(table.heard.with_columns(pl.col("row") + first_row))
        findings += table.findings
        first_row += table.rows.height
        context.progress(part, len(files))
    points = PointFingerprints(pl.concat(rows), pl.concat(heard))
    transmitters = _transmitters(folder / ACCESS_POINTS_FILE)
    points = PointFingerprints(points.rows, _with_addresses(points.heard, transmitters))
    inputs = {file.name: sha256_of(file) for file in files.values()}
    info = DatasetInfo(
        name=path.stem,
        frame="metres, as LONGITUDE and LATITUDE are",
        clock="unix" if points.rows["time_ns"].count() else "none",
        floors=floor_infos(points.rows),
        groupings=(Grouping(technology=TECHNOLOGY, by="scan"),),
        sources=(DatasetSource(kind="uji", name=path.name, version=__version__, inputs=inputs),),
        findings=tuple(findings),
    )
    return point_dataset(info, points, _ssids(points.heard, transmitters))


def _files(path: Path, folder: Path) -> dict[str, Path]:
    found = {file.name.lower(): file for file in sorted(folder.rglob("*.csv"))}
    files = {part: found[name.lower()] for part, name in FILES.items() if name.lower() in found}
    if not files:
        raise DatasetError(f"{path}: holds neither {' nor '.join(FILES.values())}")
    return files


def _is_access_point(name: str) -> bool:
    return name.startswith("WAP") and name.removeprefix("WAP").isdecimal()


def _refuse_lacking(file: Path, table: WideTable) -> None:
    needed = ("LONGITUDE", "LATITUDE", "FLOOR")
    for name in needed:
        if table.rows[name].null_count():
            line = table.rows[name].is_null().arg_max()
            raise DatasetError(f"{file}: line {(line or 0) + 2} has no {name}; expected the columns {', '.join(TAIL)}")


def _rows(table: WideTable, names: Mapping[str, dict[int, str]], part: str | None) -> pl.DataFrame:
    """Bring the columns after the access points' to those of :class:`PointFingerprints`."""

    def named(name: str) -> pl.Expr:
        number = pl.col(NUMBERINGS[name].column)
        unknown = pl.when(number >= NUMBERINGS[name].first).then(number.cast(pl.String))
        return number.replace_strict(names[name], default=unknown, return_dtype=pl.String).alias(name)

    seconds = pl.when(pl.col("TIMESTAMP") > 0).then("TIMESTAMP")
    rows = table.rows.select(
        "row",
        named("building"),
        named("user"),
        named("device"),
        pl.col("FLOOR").cast(pl.Int32, strict=False).alias("floor"),
        x="LONGITUDE",
        y="LATITUDE",
        time_ns=seconds * 1_000_000_000,
        date=pl.from_epoch(seconds, time_unit="s").dt.date(),
        part=pl.lit(part, dtype=pl.String),
    )
    session = pl.concat_str(
        pl.when(pl.col("building") != "").then(pl.lit("building_") + pl.col("building")),
        pl.lit("user_") + pl.col("user"),
        pl.lit("phone_") + pl.col("device"),
        pl.col("date").cast(pl.String),
        separator=".",
        ignore_nulls=True,
    )
    return rows.with_columns(session=session)


def _names(file: Path, numbering: Numbering) -> dict[int, str]:
    """Read what the numbers of one kind stand for; empty where no such file lies beside."""
    if not file.is_file():
        return {}
    table = _beside(file, {numbering.column: pl.Int64(), numbering.name: pl.String()})
    return dict(table.select(numbering.column, pl.col(numbering.name).fill_null("")).rows())


def _transmitters(file: Path) -> pl.DataFrame:
    columns = {"column": pl.String(), "bssid": pl.String(), "ssid": pl.String(), "frequency_mhz": pl.Float32()}
    if not file.is_file():
        return pl.DataFrame(schema=columns)
    table = _beside(file, columns)
    return table.with_columns(normal_addresses(table["bssid"]).replace(old=dict.fromkeys(MASKED)))


def _beside(file: Path, columns: Mapping[str, pl.DataType]) -> pl.DataFrame:
    try:
        return unescaped(read_csv(file, schema_overrides=dict(columns)).select(*columns))
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


READS = ImportFormat("uji", read, recognises, takes=("not_heard",))


HOLDS = {
    SET: (ONE_SPLIT,),
    "fingerprints": ("technology", "building", "floor", "x", "y", "user", "device", "start_ns", "date"),
    "readings": ("scan_id", "bssid", "rssi_dbm"),
    "access_points": ("bssid", "technology", "ssid", "frequency_mhz"),
    "sessions": ("building", "user", "device"),
}


def write(dataset: Dataset, folder: Folder, context: ExportContext) -> tuple[Finding, ...]:
    """Write ``trainingData.csv`` and ``validationData.csv``, and what their numbers stand for.

    The wide matrix is made piece by piece. Raises DatasetError where no Wi-Fi fingerprint has a position, UsageError
    for a split that is not there.
    """
    parts = train_test_assignment(dataset, context)
    fingerprints, findings = labelled_fingerprints(dataset, TECHNOLOGY, uncertain=False)
    transmitters = (
        dataset.access_points.filter(pl.col("technology") == TECHNOLOGY)
        .select("bssid", "technology", "ssid", "frequency_mhz")
        .collect()
    )
    columns = wap_columns(transmitters.height)
    numbered = transmitters.insert_column(0, pl.Series("column", columns, dtype=pl.String))
    write_csv(escaped(numbered, formulas=context.escape_formulas), folder, ACCESS_POINTS_FILE)
    numbers = {
        name: _write_numbers(folder, numbering, fingerprints, context.escape_formulas)
        for name, numbering in NUMBERINGS.items()
    }
    whole = _all_whole(dataset)
    extra = parts.part.lazy().join(with_unix_time(dataset), on="scan_id", how="left").collect(engine="streaming")
    losses = MatrixLosses(NOT_HEARD)
    with ExitStack() as stack:
        there = fingerprints.join(parts.part.lazy(), on="scan_id").select(pl.col("part").unique()).collect()["part"]
        files = {part: stack.enter_context(csv_file(folder, name)) for part, name in FILES.items() if part in there}
        for tables in labelled_by_session(dataset, fingerprints, context.progress):
            losses.add(tables.readings)
            for rows, levels in matrices(tables, transmitters["bssid"], NOT_HEARD):
                _add(files, _with_numbers(rows, extra, numbers), _cells(levels, columns, whole=whole))
    return (*findings, *parts.findings, *parts.neither(fingerprints), *losses.findings)


def wap_columns(count: int) -> list[str]:
    """Name the columns of the access points: ``WAP001``, ..."""
    digits = max(3, len(str(count)))
    return [f"WAP{number:0{digits}d}" for number in range(1, count + 1)]


def _all_whole(dataset: Dataset) -> bool:
    """Whether all levels are whole numbers, as phones give them; then they are written as such."""
    level = pl.col("rssi_dbm")
    return bool(dataset.readings.select((level == level.round()).all()).collect(engine="streaming").item())


def _write_numbers(
    folder: Folder, numbering: Numbering, fingerprints: pl.LazyFrame, escape_formulas: bool
) -> dict[str, int]:
    source = pl.col(numbering.name)
    names = fingerprints.select(source).drop_nulls().unique().collect(engine="streaming")[numbering.name].sort()
    table = pl.DataFrame({numbering.name: names}).with_row_index(numbering.column, offset=numbering.first)
    write_csv(escaped(table, formulas=escape_formulas), folder, numbering.file)
    return dict(zip(names, table[numbering.column], strict=True))


def _cells(levels: npt.NDArray[np.float32], columns: list[str], *, whole: bool) -> pl.DataFrame:
    """Levels (rows, access points), dBm, as columns; whole numbers where all are."""
    return pl.from_numpy(levels.astype(np.int32) if whole else levels, schema=columns)


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


def _add(files: Mapping[str, CsvFile], rows: pl.DataFrame, cells: pl.DataFrame) -> None:
    table = pl.concat([cells, rows], how="horizontal")
    for part, file in files.items():
        file.add(table.filter(pl.col("part") == part).drop("part"))


WRITES = ExportFormat("uji", HOLDS, takes=("split",), write=write)


register(READS, WRITES)
