"""Whether a Parquet file's footer and pages say what can be: where they lie, Polars' reader panics or ends the process.

Both are Apache Thrift in its compact protocol (parquet.thrift of github.com/apache/parquet-format, version 2.10).
Fields are identified by number. Only the few that say where bytes are, and how many values they contain, are read.
"""

from __future__ import annotations

import errno
import io
import os
from collections.abc import Mapping
from pathlib import Path
from typing import IO, Any, TypeAlias

_TRUE, _FALSE, _BYTE, _I16, _I32, _I64, _DOUBLE, _BINARY, _LIST, _SET, _MAP, _STRUCT = range(1, 13)
_ROW_GROUPS, _COLUMNS, _META_DATA = 4, 1, 3
_VALUES, _COMPRESSED_SIZE, _DATA_PAGE_OFFSET, _DICTIONARY_PAGE_OFFSET = 5, 7, 9, 11
_PAGE_SIZE, _COMPRESSED_PAGE_SIZE = 2, 3
_DATA_PAGE, _INDEX_PAGE, _DICTIONARY_PAGE, _DATA_PAGE_V2 = 5, 6, 7, 8
_VALUES_OF_PAGE = 1
_MAGIC = b"PAR1"
_DEEPEST = 32
_LONGEST = 63
"""Bits of a number."""
_END = 8
"""Bytes after the footer: its length and the magic number."""
_LONGEST_HEADER = 1 << 16
"""Bytes before a page."""
_VALUE_BYTES = 8
_SMALL_BYTES = 256 << 20
_MOST_TIMES = 500
"""A table may be that many times its file's size in memory; what was measured has 2 to 60 times."""

_Fields: TypeAlias = Mapping[int, Any]


def check_parquet(source: Path | bytes) -> None:
    """Raise OSError where the footer or pages of a file, or its content, cannot be right or hold too much.

    A table of more than 256 MB in memory must not be over 500 times its file's size: a file of some kilobytes can say
    that one value is repeated for millions of rows.
    """
    path = source if isinstance(source, Path) else Path("its content")
    with source.open("rb") if isinstance(source, Path) else io.BytesIO(source) as file:
        length = file.seek(0, os.SEEK_END)
        file.seek(max(0, length - _END))
        end = file.read(_END)
        start = length - _END - int.from_bytes(end[: -len(_MAGIC)], "little")
        if not end.endswith(_MAGIC) or start < len(_MAGIC):
            raise _damage("it is not a complete Parquet file", path)
        file.seek(start)
        columns = _columns(file.read(length - _END - start), path)
        size = sum(_size_of(column, file, start, path) for column in columns)
    if size > max(_SMALL_BYTES, _MOST_TIMES * length):
        raise _damage(f"{length} bytes that claim to contain a table of {size / 1e9:.1f} GB", path)


def _columns(footer: bytes, path: Path) -> list[_Fields]:
    """What the footer says of each piece of a column."""
    try:
        groups = _Compact(footer).struct()[_ROW_GROUPS]
        return [column[_META_DATA] for group in groups for column in group[_COLUMNS]]
    except (LookupError, TypeError, AttributeError) as error:
        raise _damage("its footer is damaged", path) from error


def _size_of(column: _Fields, file: IO[bytes], end: int, path: Path) -> int:
    """Bytes that a piece of a column takes in memory, by its pages, which contain as many values as the footer says."""
    try:
        first = column[_DATA_PAGE_OFFSET]
        at = min(first, column.get(_DICTIONARY_PAGE_OFFSET) or first)
        last = at + column[_COMPRESSED_SIZE]
        wanted = column[_VALUES]
        if not len(_MAGIC) <= at <= last <= end:
            raise _damage("it ends before its last column", path)
    except (LookupError, TypeError) as error:
        raise _damage("its footer is damaged", path) from error
    size = values = 0
    try:
        while at < last:
            file.seek(at)
            reader = _Compact(file.read(_LONGEST_HEADER))
            page = reader.struct()
            at += reader.at + page[_COMPRESSED_PAGE_SIZE]
            size += page[_PAGE_SIZE]
            values += _values_of(page)
            if page[_COMPRESSED_PAGE_SIZE] < 0 or page[_PAGE_SIZE] < 0 or values > wanted:
                raise LookupError(at)
    except (LookupError, TypeError, AttributeError) as error:
        raise _damage("one of its pages is damaged", path) from error
    if at > end or values != wanted:  # early writers took the pieces for some bytes shorter than they are
        raise _damage("one of its pages is damaged", path)
    return max(size, values * _VALUE_BYTES)


def _values_of(page: _Fields) -> int:
    """How many values of the column a page contains: none if it is its dictionary or an index."""
    if _DICTIONARY_PAGE in page:
        if not 0 <= page[_DICTIONARY_PAGE][_VALUES_OF_PAGE] <= 8 * page[_PAGE_SIZE]:
            raise LookupError(_DICTIONARY_PAGE)
        return 0
    if _INDEX_PAGE in page:
        return 0
    values = (page.get(_DATA_PAGE) or page[_DATA_PAGE_V2])[_VALUES_OF_PAGE]
    if values < 0:
        raise LookupError(_VALUES_OF_PAGE)
    return int(values)


def _damage(why: str, path: Path) -> OSError:
    """As the system reports errors of a file: every command has a message for that."""
    return OSError(errno.EBADMSG, why, str(path))


class _Compact:
    """Reads values of Thrift's compact protocol; raises LookupError where they are none."""

    def __init__(self, data: bytes) -> None:
        self._data = data
        self.at = 0
        """How many bytes were read."""

    def struct(self, depth: int = 0) -> dict[int, Any]:
        """A structure's fields by number."""
        fields: dict[int, Any] = {}
        number = 0
        while head := self._byte():
            number = number + (head >> 4) if head >> 4 else self._zigzag()
            kind = head & 0xF
            fields[number] = kind == _TRUE if kind in (_TRUE, _FALSE) else self._value(kind, depth)
        return fields

    def _value(self, kind: int, depth: int) -> Any:
        if depth > _DEEPEST:
            raise LookupError(depth)
        if kind in (_TRUE, _FALSE, _BYTE):  # as an element of a list
            return self._byte()
        if kind in (_I16, _I32, _I64):
            return self._zigzag()
        if kind == _DOUBLE:
            return self._skip(8)
        if kind == _BINARY:
            return self._skip(self._varint())
        if kind in (_LIST, _SET):
            head = self._byte()
            count = head >> 4 if head >> 4 < 15 else self._varint()
            return [self._value(head & 0xF, depth + 1) for _ in range(min(count, len(self._data)))]
        if kind == _STRUCT:
            return self.struct(depth + 1)
        raise LookupError(kind)

    def _byte(self) -> int:
        value = self._data[self.at]
        self.at += 1
        return value

    def _varint(self) -> int:
        value = shift = 0
        while (byte := self._byte()) & 0x80:
            value |= (byte & 0x7F) << shift
            shift += 7
            if shift > _LONGEST:
                raise LookupError(shift)
        return value | byte << shift

    def _zigzag(self) -> int:
        value = self._varint()
        return value >> 1 ^ -(value & 1)

    def _skip(self, count: int) -> None:
        self.at += count
