"""HDF5 matrices for training (docs/reference/exporting.md): what was heard, where, and the parts of every split, by
technology.

Windows of inertial and magnetic readings stand beside, with the same splits. The file may lie on a disk which becomes
full: the HDF5 library ends the process by a segmentation fault where it cannot write what it holds as a file is closed.
So it writes to a file object that never fails: what goes wrong first is kept, all after it is dropped, and it is raised
once the library is done.
"""

from __future__ import annotations

import io
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, cast

import numpy as np
import polars as pl

from vislam2tag import __version__
from vislam2tag.common.extras import import_extra
from vislam2tag.common.files.folder import Folder
from vislam2tag.common.findings import Finding
from vislam2tag.dataset.format_registry import ExportContext, ExportFormat, register
from vislam2tag.dataset.hdf5_columns import (
    Hdf5Column,
    Hdf5Table,
    float_columns,
    side_by_side,
    text_column,
    vocabulary_column,
    whole_numbers,
    write_imu_windows,
    write_magnetic,
    write_splits,
    write_texts,
)
from vislam2tag.dataset.model import Dataset
from vislam2tag.dataset.schema import IMU_WINDOWS, MAGNETIC, SCHEMAS
from vislam2tag.dataset.writing import (
    ONE_SPLIT,
    SET,
    SPLITS,
    MatrixLosses,
    labelled_by_session,
    labelled_fingerprints,
    matrices,
)

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


FILE = "fingerprints.h5"
NOT_HEARD_DBM = -110.0
"""Below what any phone reports, and near enough for a network: 0 or 100 would stand far off."""
_LEVELS = "levels"
_NAMES = ("building", "device", "user", "session")
_FLOATS = ("z", "sigma", "heading_deg", "speed_m_s")
HOLDS = {
    SET: (SPLITS, ONE_SPLIT),
    "fingerprints": (
        "scan_id",
        "technology",
        "x",
        "y",
        "floor",
        *_FLOATS,
        *_NAMES,
        "start_ns",
        "end_ns",
    ),
    "readings": ("scan_id", "bssid", "rssi_dbm"),
    "access_points": ("bssid", "technology", "ssid", "frequency_mhz"),
    "sessions": ("session", "building", "device", "user"),
    IMU_WINDOWS: tuple(SCHEMAS[IMU_WINDOWS]),
    MAGNETIC: tuple(SCHEMAS[MAGNETIC]),
}


def write(dataset: Dataset, folder: Folder, context: ExportContext) -> tuple[Finding, ...]:
    """Write ``fingerprints.h5`` with a group for each technology, piece by piece.

    Raises DatasetError where no fingerprint has a position.
    """
    fingerprints, findings = labelled_fingerprints(dataset)
    kinds = fingerprints.select(pl.col("technology").unique()).collect(engine="streaming")["technology"].sort()
    found = list(findings)
    with hdf5_file(folder, FILE) as file:
        info = dataset.info
        file.attrs.update({"name": info.name, "title": info.title, "frame": info.frame, "clock": info.clock})
        file.attrs["version"] = __version__
        for kind in kinds:
            own = fingerprints.filter(pl.col("technology") == kind)
            found += _technology(file.create_group(kind, track_order=True), dataset, own, kind, context)
        write_imu_windows(file, dataset)
        write_magnetic(file, dataset)
    return tuple(found)


def _technology(
    group: h5py.Group, dataset: Dataset, fingerprints: pl.LazyFrame, kind: str, context: ExportContext
) -> tuple[Finding, ...]:
    transmitters = dataset.access_points.filter(pl.col("technology") == kind).collect()
    ids = fingerprints.select("scan_id").collect(engine="streaming")["scan_id"]
    names = {name: vocabulary_column(fingerprints, name) for name in _NAMES}
    levels = Hdf5Column("X", np.float32, lambda rows: rows[_LEVELS].to_numpy(), (transmitters.height,), "dBm")
    columns = [
        levels,
        side_by_side("y", ("x", "y"), "m, BCS"),
        whole_numbers("floor", np.int32),
        *float_columns(*_FLOATS),
        *(column for column, _ in names.values()),
        whole_numbers("start_ns", np.int64),
        whole_numbers("end_ns", np.int64),
        text_column("scan_id"),
    ]
    filling = Hdf5Table(group, len(ids), columns, {name: words for name, (_, words) in names.items()})
    group["X"].attrs["not_heard"] = NOT_HEARD_DBM
    write_texts(group, "access_points/bssid", transmitters["bssid"])
    write_texts(group, "access_points/ssid", transmitters["ssid"].fill_null(""))
    group["access_points/frequency_mhz"] = transmitters["frequency_mhz"].to_numpy()
    losses = MatrixLosses(NOT_HEARD_DBM)
    for tables in labelled_by_session(dataset, fingerprints, context.progress):
        losses.add(tables.readings)
        for rows, matrix in matrices(tables, transmitters["bssid"], NOT_HEARD_DBM):
            filling.add(rows.with_columns(pl.Series(_LEVELS, matrix, dtype=pl.Array(pl.Float32, matrix.shape[1]))))
    write_splits(group, dataset.splits, ids)
    return losses.findings


WRITES = ExportFormat("hdf5", HOLDS, write=write)


register(writes=WRITES)
