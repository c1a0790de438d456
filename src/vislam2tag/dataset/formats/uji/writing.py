"""Writing UJIIndoorLoc's wide tables, piece by piece."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import ExitStack

import numpy as np
import numpy.typing as npt
import polars as pl

from vislam2tag.common.files.folder import Folder
from vislam2tag.common.files.table_files import write_csv
from vislam2tag.common.findings import Finding
from vislam2tag.common.spreadsheet_text import escaped
from vislam2tag.dataset.format_registry import ExportContext, ExportFormat
from vislam2tag.dataset.formats.uji.reading import (
    ACCESS_POINTS_FILE,
    FILES,
    NUMBERINGS,
    TECHNOLOGY,
    Numbering,
)
from vislam2tag.dataset.model import Dataset
from vislam2tag.dataset.writing.labelled_samples import (
    CsvFile,
    MatrixLosses,
    csv_file,
    labelled_by_session,
    labelled_fingerprints,
    matrices,
    with_unix_time,
)
from vislam2tag.dataset.writing.left_out import ONE_SPLIT, SET
from vislam2tag.dataset.writing.train_test_assignment import train_test_assignment
from vislam2tag.intake.signal_strength import NOT_HEARD

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
