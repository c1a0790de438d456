"""Compares two data sets, outputs of ``process`` or folders in the published labelled layout within a tolerance.

Tables with the same keys are compared.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import ClassVar

import polars as pl

from vislam2tag.common.errors import UsageError
from vislam2tag.common.files.given_files import AnyPath, read_json
from vislam2tag.common.files.stored_folder import folder_at_hand
from vislam2tag.common.files.table_files import scan_parquet
from vislam2tag.common.folder_kinds import found_at
from vislam2tag.common.progress import Progress, silent
from vislam2tag.common.records import Record
from vislam2tag.common.tabular import Result
from vislam2tag.datasets.annotated_tables import ANNOTATED_FILES, WIFI_FILE, read_annotated
from vislam2tag.datasets.folder import dataset_in, is_dataset, open_dataset
from vislam2tag.datasets.label_comparison import LabelComparison, compare_outputs
from vislam2tag.datasets.model import Dataset, one_session
from vislam2tag.datasets.schema import ACCESS_POINTS, FINGERPRINTS, IMU_WINDOWS, KEYS, MAGNETIC, READINGS, RTT, SESSIONS
from vislam2tag.labeling.results import PROGRAM, RESULTS, RUN_FILE
from vislam2tag.labeling.tables import TRAJECTORY

POSITIONS = (("x", "y"), ("x_median", "y_median"), ("x_start", "y_start"), ("x_end", "y_end"), ("x_coord", "y_coord"))
"""Pairs of columns that form a position; their difference is a distance."""
ROWS_NAMED = 5
_ROW = "__row"


class ColumnDifference(Record):
    """One column (or the two of a position) with different values in some rows."""

    column: str
    rows: int
    greatest: float | None
    """Greatest difference in the column's unit; None if values are not numbers, or one is missing."""
    where: str
    """Key of the row with the greatest difference, or of the first row that differs."""


class TableDifferences(Record):
    """Differences between two tables of one session (or of the whole set)."""

    session: str
    table: str
    matched: int
    """Rows whose key is in both."""
    missing: int
    """Rows that only the first table has."""
    extra: int
    """Rows that only the second table has."""
    missing_rows: tuple[str, ...] = ()
    """Keys of the first few of these rows."""
    extra_rows: tuple[str, ...] = ()
    missing_columns: tuple[str, ...] = ()
    """Columns that only the first table has, or whose type differs."""
    extra_columns: tuple[str, ...] = ()
    columns: tuple[ColumnDifference, ...] = ()

    @property
    def same(self) -> bool:
        """Whether nothing differs."""
        return not (self.missing or self.extra or self.missing_columns or self.extra_columns or self.columns)


def compare_tables(
    session: str, table: str, one: pl.DataFrame, other: pl.DataFrame, keys: Sequence[str], tolerance: float
) -> TableDifferences:
    """Compare row by row; rows with equal keys are matched in their order.

    Positions may differ by ``tolerance`` metres, and fractional numbers by the same value in their own unit. Times,
    whole numbers and texts must be equal. A missing value equals only a missing value.
    """
    both = [name for name in one.columns if name in other.columns and _alike(one.schema[name], other.schema[name])]
    missing, extra, pairs = _matched(one.select(both), other.select(both), keys)
    found = [_difference(pairs, columns, keys, tolerance) for columns in _compared(both, keys)]
    return TableDifferences(
        session=session,
        table=table,
        matched=pairs.height,
        missing=missing.height,
        extra=extra.height,
        missing_rows=_names(missing, keys),
        extra_rows=_names(extra, keys),
        missing_columns=tuple(name for name in one.columns if name not in both),
        extra_columns=tuple(name for name in other.columns if name not in both),
        columns=tuple(difference for difference in found if difference is not None),
    )


def _alike(one: pl.DataType, other: pl.DataType) -> bool:
    """Whether values of two types can be compared; widths of numbers do not matter."""
    return one == other or (one.is_numeric() and other.is_numeric())


