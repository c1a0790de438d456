"""Opens and writes tables: here only, so that no path is ever a pattern or an address.

Polars reads ``[``, ``*`` and ``?`` in a path as a pattern, ``name=value`` in a folder's name as a column, and a
relative path that begins with ``file:`` as an address. Paths here name one file each, as the system spells them.
"""

from __future__ import annotations

import errno
import io
import os
import stat
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Literal, TypeAlias, TypedDict, Unpack

import polars as pl

from vislam2tag.common.files.folder import Folder
from vislam2tag.common.files.parquet_layout import check_parquet

DataType: TypeAlias = pl.DataType | type[pl.DataType]


def scan_parquet(paths: Path | Iterable[Path]) -> pl.LazyFrame:
    """Scan a Parquet file, or several with the same columns one after the other.

    Raises OSError where one cannot be opened, is not a plain file, or its footer is damaged.
    """
    files = [paths] if isinstance(paths, Path) else paths
    return pl.scan_parquet([_parquet_to_read(path) for path in files], glob=False, hive_partitioning=False)


def read_parquet(path: Path) -> pl.DataFrame:
    """Read a Parquet file; raises OSError as :func:`scan_parquet`, PolarsError or OSError where it is damaged."""
    return _read_whole(_parquet_to_read(path), str(path))


def parquet_of_bytes(content: bytes) -> pl.DataFrame:
    """Read the content of a Parquet file; raises as :func:`read_parquet`."""
    check_parquet(content)
    return _read_whole(io.BytesIO(content), "its content")


def _read_whole(source: Path | io.BytesIO, name: str) -> pl.DataFrame:
    try:
        return pl.read_parquet(source, glob=False, hive_partitioning=False)
    except pl.exceptions.PanicException as error:  # over damage that its own checks miss
        raise OSError(errno.EBADMSG, "it is damaged", name) from error


def parquet_bytes(table: pl.DataFrame) -> bytes:
    """The content of a Parquet file that contains a table."""
    buffer = io.BytesIO()
    table.write_parquet(buffer)
    return buffer.getvalue()


def parquet_metadata(path: Path) -> dict[str, str]:
    """What a Parquet file's writer noted beside the columns; raises as :func:`read_parquet`."""
    return pl.read_parquet_metadata(_parquet_to_read(path))


class CsvOptions(TypedDict, total=False):
    """How a CSV file is read: the options of :func:`polars.read_csv` that files of ours and of others need."""

    has_header: bool
    separator: str
    quote_char: str | None
    columns: list[str]
    schema: Mapping[str, DataType]
    schema_overrides: Mapping[str, DataType]
    infer_schema: bool
    null_values: list[str]
    truncate_ragged_lines: bool
    ignore_errors: bool
    decimal_comma: bool
    encoding: Literal["utf8", "utf8-lossy"]
    n_rows: int


def read_csv(source: Path | bytes, **options: Unpack[CsvOptions]) -> pl.DataFrame:
    """Read a CSV file, or its content; raises as :func:`read_parquet`."""
    quote, separator = options.get("quote_char", '"'), options.get("separator", ",")
    if isinstance(source, bytes):
        _refuse_lone_quote(source[-2:], quote, separator)
        return pl.read_csv(source, **options)
    _refuse_lone_quote(_end_of(source), quote, separator)
    return pl.read_csv(_to_read(source), glob=False, **options)


def scan_csv(
    path: Path, schema: Mapping[str, DataType], *, has_header: bool = True, separator: str = ","
) -> pl.LazyFrame:
    """Scan a CSV file, whose columns get the names of the schema; raises OSError as :func:`scan_parquet`."""
    _refuse_lone_quote(_end_of(path), separator=separator)
    return pl.scan_csv(
        _to_read(path), glob=False, schema=schema, has_header=False, skip_rows=int(has_header), separator=separator
    )


class ParquetOptions(TypedDict, total=False):
    """How a Parquet file is written: options of :meth:`polars.DataFrame.write_parquet`."""

    compression: Literal["lz4", "snappy", "zstd"]
    row_group_size: int
    metadata: dict[str, str] | None


def write_parquet(
    table: pl.DataFrame | pl.LazyFrame, folder: Folder, name: str, **options: Unpack[ParquetOptions]
) -> None:
    """Write a Parquet file whole; a lazy table is streamed. Raises OSError or PolarsError if it cannot be written."""
    with folder.filling(name) as path:
        _absolute(path)  # refuses a path that Polars cannot take
        if isinstance(table, pl.LazyFrame):
            table.sink_parquet(path, **options)
        else:
            table.write_parquet(path, **options)


def write_csv(
    table: pl.DataFrame | pl.LazyFrame, folder: Folder, name: str, *, float_precision: int | None = None
) -> None:
    """Write a CSV file whole; a lazy table is streamed. Raises as :func:`write_parquet`."""
    with folder.writing(name) as file:
        if isinstance(table, pl.LazyFrame):
            table.sink_csv(file, float_precision=float_precision)
            return
        table.write_csv(file, float_precision=float_precision)


def _end_of(path: Path) -> bytes:
    """The last two bytes of a file."""
    with _to_read(path).open("rb") as file:
        file.seek(max(0, file.seek(0, os.SEEK_END) - 2))
        return file.read()


def _refuse_lone_quote(end: bytes, quote_char: str | None = '"', separator: str = ",") -> None:
    """Raise ComputeError where a table's last field is a quote and nothing more: Polars' parser panics over that."""
    quote = (quote_char or "").encode()
    if quote and end.endswith(quote) and end.removesuffix(quote) in (b"", b"\n", b"\r", separator.encode()):
        raise pl.exceptions.ComputeError("a quote in its last field is not closed")


def _to_read(path: Path) -> Path:
    if not stat.S_ISREG(path.stat().st_mode):
        raise OSError(errno.EINVAL, "it is not a regular file", str(path))
    return _absolute(path)


def _parquet_to_read(path: Path) -> Path:
    file = _to_read(path)
    check_parquet(file)
    return file


def _absolute(path: Path) -> Path:
    try:
        os.fspath(path).encode()
    except UnicodeEncodeError as error:
        raise OSError(errno.EILSEQ, "its path is not UTF-8; rename it", ascii(str(path))) from error
    return path.absolute()
