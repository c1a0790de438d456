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
from typing import Any

import polars as pl

from vislam2tag.common.files.folder import Folder
from vislam2tag.common.files.parquet_layout import check_parquet


def scan_parquet(paths: Path | Iterable[Path]) -> pl.LazyFrame:
    """Scan a Parquet file, or several with the same columns one after the other.

    Raises OSError where one cannot be opened, is no plain file, or its footer is damaged.
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
    """The content of a Parquet file that holds a table."""
    buffer = io.BytesIO()
    table.write_parquet(buffer)
    return buffer.getvalue()


def parquet_metadata(path: Path) -> dict[str, str]:
    """What a Parquet file's writer noted beside the columns; raises as :func:`read_parquet`."""
    return pl.read_parquet_metadata(_parquet_to_read(path))


def read_csv(source: Path | bytes, **options: Any) -> pl.DataFrame:
    """Read a CSV file, or its content, with :func:`polars.read_csv`'s options; raises as :func:`read_parquet`."""
    if isinstance(source, bytes):
        _refuse_lone_quote(source[-2:], options)
        return pl.read_csv(source, **options)
    _refuse_lone_quote(_end_of(source), options)
    return pl.read_csv(_to_read(source), glob=False, **options)


def scan_csv(path: Path, **options: Any) -> pl.LazyFrame:
    """Scan a CSV file with :func:`polars.scan_csv`'s options; raises OSError as :func:`scan_parquet`."""
    _refuse_lone_quote(_end_of(path), options)
    return pl.scan_csv(_to_read(path), glob=False, **options)


def write_parquet(table: pl.DataFrame | pl.LazyFrame, folder: Folder, name: str, **options: Any) -> None:
    """Write a Parquet file whole; a lazy table is streamed. Raises OSError or PolarsError if it cannot be written."""
    with folder.filling(name) as path:
        _absolute(path)  # refuses a path that Polars cannot take
        if isinstance(table, pl.LazyFrame):
            table.sink_parquet(path, **options)
        else:
            table.write_parquet(path, **options)


def write_csv(table: pl.DataFrame, folder: Folder, name: str, **options: Any) -> None:
    """Write a CSV file whole with :meth:`polars.DataFrame.write_csv`'s options; raises as :func:`write_parquet`."""
    with folder.writing(name) as file:
        table.write_csv(file, **options)


def _end_of(path: Path) -> bytes:
    """The last two bytes of a file."""
    with _to_read(path).open("rb") as file:
        file.seek(max(0, file.seek(0, os.SEEK_END) - 2))
        return file.read()


def _refuse_lone_quote(end: bytes, options: Mapping[str, Any]) -> None:
    """Raise ComputeError where a table's last field is a quote and nothing more: Polars' parser panics over that."""
    quote = (options.get("quote_char", '"') or "").encode()
    separators = (b"", b"\n", b"\r", options.get("separator", ",").encode())
    if quote and end.endswith(quote) and end.removesuffix(quote) in separators:
        raise pl.exceptions.ComputeError("its last field is an open quote")


def _to_read(path: Path) -> Path:
    if not stat.S_ISREG(path.stat().st_mode):
        raise OSError(errno.EINVAL, "not a plain file", str(path))
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