def _matched(
    one: pl.DataFrame, other: pl.DataFrame, keys: Sequence[str]
) -> tuple[pl.DataFrame, pl.DataFrame, pl.DataFrame]:
    """Rows of one only, rows of the other only, and pairs (the other's columns with ``_other``) in the order of one."""
    on = [*keys, _ROW]
    numbered = pl.int_range(pl.len()).over(keys).alias(_ROW)
    one, other = one.with_columns(numbered), other.with_columns(numbered)
    join = {"on": on, "nulls_equal": True, "maintain_order": "left"}
    return (
        one.join(other, how="anti", **join),  # type: ignore[arg-type]
        other.join(one, how="anti", **join),  # type: ignore[arg-type]
        one.join(other, how="inner", suffix="_other", **join),  # type: ignore[arg-type]
    )


def _names(rows: pl.DataFrame, keys: Sequence[str]) -> tuple[str, ...]:
    return tuple(" ".join(str(value) for value in row) for row in rows.head(ROWS_NAMED).select(keys).iter_rows())


def _compared(columns: Sequence[str], keys: Sequence[str]) -> list[tuple[str, ...]]:
    """Positions as pairs; every other column that is not a key alone."""
    positions = [pair for pair in POSITIONS if set(pair) <= set(columns)]
    used = {name for pair in positions for name in pair} | set(keys)
    return [*positions, *((name,) for name in columns if name not in used)]


def _difference(
    pairs: pl.DataFrame, columns: tuple[str, ...], keys: Sequence[str], tolerance: float
) -> ColumnDifference | None:
    """Compare one column, or the two of a position."""
    sizes = [_size(pairs, name) for name in columns]
    size = pl.sum_horizontal(pl.Series(size) ** 2 for size in sizes).sqrt() if len(sizes) > 1 else pl.lit(sizes[0])
    rows = pairs.select(*keys, size=size).filter(pl.col("size") > tolerance)
    if rows.is_empty():
        return None
    finite = rows.filter(pl.col("size").is_finite())
    first = (rows if finite.is_empty() else finite.sort("size", descending=True, maintain_order=True)).head(1)
    greatest = None if finite.is_empty() else float(first["size"].item())
    return ColumnDifference(
        column=", ".join(columns), rows=rows.height, greatest=greatest, where=_names(first, keys)[0]
    )


def _size(pairs: pl.DataFrame, name: str) -> pl.Series:
    """Difference of a column in each pair of rows; infinite if values are unequal and cannot be subtracted."""
    one, other = pairs[name], pairs[f"{name}_other"]
    unequal = one.ne_missing(other)
    size = pl.select(pl.when(unequal).then(float("inf")).otherwise(0.0)).to_series()
    if one.dtype.is_float() or other.dtype.is_float():
        apart = (one.cast(pl.Float64) - other.cast(pl.Float64)).abs()
        if name.endswith("_deg"):
            apart = pl.select(pl.min_horizontal(apart, (360 - apart).abs())).to_series()
    elif isinstance(one.dtype, pl.List) and one.dtype.inner.is_float():
        apart = _greatest_in_lists(one, other)
    else:
        return size
    return pl.select(
        pl.when(unequal & apart.is_not_nan()).then(apart.fill_null(float("inf"))).otherwise(size)
    ).to_series()


def _greatest_in_lists(one: pl.Series, other: pl.Series) -> pl.Series:
    """Greatest difference between two lists of numbers of equal length; null if lengths differ."""
    lists = pl.DataFrame({"one": one, "other": other}).with_row_index("row")
    equal = lists.filter(pl.col("one").list.len() == pl.col("other").list.len()).explode("one", "other")
    greatest = equal.group_by("row").agg(apart=(pl.col("one") - pl.col("other")).abs().max().cast(pl.Float64))
    return lists.join(greatest, on="row", how="left", maintain_order="left")["apart"]


