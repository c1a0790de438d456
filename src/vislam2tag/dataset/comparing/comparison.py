"""Whether two data sets (or labelled folders) are the same within a tolerance, and where they are not."""

from __future__ import annotations

from pathlib import Path

from vislam2tag.common.errors import UsageError
from vislam2tag.common.files.stored_folder import folder_at_hand
from vislam2tag.common.progress import Progress, silent
from vislam2tag.common.records import Record
from vislam2tag.common.text_paths import AnyPath
from vislam2tag.dataset.comparing.comparable import LABELS, ComparedFolder, comparable
from vislam2tag.dataset.comparing.label_comparison import LabelComparison, compare_outputs
from vislam2tag.dataset.comparing.table_comparison import TableDifferences, compare_tables


class Comparison(Record):
    """What differs between a first and a second folder."""

    kind: str
    tolerance: float
    tables: int
    """Tables compared: one a session and name."""
    rows: int
    """Rows whose key is in both."""
    missing_sessions: tuple[str, ...]
    """Sessions that only the first has."""
    extra_sessions: tuple[str, ...]
    facts: tuple[str, ...]
    """Entries of the manifests that differ."""
    differences: tuple[TableDifferences, ...]
    """Of the tables that differ alone, by session."""
    labels: LabelComparison | None = None
    """Two outputs of ``process`` walk by walk, in metres; None for other folders."""

    @property
    def same(self) -> bool:
        """Whether nothing differs."""
        return not (self.missing_sessions or self.extra_sessions or self.facts or self.differences)


def compare(first: AnyPath, second: AnyPath, tolerance: float, progress: Progress[int] = silent) -> Comparison:
    """Compare two folders, or addresses of folders in object storage, one table of one session at a time.

    ``tolerance``: metres for positions, the own unit of any other column with fractions.
    Raises UsageError where the folders contain nothing to compare or different kinds, DatasetError where a
    table cannot be read.
    """
    first, second = Path(first), Path(second)
    with folder_at_hand(first) as one, folder_at_hand(second) as other:
        return _comparison(one, other, tolerance, progress)


def _comparison(first: Path, second: Path, tolerance: float, progress: Progress[int]) -> Comparison:
    one, other = comparable(first), comparable(second)
    if one.kind != other.kind:
        raise UsageError(
            f"{first} is of the kind {one.kind}, {second} of the kind {other.kind}: only the same can be compared; "
            "make data sets or an export of both"
        )
    missing, extra = sorted(one.sessions - other.sessions), sorted(other.sessions - one.sessions)
    compared = sorted(key for key in {*one.tables, *other.tables} if key[0] not in {*missing, *extra})
    if not (compared or missing or extra):
        raise UsageError(f"{first} and {second}: neither contains a table, so there is nothing to compare")
    found = []
    for done, (session, table) in enumerate(compared, start=1):
        found.append(_compared(session, table, one, other, tolerance))
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


def _compared(
    session: str, table: str, one: ComparedFolder, other: ComparedFolder, tolerance: float
) -> TableDifferences:
    """Compare one table; one that is on one side only is all missing or all extra."""
    compared = one.tables.get((session, table)), other.tables.get((session, table))
    keys = next(side.keys for side in compared if side is not None)
    tables = [None if side is None else side.read() for side in compared]
    schema = next(read.schema for read in tables if read is not None)
    first, second = (schema.to_frame() if read is None else read for read in tables)
    return compare_tables(session, table, first, second, keys, tolerance)
