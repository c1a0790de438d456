"""What a format has no place for: counted and told, column by column."""

from __future__ import annotations

from collections.abc import Mapping

import polars as pl

from vislam2tag.findings import Finding, Severity

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


def left_out(tables: Mapping[str, pl.LazyFrame], holds: Mapping[str, frozenset[str]]) -> tuple[Finding, ...]:
    """Name, table by table, the columns with values that a format does not hold; ``count`` is the rows concerned."""
    return tuple(
        finding
        for name, table in tables.items()
        if (finding := _of_table(name, table, holds.get(name, frozenset()) | DERIVED.get(name, frozenset())))
    )


def _of_table(name: str, table: pl.LazyFrame, held: frozenset[str]) -> Finding | None:
    schema = table.collect_schema()
    missing = [column for column in schema if column not in held]
    if not missing:
        return None
    # An empty text, such as the name of the only building, says nothing that could be lost.
    said = {
        column: (pl.col(column) != "").fill_null(value=False)
        if schema[column] == pl.String
        else pl.col(column).is_not_null()
        for column in missing
    }
    counts = table.select(
        pl.any_horizontal(said.values()).sum().alias("rows"), *(test.any().alias(name) for name, test in said.items())
    )
    found = counts.collect(engine="streaming").row(0, named=True)
    lost = [column for column in missing if found[column]]
    if not lost:
        return None
    message = f"left out of {name}, as the format has no place for it: {', '.join(lost)}"
    return Finding(kind="left_out", file=name, count=found["rows"], message=message, severity=Severity.INFO)
