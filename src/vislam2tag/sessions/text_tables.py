"""Text tables of recorders: declared by their columns, read into typed columns with exact line numbers and findings."""

from __future__ import annotations

import codecs
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple, TypeAlias

import polars as pl

from vislam2tag.common.documentation import page_of
from vislam2tag.common.files.table_files import read_csv
from vislam2tag.common.findings import Finding, Severity, at_lines_if
from vislam2tag.intake.cells import saved_by_spreadsheet, unreadable_cells, with_separator
from vislam2tag.intake.time_units import ROUNDED, have_fractions, rounded_number

_EXTRA = "_extra"
_PLAIN = r"^[^\x00-\x1f\x7f\x{fffd}]+$"
"""Text that is a word: not blank, no control characters, no undecodable bytes."""
_BLANKS = re.compile(rb"[ \t]+")
Columns: TypeAlias = Mapping[str, pl.DataType | type[pl.DataType]]
"""Names and types, in order."""


@dataclass(frozen=True)
class RawTable:
    """Contents of one raw file: ``lines = rows.height + len(unreadable)``.

    ``rows`` starts with ``row`` (int64, 1-based line), then the columns asked for, in file order; no nulls.
    ``unreadable`` names the lines that do not parse; ``findings`` already counts them.
    """

    file: str
    lines: int
    rows: pl.DataFrame
    unreadable: tuple[int, ...]
    findings: tuple[Finding, ...]


Parser: TypeAlias = Callable[[bytes, str], RawTable]
"""From a file's bytes and name to its rows."""


def ns_of_seconds(column: str) -> pl.Expr:
    """Times in seconds as ``time_ns``, nanoseconds."""
    return (pl.col(column) * 1e9).round().cast(pl.Int64).alias("time_ns")


@dataclass(frozen=True)
class FieldTable:
    """A table whose columns are known by their order, without quotes; fields may be led by blanks.

    Fields are parted by ``separator``: ``;``, ``,``, or blanks, which may come with commas. Except with ``;``, lines at
    the top that begin with ``#``, and a ``header``, are not rows.
    """

    columns: Columns
    separator: str = ";"
    header: bool = False

    def read(self, data: bytes, file: str) -> RawTable:
        """Parse a file into ``row`` and the columns; ``time_ns`` must not be negative.

        Both decimal marks are understood where they do not part fields: a file that mixes them is a finding. Text comes
        out stripped. Lines with a missing, surplus or untypable field are counted as unreadable.
        """
        if self.separator == ";":
            return _parsed(data, file, self.columns)
        lines = data.split(b"\n")
        top = next((i for i, line in enumerate(lines) if not line.lstrip().startswith(b"#")), len(lines))
        top += self.header and top < len(lines)
        table = _parsed(b"\n".join(map(self._with_semicolons, lines[top:])), file, self.columns)
        return replace(
            table,
            lines=table.lines + top,
            rows=table.rows.with_columns(pl.col("row") + top),
            unreadable=(*range(1, top + 1), *(line + top for line in table.unreadable)),
            findings=tuple(with_lines(each, (line + top for line in each.lines)) for each in table.findings),
        )

    def _with_semicolons(self, line: bytes) -> bytes:
        line = line.strip().rstrip(b",")
        return line.replace(b",", b";") if self.separator == "," else _BLANKS.sub(b";", line.replace(b",", b" "))


def header_of(data: bytes) -> list[str]:
    """Names in the first line of a comma-separated table, stripped."""
    return [name.strip() for name in data.partition(b"\n")[0].decode(errors="replace").lstrip("\ufeff#").split(",")]


def with_lines(finding: Finding, lines: Iterable[int]) -> Finding:
    """The same finding at other lines."""
    return finding.model_copy(update={"lines": tuple(lines)})


def _parsed(data: bytes, file: str, columns: Columns) -> RawTable:
    if not data:
        return _separated(data, file, _empty(columns), pl.lit(value=True))
    # The header makes the parser expect exactly these columns whatever the first line looks like, and turns blank
    # lines into empty rows, which keeps line numbers exact.
    header = ";".join((*columns, _EXTRA)).encode() + b"\n"
    data = data.removeprefix(codecs.BOM_UTF8)
    table = read_csv(
        header + data,
        separator=";",
        quote_char=None,
        schema={**columns, _EXTRA: pl.String},
        truncate_ragged_lines=True,
        ignore_errors=True,
        encoding="utf8-lossy",
        decimal_comma=b"," in data,
    )
    text = [name for name, kind in columns.items() if kind == pl.String]
    table = table.with_columns(pl.col(text).str.strip_chars()).select(_line_numbers(1), *columns, _EXTRA)
    parts = [pl.col(name).is_not_null() for name in columns] + [pl.col(_EXTRA).is_null()]
    parts += [_is_text(table[name], _PLAIN) for name in text]
    if "time_ns" in columns:
        parts.append(pl.col("time_ns") >= 0)
    times = TimeField(b";", list(columns).index("time_ns")) if "time_ns" in columns else None
    raw = _with_marks_judged(_separated(data, file, table, pl.all_horizontal(parts), times), data)
    raw = replace(raw, rows=raw.rows.drop(_EXTRA))
    return _with_separator_judged(raw, data, lambda lines: _parsed(lines, file, columns))


