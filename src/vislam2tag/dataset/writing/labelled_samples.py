"""The labelled fingerprints of a data set, session by session, as formats of plain samples need them."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import BinaryIO

import numpy as np
import numpy.typing as npt
import polars as pl

from vislam2tag.common.errors import DatasetError
from vislam2tag.common.files.folder import Folder
from vislam2tag.common.finding_kinds import FindingKind
from vislam2tag.common.findings import Finding, Severity
from vislam2tag.common.progress import Progress
from vislam2tag.dataset.by_session import SessionTables, each_session
from vislam2tag.dataset.model import Dataset

_CELLS_AT_ONCE = 4_000_000
"""Cells of a matrix in memory at once: 16 MB."""
_NS = 1_000_000_000


def labelled_fingerprints(
    dataset: Dataset, technology: str | None = None, *, uncertain: bool = True
) -> tuple[pl.LazyFrame, tuple[Finding, ...]]:
    """Return the fingerprints that have x, y and a floor, in order, and what that leaves out.

    With ``technology`` only its fingerprints; without ``uncertain`` none that is so, as formats want that cannot say
    how sure a position is. Raises DatasetError where none is left.
    """
    known = pl.all_horizontal(pl.col("x", "y", "floor").is_not_null())
    wanted = pl.lit(value=True) if technology is None else pl.col("technology") == technology
    sure = pl.lit(value=True) if uncertain else pl.col("status") != "uncertain"
    counts = dataset.fingerprints.select(
        kept=(known & wanted & sure).sum(),
        unlabelled=(~known & wanted).sum(),
        unsure=(known & wanted & ~sure).sum(),
        other=(~wanted).sum(),
    ).collect(engine="streaming")
    kept, *lost = counts.row(0)
    if not kept:
        what = "fingerprint" if technology is None else f"{technology} fingerprint"
        raise DatasetError(f"{dataset.info.name}: no {what} of it has a position; this format holds only those that do")
    messages: tuple[tuple[FindingKind, str], ...] = (
        ("unlabelled_left_out", "fingerprints without a position are left out: the format has no place for them"),
        (
            "uncertain_left_out",
            "uncertain fingerprints are left out: the format cannot say how sure a position is; "
            "`dataset --max-sigma-m` decides",
        ),
        ("technology_left_out", f"fingerprints of another technology than {technology} are left out"),
    )
    findings = (_left_out(kind, count, message) for count, (kind, message) in zip(lost, messages, strict=True) if count)
    return dataset.fingerprints.filter(known & wanted & sure), tuple(findings)


def labelled_by_session(
    dataset: Dataset, fingerprints: pl.LazyFrame, progress: Progress[str]
) -> Iterator[SessionTables]:
    """Yield the fingerprints and their readings session by session, telling ``progress`` after each."""
    total = fingerprints.select(pl.col("session").n_unique()).collect(engine="streaming").item()
    for tables in each_session(fingerprints, dataset.readings):
        yield tables
        progress(tables.session, total)


def matrices(
    tables: SessionTables, transmitters: pl.Series, not_heard: float
) -> Iterator[tuple[pl.DataFrame, npt.NDArray[np.float32]]]:
    """Yield runs of fingerprints with their levels (rows, access points), dBm; ``not_heard`` where there is none.

    Columns follow ``transmitters`` (bssid). Several readings of one access point in a fingerprint become their mean.
    """
    columns = pl.DataFrame({"bssid": transmitters}).with_row_index("column")
    height = max(1, _CELLS_AT_ONCE // max(1, len(transmitters)))
    for rows in tables.fingerprints.iter_slices(height):
        cells = (
            tables.readings.join(rows.select("scan_id").with_row_index("row"), on="scan_id")
            .join(columns, on="bssid")
            .group_by("row", "column")
            .agg(pl.col("rssi_dbm").mean())
            .drop_nulls("rssi_dbm")
        )
        matrix = np.full((rows.height, len(transmitters)), not_heard, dtype=np.float32)
        matrix[cells["row"].to_numpy(), cells["column"].to_numpy()] = cells["rssi_dbm"].to_numpy()
        yield rows, matrix


class MatrixLosses:
    """Counts, session by session, the readings that a matrix of levels cannot hold as they are."""

    def __init__(self, not_heard: float) -> None:
        self._not_heard = not_heard
        self._counts = np.zeros(3, dtype=np.int64)

    def add(self, readings: pl.DataFrame) -> None:
        """Count among the readings of a session's fingerprints."""
        levels = pl.col("rssi_dbm")
        row = readings.select(
            unknown=levels.is_null().sum(),
            hidden=(levels == self._not_heard).sum(),
            several=pl.len() - pl.struct("scan_id", "bssid").n_unique(),
        ).row(0)
        self._counts += np.array(row, dtype=np.int64)

    @property
    def findings(self) -> tuple[Finding, ...]:
        """What was counted."""
        hidden = f"readings of {self._not_heard:g} dBm look like not heard, which the format writes this way"
        messages: tuple[tuple[FindingKind, str], ...] = (
            ("unknown_levels_left_out", "readings without a level are left out"),
            ("levels_left_out", hidden),
            (
                "readings_averaged",
                "readings are further ones of an access point in a fingerprint: their mean is written",
            ),
        )
        counted = zip(self._counts.tolist(), messages, strict=True)
        return tuple(_left_out(kind, count, message) for count, (kind, message) in counted if count)


