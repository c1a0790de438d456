"""Text tables of recorders: declared by their columns, read into typed columns with exact line numbers and findings."""

from __future__ import annotations

import codecs
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace

import polars as pl

from vislam2tag.common.files.table_files import read_csv
from vislam2tag.common.findings import Finding, Severity

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


_BLANKS = re.compile(rb"[ \t]+")


def header_of(data: bytes) -> list[str]:
    """Names in the first line of a comma-separated table, stripped."""
    return [name.strip() for name in data.partition(b"\n")[0].decode(errors="replace").lstrip("\ufeff#").split(",")]


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