DATASET, LABELS, ANNOTATED = "data set", "labels", "annotated files"
WHOLE_SET = ""
"""Session of tables that belong to none."""
_FACTS = {"floors", "frame", "clock", "groupings", "bssid_key"}
"""Parts of a manifest that must be equal (floors without the plan file). The rest records who, when and how."""


ComparedTable = tuple[tuple[str, ...], Callable[[], pl.DataFrame]]
"""One table of one session: its keys, and how it is read."""


@dataclass(frozen=True)
class ComparedFolder:
    """Content of a folder, by session and table."""

    kind: str
    tables: Mapping[tuple[str, str], ComparedTable]
    facts: Mapping[str, str] = field(default_factory=dict)

    @property
    def sessions(self) -> set[str]:
        """Names of all sessions."""
        return {session for session, _ in self.tables} - {WHOLE_SET}


def comparable(folder: Path) -> ComparedFolder:
    """List the tables of a folder; raises UsageError if it contains nothing that can be compared."""
    if is_dataset(dataset_in(folder)):
        return _of_dataset(open_dataset(folder))
    if _is_output(folder):
        return ComparedFolder(LABELS, dict(_of_output(folder)))
    annotated = dict(_of_annotated(folder))
    if annotated:
        return ComparedFolder(ANNOTATED, annotated)
    raise UsageError(
        f"{folder}: contains nothing to compare; pass data sets, outputs of `vislam2tag process`, or folders with "
        f"{' or '.join(ANNOTATED_FILES)} in their sessions{found_at(folder)}"
    )


def _of_dataset(dataset: Dataset) -> ComparedFolder:
    facts = dataset.info.model_dump(mode="json", include=_FACTS, exclude={"floors": {"__all__": {"plan"}}})
    tables = dict(_session_parts(dataset))
    for name in (ACCESS_POINTS, SESSIONS):
        tables[WHOLE_SET, name] = ((KEYS[name],), dataset.tables[name].collect)
    for name, split in dataset.splits.items():
        tables[WHOLE_SET, f"split {name}"] = (("id",), lambda groups=split.groups: groups)  # type: ignore[misc]
    return ComparedFolder(DATASET, tables, {name: json.dumps(value, sort_keys=True) for name, value in facts.items()})


def _session_parts(dataset: Dataset) -> Iterator[tuple[tuple[str, str], ComparedTable]]:
    sessions = dataset.fingerprints.select("session").unique().collect(engine="streaming")["session"]
    for session in sessions.sort():
        yield (session, FINGERPRINTS), ((KEYS[FINGERPRINTS],), _rows_of(dataset, FINGERPRINTS, session))
        yield (session, READINGS), (("scan_id", "bssid", "time_ns"), _readings_of(dataset, session))
        for name in (MAGNETIC, IMU_WINDOWS, RTT):
            if name in dataset.tables:
                yield (session, name), ((KEYS[name],), _rows_of(dataset, name, session))


def _rows_of(dataset: Dataset, name: str, session: str) -> Callable[[], pl.DataFrame]:
    return dataset.tables[name].filter(pl.col("session") == session).collect


def _readings_of(dataset: Dataset, session: str) -> Callable[[], pl.DataFrame]:
    return lambda: one_session(dataset.fingerprints, dataset.readings, session).readings


def _is_output(folder: Path) -> bool:
    try:
        return bool(read_json(folder / RUN_FILE)["program"] == PROGRAM)
    except (OSError, ValueError, KeyError, TypeError):
        return False


def _of_output(folder: Path) -> Iterator[tuple[tuple[str, str], ComparedTable]]:
    """Tables of finished sessions; readings are identified by their line in the raw file, frames by their time."""
    for result in sorted((folder / RESULTS).glob("*.json")):
        for path in (table / f"{result.stem}.parquet" for table in sorted(folder.iterdir())):
            if not path.is_file():
                continue
            name = path.parent.name
            keys = ("time_ns",) if name == TRAJECTORY else ("row",)
            yield (result.stem, name), (keys, scan_parquet(path).collect)


