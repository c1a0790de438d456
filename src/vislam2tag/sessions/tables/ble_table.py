"""BLE advertisements: ``t; address; name; rss`` with t in nanoseconds and any text in name.

A beacon's identity may follow: ``; uuid; major; minor`` (iBeacon).
"""

from __future__ import annotations

import codecs
from dataclasses import replace

import polars as pl

from vislam2tag.common.findings import Finding, Severity
from vislam2tag.intake.addresses import normal_uuids
from vislam2tag.sessions.tables.radio_text import level_dbm, text_lines, undecodable_findings
from vislam2tag.sessions.tables.raw_table import RawTable, parsed_rows

_GREATEST_NUMBER = 65535
"""Of major and minor, which have 16 bits."""

# The name may hold the separator, so that the fields after it are found from the end of the line: the shortest name
# that leaves a level, with or without an identity after it.
_BLE_LINE = (
    r"^\s*(?<time_ns>\d+)\s*;(?<blank>\s*)(?<address>[^;\s]*)\s*;(?<name>.*?);\s*(?<rssi_dbm>[^;\s]+)\s*"
    r"(?:;\s*(?<uuid>[0-9A-Fa-f-]{32,36})?\s*;\s*(?<major>\d+)?\s*;\s*(?<minor>\d+)?\s*)?$"
)


def parse_ble(data: bytes, file: str) -> RawTable:
    """Parse a BLE file into ``row``, ``time_ns``, ``address``, ``name``, ``uuid``, ``major``, ``minor``, ``rssi_dbm``.

    UUIDs come out in one notation; addresses, which may be empty, and levels are as the file has them. Undecodable
    bytes become U+FFFD and a finding. An identity is whole or missing (null).
    """
    data = data.removeprefix(codecs.BOM_UTF8)
    fields = pl.Series("line", text_lines(data), dtype=pl.String).str.extract_groups(_BLE_LINE).struct.unnest()
    table = fields.select(
        pl.int_range(1, pl.len() + 1, dtype=pl.Int64).alias("row"),
        pl.col("time_ns").cast(pl.Int64, strict=False),
        pl.col("address"),
        pl.when(pl.col("blank") == "").then("name").otherwise(pl.col("name").str.strip_prefix(" ")).alias("name"),
        normal_uuids(fields["uuid"]),
        pl.col("major", "minor").cast(pl.Int32, strict=False),
        level_dbm(pl.col("rssi_dbm")),
    )
    parsed = [pl.col(name).is_not_null() for name in ("time_ns", "address", "name", "rssi_dbm")]
    given = pl.sum_horizontal(pl.col("uuid", "major", "minor").is_not_null())
    numbers = pl.max_horizontal("major", "minor").fill_null(0) <= _GREATEST_NUMBER
    raw = parsed_rows(data, file, table, pl.all_horizontal(*parsed, given.is_in((0, 3)), numbers))
    return replace(raw, findings=(*raw.findings, *undecodable_findings(data, raw, "name")))


def mark_repeated_ble(rows: pl.DataFrame) -> pl.DataFrame:
    """Add ``repeated``: an earlier row has the same transmitter and time."""
    sender = pl.struct("address", "uuid", "major", "minor", "time_ns")
    return rows.with_columns(sender.is_first_distinct().not_().alias("repeated"))


def ble_findings(rows: pl.DataFrame, file: str) -> list[Finding]:
    """Report repeated rows; ``rows`` carry ``repeated``."""
    repeated = rows.filter("repeated")["row"].to_list()
    if not repeated:
        return []
    message = "advertisements have the transmitter and time of an earlier one; each counts once"
    return [Finding.at_lines("repeated_rows", file, repeated, message, Severity.INFO)]