def with_unix_time(dataset: Dataset) -> pl.LazyFrame:
    """Return ``scan_id`` and ``unix_ns`` (start of the fingerprint, ns since 1970) of every fingerprint.

    On the boot clock the time of day is that of the session's start, taken as UTC, plus what has passed since its
    first fingerprint; null where it is not known.
    """
    start = pl.col("start_ns")
    if dataset.info.clock == "unix":
        return dataset.fingerprints.select("scan_id", unix_ns=start)
    if dataset.info.clock == "none":
        return dataset.fingerprints.select("scan_id", unix_ns=pl.lit(None, dtype=pl.Int64))
    first = dataset.fingerprints.group_by("session").agg(first_ns=start.min())
    started = dataset.sessions.select("session", started_ns=pl.col("started").dt.epoch("us") * 1000)
    return (
        dataset.fingerprints.select("scan_id", "session", "start_ns")
        .join(first, on="session", how="left", maintain_order="left")
        .join(started, on="session", how="left", maintain_order="left")
        .select("scan_id", unix_ns=pl.col("started_ns") + start - pl.col("first_ns"))
    )


def seconds_text(time_ns: pl.Expr) -> pl.Expr:
    """Write whole nanoseconds as seconds, without the digits that a floating-point number would lose."""
    rest = (time_ns % _NS).cast(pl.String).str.zfill(9).str.strip_chars_end("0")
    whole = (time_ns // _NS).cast(pl.String)
    return pl.when(rest == "").then(whole).otherwise(pl.concat_str([whole, rest], separator="."))


@dataclass
class CsvFile:
    """Appends tables of the same columns; the first brings the header."""

    file: BinaryIO
    separator: str
    null: str
    _started: bool = field(default=False)

    def add(self, table: pl.DataFrame) -> None:
        """Append the rows of a table; one without rows still brings the header."""
        table.write_csv(self.file, include_header=not self._started, separator=self.separator, null_value=self.null)
        self._started = True


@contextmanager
def csv_file(folder: Folder, name: str, separator: str = ",", null: str = "") -> Iterator[CsvFile]:
    """Open a new CSV file; ``null`` is written for what is not known."""
    with folder.writing(name) as file:
        yield CsvFile(file, separator, null)


def _left_out(kind: FindingKind, count: int, message: str) -> Finding:
    return Finding(kind=kind, file="", count=count, message=message, severity=Severity.INFO)
