"""Tables as apps write them: separated by commas or blanks, with or without a header line."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace

import polars as pl

from vislam2tag.sessions.session_files import SessionFiles
from vislam2tag.sessions.tables.raw_table import SEPARATOR, RawTable, parse_table

_BLANKS = re.compile(rb"[ \t]+")


def header_of(data: bytes) -> list[str]:
    """Names in the first line of a comma-separated table, stripped."""
    return [name.strip() for name in data.partition(b"\n")[0].decode(errors="replace").lstrip("\ufeff#").split(",")]


def app_rows(
    reading: SessionFiles, role: str, schema: Mapping[str, pl.DataType | type[pl.DataType]], *, blanks: bool = False
) -> pl.DataFrame:
    """Load and account for a role's table without header: ``row`` and the columns of ``schema``."""
    file, data = reading.load(role)
    return reading.account(role, data, delimited(data, file, schema, blanks=blanks))


def delimited(
    data: bytes,
    file: str,
    schema: Mapping[str, pl.DataType | type[pl.DataType]],
    *,
    blanks: bool = False,
    header: bool = False,
) -> RawTable:
    """Parse a table into ``row`` (1-based line) and the columns of ``schema``, in the order of its fields.

    Commas part the fields, or with ``blanks`` also these. Lines at the top that begin with ``#``, and a ``header``,
    hold no row; lines that do not parse are findings.
    """
    lines = data.split(b"\n")
    top = next((i for i, line in enumerate(lines) if not line.lstrip().startswith(b"#")), len(lines))
    top += header and top < len(lines)
    table = parse_table(b"\n".join(_one_separator(line, blanks) for line in lines[top:]), file, schema)
    return replace(
        table,
        lines=table.lines + top,
        rows=table.rows.with_columns(pl.col("row") + top),
        unreadable=(*range(1, top + 1), *_lower(table.unreadable, top)),
        findings=tuple(each.model_copy(update={"lines": _lower(each.lines, top)}) for each in table.findings),
    )


def _lower(lines: tuple[int, ...], top: int) -> tuple[int, ...]:
    """Numbers of the same lines in a file with so many more at its top."""
    return tuple(line + top for line in lines)


def _one_separator(line: bytes, blanks: bool) -> bytes:
    line = line.strip().rstrip(b",").replace(b",", b" " if blanks else SEPARATOR.encode())
    return _BLANKS.sub(SEPARATOR.encode(), line) if blanks else line