def _empty(columns: Columns) -> pl.DataFrame:
    return pl.DataFrame(schema={"row": pl.Int64, **columns})


def _line_numbers(first: int) -> pl.Expr:
    return pl.int_range(first, pl.len() + first, dtype=pl.Int64).alias("row")


_MIN_FRACTIONS = 10
"""More lines that are no rows, and most of the file, may have times in seconds; fewer are damaged."""


class TimeField(NamedTuple):
    """Where a line has its time."""

    separator: bytes
    place: int

    def judged(self, malformed: Finding, data: bytes) -> Finding:
        """The finding about malformed lines; about their times if these are the cause."""
        lines = data.split(b"\n")
        fields = [lines[line - 1].split(self.separator)[self.place :][:1] for line in malformed.lines]
        cells = [cell.decode(errors="replace").strip() for field in fields for cell in field]
        if not have_fractions(cells):
            return malformed
        message = (
            f"times must be whole numbers, but times such as {cells[0]} have a fraction, like seconds; these lines are "
            "skipped. Write them in the unit of the format"
        )
        return malformed.model_copy(update={"kind": "time_unit", "message": message})


def _separated(
    data: bytes, file: str, table: pl.DataFrame, readable: pl.Expr, times: TimeField | None = None
) -> RawTable:
    """Separate the rows that parse from the lines that do not, and report these.

    ``table`` has a row for each line of ``data``, in their order; ``row`` is the line's number.
    """
    good = table.select(readable.fill_null(value=False)).to_series()
    rows = table.filter(good) if not good.all() else table
    unreadable = tuple(table["row"].filter(~good).to_list())
    last = int(table["row"][-1]) if table.height else 0
    findings = unreadable_findings(data, file, last, unreadable)[::-1]
    if times is not None and len(unreadable) > max(_MIN_FRACTIONS, table.height / 2):
        findings = [times.judged(each, data) if each.kind == "malformed_lines" else each for each in findings]
    if not data:
        findings = [Finding(kind="empty_file", file=file, count=1, message="the file is empty; nothing was recorded")]
    return RawTable(file, table.height, rows, unreadable, tuple(findings))


def unreadable_findings(
    data: bytes,
    file: str,
    last: int,
    unreadable: Sequence[int],
    what: str = "these lines do not have the expected fields; they are skipped: look at the first ones",
) -> list[Finding]:
    """Report a last line that is cut off, and other lines that do not parse: ``what`` says so.

    Lines with times that a spreadsheet rounded have a finding of their own.
    """
    cut = [last] if last in unreadable and not data.endswith(b"\n") else []
    malformed = [line for line in unreadable if line not in cut]
    rounded = rounded_number(data.split(b"\n")[unreadable[-1] - 1]) if 2 * len(unreadable) > last else ""
    if rounded:
        message = f"these lines contain rounded numbers such as {rounded}; they are skipped: {ROUNDED}"
        return at_lines_if("rounded_times", file, list(unreadable), message)
    message = "the last line is incomplete, as if the recording app was killed; it is skipped"
    return [
        *at_lines_if("partial_last_line", file, cut, message),
        *at_lines_if("malformed_lines", file, malformed, what),
    ]


def line_count(data: bytes) -> int:
    """Lines of a file; a newline at the end starts no further line."""
    return data.count(b"\n") + int(not data.endswith(b"\n") and data != b"")


def _with_marks_judged(raw: RawTable, data: bytes) -> RawTable:
    """Report a file whose readable lines use both decimal marks, with the lines of the rarer mark."""
    if b"," not in data or b"." not in data:
        return raw
    lines = data.split(b"\n")
    readable = raw.rows["row"].to_list()
    comma = [row for row in readable if b"," in lines[row - 1]]
    point = [row for row in readable if b"." in lines[row - 1]]
    if not comma or not point:
        return raw
    message = "the file mixes decimal commas and points; both are read, these lines use the rarer one"
    mixed = Finding.at_lines("mixed_decimal_marks", raw.file, min(comma, point, key=len), message)
    return replace(raw, findings=(*raw.findings, mixed))


