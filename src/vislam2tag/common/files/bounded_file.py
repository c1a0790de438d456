"""A file of which no great piece is read at once, however much of it something in the file asks for."""

from __future__ import annotations

import io
from typing import IO


class BoundedFile(io.RawIOBase):
    """A file opened for reading that raises ``refusal`` where more than ``most`` bytes are asked for, or come, at once.

    Libraries of archives read directories and headers as large as the archive says, in one of several places.
    """

    def __init__(self, file: IO[bytes], most: int, refusal: Exception) -> None:
        self._file, self.most, self._refusal = file, most, refusal

    def read(self, size: int = -1) -> bytes:
        """As any file's, or raise the refusal."""
        if size > self.most:
            raise self._refusal
        data = bytes(self._file.read(self.most + 1 if size < 0 else size))  # a store's come as a buffer
        if len(data) > self.most:
            raise self._refusal
        return data

    def seek(self, offset: int, whence: int = 0) -> int:
        """As any file's."""
        return self._file.seek(offset, whence)

    def tell(self) -> int:
        """As any file's."""
        return self._file.tell()

    def seekable(self) -> bool:
        """True."""
        return True
