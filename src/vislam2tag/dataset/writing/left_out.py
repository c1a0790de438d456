"""What a format has no place for: counted and stated, column by column."""

from __future__ import annotations

from collections.abc import Collection, Mapping

import polars as pl

from vislam2tag.common.findings import Finding, Severity
from vislam2tag.dataset.model import Dataset

SET = "set"
"""Stands among tables for what belongs to the set as a whole."""
MANIFEST, SPLITS, ONE_SPLIT, PLANS = "manifest", "splits", "one split", "plans"
DERIVED: Mapping[str, frozenset[str]] = {
    "fingerprints": frozenset({"readings"}),
    "access_points": frozenset(
        {
            "radio",
            "readings",
            "fingerprints",
            "sessions",
            "floors",
            "strongest_dbm",
            "randomised",
            "mobile",
            "nomap",
        }
    ),
    "sessions": frozenset({"fingerprints"}),
}
"""Columns that follow from the others: reading back makes them anew, so that nothing is lost."""
Holds = Mapping[str, Collection[str]]


def left_out_of_dataset(dataset: Dataset, holds: Holds) -> tuple[Finding, ...]:
    """Name what a format does not hold of a data set: by table, its columns with values; then of the whole."""
    return (*left_out(dataset.tables, holds), *_of_set(dataset, holds.get(SET, ())))


def left_out(tables: Mapping[str, pl.LazyFrame], holds: Holds) -> tuple[Finding, ...]:
    """Name, table by table, the columns with values that a format does not hold; ``count`` is the rows concerned."""
    found = (_of_table(name, table, holds.get(name, ())) for name, table in tables.items())
    return tuple(finding for finding in found if finding)


def _of_table(name: str, table: pl.LazyFrame, held: Collection[str]) -> Finding | None:
    schema = table.collect_schema()
    if not held:
        rows = int(table.select(pl.len()).collect(engine="streaming").item())
        return _finding(name, rows, f"the table {name} is left out: the format has no place for it") if rows else None
    missing = [column for column in schema if column not in held and column not in DERIVED.get(name, ())]
    if not missing:
        return None
    # An empty text, such as the name of the only building, says nothing that could be lost.
    stated = {
        column: (pl.col(column) != "").fill_null(value=False)
        if schema[column] == pl.String
        else pl.col(column).is_not_null()
        for column in missing
    }
    counts = table.select(
        pl.any_horizontal(stated.values()).sum().alias("_rows"),
        *(test.any().alias(name) for name, test in stated.items()),
    )
    found = counts.collect(engine="streaming").row(0, named=True)
    lost = [column for column in missing if found[column]]
    return _finding(name, found["_rows"], f"columns left out of {name}: {', '.join(lost)}") if lost else None


def _of_set(dataset: Dataset, held: Collection[str]) -> list[Finding]:
    info = dataset.info
    stated = [name for name in ("title", "description", "licence", "creators", "doi") if getattr(info, name)]
    findings = []
    if stated and MANIFEST not in held:
        findings.append(_finding("manifest", len(stated), f"left out of the manifest: {', '.join(stated)}"))
    others = len(dataset.splits) - (ONE_SPLIT in held)
    if SPLITS not in held and others > 0:
        which = "all splits but one" if ONE_SPLIT in held else "splits"
        findings.append(_finding("splits", others, f"{which} are left out"))
    if dataset.files and PLANS not in held:
        findings.append(_finding("plans", len(dataset.files), "plans of the floors are left out"))
    return findings


def _finding(file: str, count: int, message: str) -> Finding:
    return Finding(kind="left_out", file=file, count=count, message=message, severity=Severity.INFO)