def _with_separator_judged(raw: RawTable, data: bytes, read: Callable[[bytes], RawTable]) -> RawTable:
    """Name the separator if most lines are malformed because of it; ``read`` reads others of the same form."""
    if 2 * len(raw.unreadable) <= raw.lines:
        return raw
    lines = data.split(b"\n")
    malformed = [lines[line - 1] for line in raw.unreadable]
    return replace(raw, findings=with_separator(raw.findings, malformed, lambda some: read(some).rows["row"].to_list()))


_REPLACEMENT = "\ufffd"


@dataclass(frozen=True)
class LineTable:
    """A ``;`` separated table with one column of any text, which may contain the separator.

    ``pattern`` names the parts of a line, ``columns`` makes columns of them; ``readable`` is true for rows. ``text`` is
    the column of any text; a blank before it belongs to the separator if ``blank``, which follows the line's first
    separator, has one.
    """

    pattern: str
    columns: tuple[pl.Expr, ...]
    readable: pl.Expr
    text: str

    def read(self, data: bytes, file: str) -> RawTable:
        """Parse a file into ``row`` and the columns; bytes that cannot be decoded become U+FFFD and a finding."""
        data = data.removeprefix(codecs.BOM_UTF8)
        lines = data.decode("utf-8", errors="replace").removesuffix("\n").split("\n") if data else []
        fields = pl.Series("line", lines, dtype=pl.String).str.extract_groups(self.pattern).struct.unnest()
        text = pl.col(self.text)
        stripped = pl.when(pl.col("blank") == "").then(text).otherwise(text.str.strip_prefix(" "))
        table = fields.with_columns(stripped.alias(self.text)).select(_line_numbers(1), *self.columns)
        times = TimeField(b";", self.pattern.partition("(?<time")[0].count(";"))
        raw = _with_marks_judged(_separated(data, file, table, self.readable, times), data)
        raw = _with_separator_judged(raw, data, lambda lines: self.read(lines, file))
        return replace(raw, findings=(*raw.findings, *_undecodable(data, raw, self.text)))


def _undecodable(data: bytes, raw: RawTable, column: str) -> list[Finding]:
    """Report rows whose bytes are not UTF-8 (a network may really be called U+FFFD)."""
    suspects = raw.rows.filter(pl.col(column).str.contains(_REPLACEMENT, literal=True))["row"].to_list()
    lines = data.split(b"\n") if suspects else []
    broken = [row for row in suspects if lines[row - 1].decode("utf-8", errors="ignore").encode() != lines[row - 1]]
    message = "the text is not UTF-8; the bytes that cannot be decoded are replaced by U+FFFD"
    return at_lines_if("undecodable_text", raw.file, broken, message, Severity.INFO)


_END, _SURPLUS = "_end", "_surplus"
_MARK = "|"
_WORD = r"^[A-Za-z0-9_]+$"
_TEXT = r"^[^\x00-\x1f\x7f]*$"


