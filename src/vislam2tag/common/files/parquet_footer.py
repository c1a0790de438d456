"""Whether the columns of a Parquet file lie where its footer says: Polars' reader panics where they do not.

The footer is Apache Thrift in its compact protocol (parquet.thrift of github.com/apache/parquet-format, version 2.10);
fields are known by number, and only the few that say where bytes lie are looked at.
"""

from __future__ import annotations

import errno
import os
from pathlib import Path
from typing import Any

_TRUE, _FALSE, _BYTE, _I16, _I32, _I64, _DOUBLE, _BINARY, _LIST, _SET, _MAP, _STRUCT = range(1, 13)
_ROW_GROUPS, _COLUMNS, _META_DATA = 4, 1, 3
_COMPRESSED_SIZE, _DATA_PAGE_OFFSET, _DICTIONARY_PAGE_OFFSET = 7, 9, 11
_MAGIC = b"PAR1"
_DEEPEST = 32
_LONGEST = 63
"""Bits of a number."""
_END = 8
"""Bytes after the footer: its length and the magic number."""


def check_footer(path: Path) -> None:
    """Raise OSError where the footer or a column cannot lie in the file, or where it cannot be opened."""
    with path.open("rb") as file:
        size = file.seek(0, os.SEEK_END)
        file.seek(max(0, size - _END))
        end = file.read()
        start = size - _END - int.from_bytes(end[:4], "little")
        if end[4:] != _MAGIC or start < len(_MAGIC):
            raise _damage("it is no whole Parquet file", path)
        file.seek(start)
        footer = file.read(size - _END - start)
    try:
        columns = [column[_META_DATA] for group in _Compact(footer).struct()[_ROW_GROUPS] for column in group[_COLUMNS]]
        ends = [
            min(column[_DATA_PAGE_OFFSET], column.get(_DICTIONARY_PAGE_OFFSET) or column[_DATA_PAGE_OFFSET])
            + column[_COMPRESSED_SIZE]
            for column in columns
        ]
    except (LookupError, TypeError, AttributeError) as error:
        raise _damage("its footer is damaged", path) from error
    if any(not 0 <= each <= start for each in ends):
        raise _damage("it ends before its last column", path)


def _damage(why: str, path: Path) -> OSError:
    """As the system tells of a file: every command has a message for that."""
    return OSError(errno.EBADMSG, why, str(path))


class _Compact:
    """Reads values of Thrift's compact protocol; raises LookupError where they are none."""

    def __init__(self, data: bytes) -> None:
        self._data = data
        self._at = 0

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
        value = self._data[self._at]
        self._at += 1
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
        self._at += count