def _of_annotated(folder: Path) -> Iterator[tuple[tuple[str, str], ComparedTable]]:
    for path in sorted(folder.rglob("*_annotated.csv")):
        if path.name in ANNOTATED_FILES:
            keys = ("time", "mac") if path.name == WIFI_FILE else ("time", "type")
            session = path.parent.relative_to(folder).as_posix()
            yield (session, path.name), (keys, lambda path=path: read_annotated(path))  # type: ignore[misc]


class Comparison(Result):
    """Differences between two folders."""

    main_table: ClassVar[str] = "differences"

    kind: str
    tolerance: float
    tables: int
    """Number of compared tables, counted for each session."""
    rows: int
    """Rows whose key is in both."""
    missing_sessions: tuple[str, ...]
    """Sessions that only the first folder has."""
    extra_sessions: tuple[str, ...]
    facts: tuple[str, ...]
    """Entries of the manifests that differ."""
    differences: tuple[TableDifferences, ...]
    """The tables that differ, by session."""
    labels: LabelComparison | None = None
    """Comparison of two outputs of ``process`` walk by walk, in metres; None for other folders."""

    @property
    def same(self) -> bool:
        """Whether nothing differs."""
        return not (self.missing_sessions or self.extra_sessions or self.facts or self.differences)


def compare(first: AnyPath, second: AnyPath, tolerance: float, progress: Progress[int] = silent) -> Comparison:
    """Compare two folders, or addresses of folders in object storage. Tables are read one session at a time.

    ``tolerance`` is in metres for positions, and in the column's own unit for other fractional numbers.

    Raises UsageError if the folders contain nothing to compare or are of different kinds, and DatasetError if a table
    cannot be read.
    """
    first, second = Path(first), Path(second)
    with folder_at_hand(first) as one, folder_at_hand(second) as other:
        return _comparison(one, other, tolerance, progress)


def _comparison(first: Path, second: Path, tolerance: float, progress: Progress[int]) -> Comparison:
    one, other = comparable(first), comparable(second)
    if one.kind != other.kind:
        raise UsageError(
            f"{first} contains {one.kind}, but {second} contains {other.kind}; only folders of one kind can be "
            "compared. Make data sets or an export of both"
        )
    missing, extra = sorted(one.sessions - other.sessions), sorted(other.sessions - one.sessions)
    compared = sorted(key for key in {*one.tables, *other.tables} if key[0] not in {*missing, *extra})
    if not (compared or missing or extra):
        raise UsageError(f"{first} and {second}: neither contains a table, so there is nothing to compare")
    found = []
    for done, (session, table) in enumerate(compared, start=1):
        found.append(_table_compared(session, table, one, other, tolerance))
        progress(done, len(compared))
    return Comparison(
        kind=one.kind,
        tolerance=tolerance,
        tables=len(found),
        rows=sum(table.matched for table in found),
        missing_sessions=tuple(missing),
        extra_sessions=tuple(extra),
        facts=tuple(
            name for name in sorted({*one.facts, *other.facts}) if one.facts.get(name) != other.facts.get(name)
        ),
        differences=tuple(table for table in found if not table.same),
        labels=compare_outputs(first, second) if one.kind == LABELS else None,
    )


def _table_compared(
    session: str, table: str, one: ComparedFolder, other: ComparedFolder, tolerance: float
) -> TableDifferences:
    """Compare one table; a table on one side only is entirely missing or extra."""
    compared = one.tables.get((session, table)), other.tables.get((session, table))
    keys = next(side[0] for side in compared if side is not None)
    tables = [None if side is None else side[1]() for side in compared]
    schema = next(read.schema for read in tables if read is not None)
    first, second = (schema.to_frame() if read is None else read for read in tables)
    return compare_tables(session, table, first, second, keys, tolerance)