@dataclass(frozen=True)
class NamedTable:
    """A table with a header, of commas: columns are taken by name.

    A row without a value of the first one, a ``required`` one or one of the ``words`` is not a row. Words are texts of
    letters, digits and ``_``; ``quoted`` says that texts may be anything, in quotes.
    """

    columns: Columns
    required: tuple[str, ...] = ()
    words: tuple[str, ...] = ()
    quoted: bool = False
    severity: Severity = Severity.WARNING
    """How grave it is if a column is missing in the header."""
    page: str = "reference/phone-tables"
    """Which describes the table."""

    def read(self, data: bytes, file: str) -> RawTable:
        """Parse a file into ``row`` (1-based line; the header is line 1) and the columns.

        Fields that are empty are null. Lines with a missing, surplus or untypable field, an open quote, or without a
        required value are counted as unreadable; ``lines`` does not count the header. No finding for a table that has
        its header only.
        """
        data = data.removeprefix(codecs.BOM_UTF8)
        header, _, body = data.partition(b"\n")
        names = header.decode("utf-8", errors="replace").rstrip("\r").split(",")
        missing = [name for name in self.columns if name not in names]
        if not data:
            return _separated(data, file, _empty(self.columns), pl.lit(value=True))
        if missing or len(set(names)) < len(names):
            return self._without_header(header, body, file, missing)
        if not body:
            return RawTable(file, 0, _empty(self.columns), (), ())
        typed, odd = self._typed(body, names, file)
        table = typed.select(_line_numbers(2), *self.columns, _END)
        times = TimeField(b",", names.index("time_ns")) if "time_ns" in names else None
        raw = _separated(data, file, table, self._readable(table), times)
        return replace(raw, rows=raw.rows.drop(_END), findings=(*raw.findings, *odd))

    def _without_header(self, header: bytes, body: bytes, file: str, missing: Iterable[str]) -> RawTable:
        lines = line_count(body)
        wanted = ", ".join(missing) or "each column once"
        cure = "the file is not used: correct its first line"
        message = saved_by_spreadsheet(header, self.columns)
        message = message or f"the header must name {wanted} ({page_of(self.page)}); {cure}"
        finding = Finding(
            kind="malformed_header", file=file, count=max(lines, 1), message=message, severity=self.severity, lines=(1,)
        )
        return RawTable(file, lines, _empty(self.columns), tuple(range(2, lines + 2)), (finding,))

    def _typed(self, body: bytes, names: list[str], file: str) -> tuple[pl.DataFrame, list[Finding]]:
        """Read all lines, and report cells of whole lines that are not of their type.

        A mark at the end of each shows which have too few or too many fields.

        If every field has its type the parser converts them; otherwise texts are read and converted one by one.
        """
        body = body.replace(b"\r\n", b"\n").removesuffix(b"\n") + b"\n"
        if self.quoted and b'"' in body:
            lines = body.removesuffix(b"\n").split(b"\n")
            body = b"".join((line if line.count(b'"') % 2 == 0 else b"") + b"\n" for line in lines)
        marked = body.replace(b"\n", b"," + _MARK.encode() + b"\n")
        texts = dict.fromkeys((*names, _END), pl.String)
        try:
            return self._read(marked, {**texts, **self.columns}, ignore_errors=False), []
        except pl.exceptions.PolarsError:
            table = self._read(marked, texts, ignore_errors=True)
            return table.with_columns(self._converted()), self._unreadable(table, file)

    def _unreadable(self, table: pl.DataFrame, file: str) -> list[Finding]:
        """Report the cells of whole lines that are not numbers, by column."""
        whole = table.with_columns(_line_numbers(2)).filter(pl.col(_END) == _MARK)
        found = []
        for name, cast in self._casts().items():
            odd = whole.select(pl.col(name).is_not_null() & cast.is_null()).to_series()
            found += unreadable_cells(whole, name, odd, file, "and their lines are skipped")
        return found

    def _read(self, data: bytes, types: Columns, *, ignore_errors: bool) -> pl.DataFrame:
        header = ",".join((*types, _SURPLUS)).encode() + b"\n"
        return read_csv(
            header + data,
            quote_char='"' if self.quoted else None,
            schema={**types, _SURPLUS: pl.String},
            ignore_errors=ignore_errors,
            truncate_ragged_lines=True,
            encoding="utf8-lossy",
        )

    def _converted(self) -> list[pl.Expr]:
        """Columns with their types; a line with a field that is not of its type loses its end mark."""
        casts = self._casts()
        wrong = pl.any_horizontal(pl.col(name).is_not_null() & cast.is_null() for name, cast in casts.items())
        return [*casts.values(), pl.when(~wrong).then(_END).alias(_END)]

    def _casts(self) -> dict[str, pl.Expr]:
        """Columns of numbers by name; blanks around a number are not part of it."""
        typed = {name: kind for name, kind in self.columns.items() if kind != pl.String}
        return {name: pl.col(name).str.strip_chars().cast(kind, strict=False) for name, kind in typed.items()}

    def _readable(self, table: pl.DataFrame) -> pl.Expr:
        needed = (next(iter(self.columns)), *self.required, *self.words)
        parts = [pl.col(_END) == _MARK, *(pl.col(name).is_not_null() for name in needed)]
        for name, kind in self.columns.items():
            if kind == pl.String:
                parts.append(_is_text(table[name], _WORD if name in self.words else _TEXT))
        parts += [pl.col(name) >= 0 for name in needed if name.endswith("_ns")]
        return pl.all_horizontal(parts)


def _is_text(column: pl.Series, pattern: str) -> pl.Expr:
    """Rows whose text fits a pattern, or is empty; each different text is looked at once."""
    different = column.unique().drop_nulls()
    fitting = different.filter(different.str.contains(pattern))
    if len(fitting) == len(different):
        return pl.lit(value=True)
    return pl.col(column.name).is_in(fitting.to_list()) | pl.col(column.name).is_null()
