"""An HDF5 file that is written on a disk which may become full.

The HDF5 library ends the process by a segmentation fault where it cannot write what it holds as a file is closed. So it
writes to a file object that never fails: what goes wrong first is kept, all after it is dropped, and it is raised once
the library is done.
"""

from __future__ import annotations

import io
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, cast

from vislam2tag.common.extras import import_extra
from vislam2tag.common.files.folder import Folder

if TYPE_CHECKING:
    import h5py


@contextmanager
def hdf5_file(folder: Folder, name: str) -> Iterator[h5py.File]:
    """Open a new HDF5 file for writing, whole or not at all; raises OSError if the disk took less than all of it."""
    h5py = import_extra("h5py")
    with folder.writing(name) as file:
        buffer = _PatientFile(cast("io.FileIO", cast("io.BufferedRandom", file).raw))
        try:
            with h5py.File(buffer, "w", track_order=True) as opened:
                yield opened
        finally:
            if buffer.failure:
                raise buffer.failure


class _PatientFile(io.RawIOBase):
    """A file whose writing never fails; reading gives zeros for what could not be written."""

    def __init__(self, file: io.FileIO) -> None:
        self._file = file
        self._at = 0
        self.failure: OSError | None = None
        """What went wrong first."""

    def write(self, data: memoryview) -> int:  # type: ignore[override]
        """Write all of it, or nothing where anything failed before."""
        left = memoryview(data)
        try:
            self._file.seek(self._at)
            while left and not self.failure:
                left = left[self._file.write(left) :]
        except OSError as error:
            self.failure = error
        self._at += len(data)
        return len(data)

    def readinto(self, buffer: memoryview) -> int:  # type: ignore[override]
        """Fill the buffer."""
        self._file.seek(self._at)
        data = self._file.read(len(buffer)) or b""
        buffer[:] = data.ljust(len(buffer), b"\0")
        self._at += len(buffer)
        return len(buffer)

    def seek(self, offset: int, whence: int = io.SEEK_SET) -> int:
        """As any file's; its end is that of what could be written."""
        self._at = self._file.seek(offset, whence) if whence == io.SEEK_END else offset
        return self._at

    def tell(self) -> int:
        """As any file's."""
        return self._at

    def truncate(self, size: int | None = None) -> int:
        """As any file's, but for a failure."""
        try:
            return self._file.truncate(size)
        except OSError as error:
            self.failure = self.failure or error
            return size or 0

    def flush(self) -> None:
        """Do nothing: nothing is held back."""
