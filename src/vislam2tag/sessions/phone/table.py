"""Tables of the phone app: comma separated with a header, text in quotes, a line a row.

docs/reference/phone-tables.md tells more.
"""

from __future__ import annotations

import codecs
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

import polars as pl

from vislam2tag.common.files.table_files import read_csv
from vislam2tag.common.findings import Finding, Severity
from vislam2tag.sessions.tables.raw_table import RawTable, separate

_END, _SURPLUS = "_end", "_surplus"
_MARK = "|"
_WORD = r"^[A-Za-z0-9_]+$"
_TEXT = r"^[^\x00-\x1f\x7f]*$"


@dataclass(frozen=True)
class PhoneSchema:
    """Columns that a reader takes of a table by name, and their types.

    A row without a value of a ``required`` one is no row; ``words`` are texts of letters, digits and ``_``; ``quoted``
    says that texts may hold anything, in quotes.
    """

    columns: Mapping[str, pl.DataType | type[pl.DataType]]
    required: tuple[str, ...]
    words: tuple[str, ...] = ()
    quoted: bool = False
    severity: Severity = field(default=Severity.WARNING)
    """How grave it is where the header lacks a column."""
    page: str = "docs/reference/phone-tables.md"
    """Which describes the table."""


def parse_phone_table(data: bytes, file: str, schema: PhoneSchema) -> RawTable:
    """Parse a table into ``row`` (1-based line of the file; the header is line 1) and the schema's columns.

    Fields that are empty are null. Lines with a missing, surplus or untypable field, an open quote, or without a
    required value are counted as unreadable; ``lines`` does not count the header. No finding for a table that holds its
    header only.
    """
    data = data.removeprefix(codecs.BOM_UTF8)
    header, _, body = data.partition(b"\n")
    names = header.decode("utf-8", errors="replace").rstrip("\r").split(",")
    missing = [name for name in schema.columns if name not in names]
    if not data or missing or len(set(names)) < len(names):
        return _without_header(data, body, file, missing, schema)
    if not body:
        return RawTable(file, 0, _empty(schema), (), ())
    table = _typed(body, names, schema)
    row = pl.int_range(2, pl.len() + 2, dtype=pl.Int64).alias("row")
    table = table.select(row, *schema.columns, _END)
    raw = separate(data, file, table, _readable(table, schema))
    return RawTable(raw.file, raw.lines, raw.rows.drop(_END), raw.unreadable, raw.findings)


def _without_header(data: bytes, body: bytes, file: str, missing: Iterable[str], schema: PhoneSchema) -> RawTable:
    """No rows: the file is empty, or its header lacks columns."""
    if not data:
        return separate(data, file, _empty(schema), pl.lit(value=True))
    lines = body.count(b"\n") + bool(body and not body.endswith(b"\n"))
    wanted = ", ".join(missing) or "each column once"
    cure = "the file is not used: correct its first line"
    message = f"the header must name {wanted} ({schema.page}); {cure}"
    finding = Finding(
        kind="malformed_header", file=file, count=max(lines, 1), message=message, severity=schema.severity, lines=(1,)
    )
    return RawTable(file, lines, _empty(schema), tuple(range(2, lines + 2)), (finding,))


def _empty(schema: PhoneSchema) -> pl.DataFrame:
    return pl.DataFrame(schema={"row": pl.Int64, **schema.columns})


def _typed(body: bytes, names: list[str], schema: PhoneSchema) -> pl.DataFrame:
    """Read all lines; a mark at the end of each tells lines that have too few or too many fields.

    Where every field has its type the parser converts them; otherwise texts are read and converted one by one.
    """
    body = body.replace(b"\r\n", b"\n").removesuffix(b"\n") + b"\n"
    if schema.quoted and b'"' in body:
        lines = body.removesuffix(b"\n").split(b"\n")
        body = b"".join((line if line.count(b'"') % 2 == 0 else b"") + b"\n" for line in lines)
    marked = body.replace(b"\n", b"," + _MARK.encode() + b"\n")
    texts = dict.fromkeys((*names, _END), pl.String)
    try:
        return _read(marked, {**texts, **schema.columns}, schema, ignore_errors=False)
    except pl.exceptions.PolarsError:
        return _read(marked, texts, schema, ignore_errors=True).with_columns(_converted(schema))


def _read(
    data: bytes, types: Mapping[str, pl.DataType | type[pl.DataType]], schema: PhoneSchema, *, ignore_errors: bool
) -> pl.DataFrame:
    header = ",".join((*list(types), _SURPLUS)).encode() + b"\n"
    return read_csv(
        header + data,
        quote_char='"' if schema.quoted else None,
        schema={**types, _SURPLUS: pl.String},
        ignore_errors=ignore_errors,
        truncate_ragged_lines=True,
        encoding="utf8-lossy",
    )


def _converted(schema: PhoneSchema) -> list[pl.Expr]:
    """Columns with their types; in a line with a field that is not of its type the end mark goes."""
    wrong = pl.any_horizontal(
        pl.col(name).is_not_null() & pl.col(name).cast(kind, strict=False).is_null()
        for name, kind in schema.columns.items()
        if kind != pl.String
    )
    casts = [pl.col(name).cast(kind, strict=False) for name, kind in schema.columns.items() if kind != pl.String]
    return [*casts, pl.when(~wrong).then(_END).alias(_END)]


def _readable(table: pl.DataFrame, schema: PhoneSchema) -> pl.Expr:
    parts = [pl.col(_END) == _MARK, *(pl.col(name).is_not_null() for name in schema.required)]
    for name, kind in schema.columns.items():
        if kind == pl.String:
            parts.append(_is_text(table[name], _WORD if name in schema.words else _TEXT))
    parts += [pl.col(name) >= 0 for name in schema.required if name.endswith("_ns")]
    return pl.all_horizontal(parts)


def _is_text(column: pl.Series, pattern: str) -> pl.Expr:
    """Rows whose text fits a pattern, or is empty; each different text is looked at once."""
    different = column.unique().drop_nulls()
    fitting = different.filter(different.str.contains(pattern))
    if len(fitting) == len(different):
        return pl.lit(value=True)
    return pl.col(column.name).is_in(fitting.to_list()) | pl.col(column.name).is_null()
