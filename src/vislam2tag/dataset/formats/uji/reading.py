"""Reading UJIIndoorLoc's wide tables, and the names that stand beside ours."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import polars as pl

from vislam2tag import __version__
from vislam2tag.common.errors import DatasetError, first_line
from vislam2tag.common.files.archives import folder_of, names_in
from vislam2tag.common.files.table_files import read_csv
from vislam2tag.common.findings import Finding
from vislam2tag.common.spreadsheet_text import unescaped
from vislam2tag.dataset.folder import sha256_of
from vislam2tag.dataset.format_registry import ImportContext, ImportFormat
from vislam2tag.dataset.model import TEST, TRAIN, Dataset, DatasetInfo, DatasetSource, Grouping
from vislam2tag.dataset.reading.point_fingerprints import PointFingerprints, floor_infos, point_dataset
from vislam2tag.dataset.reading.wide_tables import LevelRules, WideTable, is_wide, read_wide
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
