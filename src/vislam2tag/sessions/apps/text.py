"""Tables as apps write them: separated by commas or blanks, with or without a header line."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Literal

import polars as pl

from vislam2tag.sessions.tables.raw_table import SEPARATOR, RawTable, parse_table

_BLANKS = re.compile(rb"[ \t]+")


@dataclass(frozen=True)
class TextLayout:
    """How an app writes a table: what parts its fields, and whether names stand above them."""

    separator: Literal["comma", "blank", "either"]
    has_header: bool = False


def header_of(data: bytes) -> list[str]:
    """Names in the first line of a comma-separated table, stripped."""
    return [name.strip() for name in data.partition(b"\n")[0].decode(errors="replace").lstrip("\ufeff#").split(",")]


def delimited(
    data: bytes, file: str, schema: Mapping[str, pl.DataType | type[pl.DataType]], layout: TextLayout
) -> RawTable:
    """Parse a table into ``row`` (1-based line) and the columns of ``schema``, in the order of its fields.

    Lines at the top that begin with ``#``, and the header, hold no row; lines that do not parse are findings.
    """
    lines = data.split(b"\n")
    top = next((i for i, line in enumerate(lines) if not line.lstrip().startswith(b"#")), len(lines))
    top += layout.has_header and top < len(lines)
    body = b"\n".join(_one_separator(line, layout) for line in lines[top:])
    table = parse_table(body, file, schema)
    moved = tuple(replace_lines(finding.lines, top) for finding in table.findings)
    findings = tuple(
        finding.model_copy(update={"lines": at}) for finding, at in zip(table.findings, moved, strict=True)
    )
    return replace(
        table,
        lines=table.lines + top,
        rows=table.rows.with_columns(pl.col("row") + top),
        unreadable=(*range(1, top + 1), *replace_lines(table.unreadable, top)),
        findings=findings,
    )


def replace_lines(lines: tuple[int, ...], top: int) -> tuple[int, ...]:
    """Numbers of the same lines in a file with so many more at its top."""
    return tuple(line + top for line in lines)


def _one_separator(line: bytes, layout: TextLayout) -> bytes:
    line = line.strip().rstrip(b",")
    if layout.separator != "blank":
        line = line.replace(b",", SEPARATOR.encode() if layout.separator == "comma" else b" ")
    return line if layout.separator == "comma" else _BLANKS.sub(SEPARATOR.encode(), line)
