"""What the text of radio readings needs besides columns: names of any bytes, rows that come twice."""

from __future__ import annotations

import polars as pl

from vislam2tag.common.findings import Finding, Severity
from vislam2tag.sessions.tables.raw_table import RawTable

_REPLACEMENT = "\ufffd"
SAME_READING_NS = 5_000_000
"""Rows of one transmitter this close in time are one reading: loggers turn boot time into their own with a jitter."""


def text_lines(data: bytes) -> list[str]:
    """Split a file's bytes into lines; a newline at the end starts no further line."""
    lines = data.decode("utf-8", errors="replace").split("\n")
    if lines[-1] == "":
        lines.pop()
    return lines


def level_dbm(text: pl.Expr) -> pl.Expr:
    """Read a level with either decimal mark (dBm); null where it is no number."""
    return text.str.replace(",", ".", literal=True).cast(pl.Float64, strict=False).cast(pl.Float32)


def undecodable_findings(data: bytes, raw: RawTable, column: str) -> list[Finding]:
    """Report rows whose bytes are not UTF-8 (a network may really be called U+FFFD)."""
    suspects = raw.rows.filter(pl.col(column).str.contains(_REPLACEMENT, literal=True))["row"].to_list()
    lines = data.split(b"\n") if suspects else []
    broken = [row for row in suspects if not _is_utf8(lines[row - 1])]
    if not broken:
        return []
    message = "the text is not UTF-8; the bytes that cannot be decoded are replaced by U+FFFD"
    return [Finding.at_lines("undecodable_text", raw.file, broken, message, Severity.INFO)]


def _is_utf8(line: bytes) -> bool:
    try:
        line.decode("utf-8")
    except UnicodeDecodeError:
        return False
    return True


def mark_jittered(rows: pl.DataFrame, sender: str) -> pl.DataFrame:
    """Add ``repeated``: an earlier row of the same sender is at most :data:`SAME_READING_NS` older or younger.

    Rows keep their order.
    """
    fresh = (pl.col("time_ns").diff() > SAME_READING_NS).over(sender, order_by=["time_ns", "row"])
    return rows.with_columns(repeated=~fresh.fill_null(value=True))
