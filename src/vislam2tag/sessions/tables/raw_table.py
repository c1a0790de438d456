"""Parsing raw text tables: bytes in, typed columns with exact line numbers and findings out."""

from __future__ import annotations

import codecs
import re
from collections.abc import Mapping
from dataclasses import dataclass, replace

import polars as pl

from vislam2tag.common.files.table_files import read_csv
from vislam2tag.common.findings import Finding

SEPARATOR = ";"

_EXTRA = "_extra"
_PLAIN = re.compile("[^\\x00-\\x1f\\x7f\\ufffd]+")


@dataclass(frozen=True)
class RawTable:
    """What one raw file holds: ``lines = rows.height + len(unreadable)``.

    ``rows`` starts with ``row`` (int64, 1-based line), then the columns asked for, in file order; no nulls.
    ``unreadable`` names the lines that do not parse; ``findings`` already counts them.
    """

    file: str
    lines: int
    rows: pl.DataFrame
    unreadable: tuple[int, ...]
    findings: tuple[Finding, ...]


def ns_of_seconds(column: str) -> pl.Expr:
    """Times in seconds as ``time_ns``, nanoseconds."""
    return (pl.col(column) * 1e9).round().cast(pl.Int64).alias("time_ns")


def parse_table(data: bytes, file: str, schema: Mapping[str, pl.DataType | type[pl.DataType]]) -> RawTable:
    """Parse a ``;`` separated table without header whose fields may be led by blanks.

    ``schema`` names the columns and their types; ``time_ns`` must not be negative. Both decimal marks are
    understood, and decided by the bytes: a file that mixes them is a finding. Text columns come out stripped.
    Lines with a missing, surplus or untypable field are counted as unreadable.
    """
    if not data:
        rows = pl.DataFrame(schema={"row": pl.Int64, **schema})
        return RawTable(file, 0, rows, (), tuple(_unreadable_findings(data, file, 0, ())))
    # The header makes the parser expect exactly these columns whatever the first line looks like, and turns blank
    # lines into empty rows, which keeps line numbers exact.
    header = SEPARATOR.join((*schema, _EXTRA)).encode() + b"\n"
    data = data.removeprefix(codecs.BOM_UTF8)
    table = read_csv(
        header + data,
        separator=SEPARATOR,
        quote_char=None,
        schema={**schema, _EXTRA: pl.String},
        truncate_ragged_lines=True,
        ignore_errors=True,
        encoding="utf8-lossy",
        decimal_comma=b"," in data,
    )
    text = [name for name, kind in schema.items() if kind == pl.String]
    row = pl.int_range(1, pl.len() + 1, dtype=pl.Int64).alias("row")
    table = table.select(row, *(pl.col(name).str.strip_chars() if name in text else name for name in schema), _EXTRA)
    parts = [pl.col(name).is_not_null() for name in schema] + [pl.col(_EXTRA).is_null()]
    parts += [_is_plain(table[name]) for name in text]
    if "time_ns" in schema:
        parts.append(pl.col("time_ns") >= 0)
    return parsed_rows(data, file, table, pl.all_horizontal(parts))


def _is_plain(column: pl.Series) -> pl.Expr:
    """Rows whose text is a word: not blank, no control characters, no undecodable bytes."""
    different = column.unique().drop_nulls().to_list()
    plain = [text for text in different if _PLAIN.fullmatch(text)]
    return pl.lit(value=True) if len(plain) == len(different) else pl.col(column.name).is_in(plain)


def parsed_rows(data: bytes, file: str, table: pl.DataFrame, readable: pl.Expr) -> RawTable:
    """Separate the rows that parse from the lines that do not, and say so in findings; decimal marks are judged."""
    raw = separate(data, file, table, readable)
    return replace(raw, findings=(*raw.findings, *_mixed_marks(data, file, raw.rows)))


def separate(data: bytes, file: str, table: pl.DataFrame, readable: pl.Expr) -> RawTable:
    """Separate the rows that parse from the lines that do not, and say so in findings.

    ``table`` has a row for each line of ``data``, in their order; ``row`` is the line's number.
    """
    good = table.select(readable.fill_null(value=False)).to_series()
    rows = table.filter(good) if not good.all() else table
    rows = rows[[name for name in rows.columns if name != _EXTRA]]
    unreadable = tuple(table["row"].filter(~good).to_list())
    last = int(table["row"][-1]) if table.height else 0
    return RawTable(file, table.height, rows, unreadable, tuple(_unreadable_findings(data, file, last, unreadable)))


def _unreadable_findings(data: bytes, file: str, last: int, unreadable: tuple[int, ...]) -> list[Finding]:
    if not data:
        return [Finding(kind="empty_file", file=file, count=1, message="the file is empty; nothing was recorded")]
    findings = []
    malformed = list(unreadable)
    if malformed and malformed[-1] == last and not data.endswith(b"\n"):
        message = "the last line is cut off, as when the recorder is killed; it is left out"
        findings.append(Finding.at_lines("partial_last_line", file, [malformed.pop()], message))
    if malformed:
        message = "these lines do not have the expected fields; they are left out: look at the first ones"
        findings.insert(0, Finding.at_lines("malformed_lines", file, malformed, message))
    return findings


def _mixed_marks(data: bytes, file: str, rows: pl.DataFrame) -> list[Finding]:
    """Find files whose readable lines use both decimal marks; the lines of the rarer mark are named."""
    if b"," not in data or b"." not in data:
        return []
    lines = data.split(b"\n")
    readable = rows["row"].to_list()
    comma = [row for row in readable if b"," in lines[row - 1]]
    point = [row for row in readable if b"." in lines[row - 1]]
    if not comma or not point:
        return []
    message = "the file mixes decimal commas and points; both are understood, these lines use the rarer one"
    return [Finding.at_lines("mixed_decimal_marks", file, min(comma, point, key=len), message)]
