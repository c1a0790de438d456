"""HDF5 matrices for training (docs/reference/exporting.md): readings, positions, and the parts of every split.

There is one group for each technology; columns of a table become data sets, filled piece by piece. Windows of inertial
and magnetic readings have their own groups, with the same splits. On a full disk the HDF5 library ends the process with
a segmentation fault if it cannot write its buffers while it closes a file. It therefore writes to a file object that
never fails: the first error is kept, later data are dropped, and the error is raised when the library is done.
"""

from __future__ import annotations

import io
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from itertools import chain, starmap
from typing import TYPE_CHECKING, Any, cast

import numpy as np
import numpy.typing as npt
import polars as pl

from vislam2tag import __version__
from vislam2tag.common.errors import import_extra
from vislam2tag.common.files.folder import Folder
from vislam2tag.common.findings import Finding
from vislam2tag.datasets import writing
from vislam2tag.datasets.format_registry import ExportContext, ExportFormat, register
from vislam2tag.datasets.model import Dataset, Split
from vislam2tag.datasets.schema import IMU_WINDOWS, MAGNETIC, SCHEMAS, UNITS
from vislam2tag.datasets.technologies import parts_of

if TYPE_CHECKING:
    import h5py


UNKNOWN_NUMBER = -1
"""Code of an unknown name or time."""
_CHUNK_CELLS = 65_536
_GZIP = {"compression": "gzip", "compression_opts": 4, "shuffle": True}


Hdf5Column = tuple[Any, str | None, str | None]
"""Values of some rows (rows, *tail), or a list of texts; their unit, and their meaning."""


def _known(rows: pl.DataFrame, name: str) -> Hdf5Column:
    """Numbers; NaN if unknown."""
    return rows[name].fill_null(float("nan")).to_numpy(), UNITS.get(name), None


def _side_by_side(rows: pl.DataFrame, parts: Sequence[str], unit: str) -> Hdf5Column:
    return np.column_stack([_known(rows, part)[0] for part in parts]), unit, ", ".join(parts)


def _whole_numbers(rows: pl.DataFrame, name: str) -> Hdf5Column:
    return rows[name].fill_null(UNKNOWN_NUMBER).to_numpy(), "ns" if name[-3:] == "_ns" else None, None


def _vocabulary(table: pl.LazyFrame, name: str) -> pl.Series:
    """The names in a column, which are stored as numbers."""
    return table.select(pl.col(name).drop_nulls().unique()).collect(engine="streaming")[name].sort()


def _numbers_of(rows: pl.DataFrame, name: str, words: pl.Series) -> Hdf5Column:
    """Numbers that encode names."""
    numbers = dict(zip(words, range(len(words)), strict=True))
    found = rows[name].replace_strict(numbers, default=UNKNOWN_NUMBER, return_dtype=pl.Int32)
    return found.to_numpy(), None, f"row of vocabularies/{name}; {UNKNOWN_NUMBER} means unknown"


def _fill(
    group: h5py.Group, count: int, blocks: Iterable[Mapping[str, Hdf5Column]], words: Mapping[str, pl.Series]
) -> None:
    """Fill the data sets of a group from the front; the first block may have no rows. Then write the vocabularies."""
    start = 0
    for block in blocks:
        for name, (values, *about) in block.items():
            if name not in group:
                _create(group, name, count, values, *about)
            if len(values):
                group[name][start : start + len(values)] = values
        start += len(next(iter(block.values()))[0])
    for name, series in words.items():
        write_texts(group, f"vocabularies/{name}", series)


def _create(group: h5py.Group, name: str, count: int, values: Any, unit: str | None, meaning: str | None) -> None:
    import h5py

    texts = isinstance(values, list)
    tail = () if texts else values.shape[1:]
    size = int(np.prod(tail, dtype=np.int64))
    packed = count > 0 and size > 0 and not texts
    height = max(1, min(count, _CHUNK_CELLS // max(1, size)))
    made = group.create_dataset(
        name,
        (count, *tail),
        h5py.string_dtype() if texts else values.dtype,
        chunks=(height, *tail) if packed else None,
        **(_GZIP if packed else {}),
    )
    made.attrs.update({key: text for key, text in (("unit", unit), ("meaning", meaning)) if text})


def write_texts(group: h5py.Group, name: str, words: Iterable[str]) -> None:
    """Write a list of texts."""
    import h5py

    group.create_dataset(name, data=list(words), dtype=h5py.string_dtype())


def write_splits(group: h5py.Group, splits: Mapping[str, Split], ids: pl.Series) -> None:
    """Write ``splits/NAME/fold_N/train`` and ``test`` as row numbers; rows in neither part are in none.

    ``ids`` are those of the group's rows, in order; splits without any of them are skipped.
    """
    numbered = pl.DataFrame({"id": ids}).with_row_index("row")
    for name, split in splits.items():
        if not split.groups["id"].is_in(ids.implode()).any():
            continue
        own = group.create_group(f"splits/{name}", track_order=True)
        own.attrs["kind"] = split.info.kind
        for number, fold in enumerate(split.info.folds):
            # A fold's name may contain a slash, which would create another group.
            each = own.create_group(f"fold_{number}", track_order=True)
            each.attrs["name"] = fold.name
            for part, members in zip(("train", "test"), split.train_test_ids(fold), strict=True):
                rows = numbered.join(pl.DataFrame({"id": members}), on="id", how="semi", maintain_order="left")["row"]
                each.create_dataset(part, data=rows.cast(pl.Int64).to_numpy())


_WINDOW_NAMES = ("building", "device", "session")


def write_imu_windows(file: h5py.File, dataset: Dataset) -> None:
    """Write ``imu/N_samples_at_R_hz`` for each length and rate, so that all windows in an array have one shape."""
    if IMU_WINDOWS not in dataset.tables:
        return
    table = dataset.tables[IMU_WINDOWS].with_columns(samples=pl.col("accelerometer").list.len() // 3)
    shapes = table.select("samples", "rate_hz").unique().sort("samples", "rate_hz").collect(engine="streaming")
    for samples, rate_hz in shapes.iter_rows():
        own = table.filter((pl.col("samples") == samples) & (pl.col("rate_hz") == rate_hz))
        group = file.create_group(f"imu/{samples}_samples_at_{rate_hz:g}_hz", track_order=True)
        group.attrs["rate_hz"] = rate_hz

        def columns(rows: pl.DataFrame, samples: int = samples) -> dict[str, Hdf5Column]:
            return {
                **{name: _samples(rows, name, samples) for name in ("accelerometer", "gyroscope")},
                "displacement": _side_by_side(rows, ("displacement_x", "displacement_y"), UNITS["displacement_x"]),
                **{name: _known(rows, name) for name in ("heading_change_rad", "heading_rad")},
                **{name: _side_by_side(rows, (f"x_{name}", f"y_{name}"), "m, BCS") for name in ("start", "end")},
                **{name: _known(rows, name) for name in ("sigma_start", "sigma_end")},
                "start_ns": _whole_numbers(rows, "start_ns"),
            }

        _write(group, dataset, own, columns)


def write_magnetic(file: h5py.File, dataset: Dataset) -> None:
    """Write ``magnetic``: the windows that have a position."""
    if MAGNETIC not in dataset.tables:
        return
    known = dataset.tables[MAGNETIC].filter(pl.all_horizontal(pl.col("x", "y", "floor").is_not_null()))

    def columns(rows: pl.DataFrame) -> dict[str, Hdf5Column]:
        parts = ("norm_ut", "norm_deviation_ut", "vertical_ut", "horizontal_ut")
        return {
            "X": _side_by_side(rows, parts, "microtesla"),
            "y": _side_by_side(rows, ("x", "y"), "m, BCS"),
            **{name: _known(rows, name) for name in ("z", "sigma")},
            **{name: _whole_numbers(rows, name) for name in ("readings", "start_ns", "end_ns")},
        }

    _write(file.create_group("magnetic", track_order=True), dataset, known, columns)


def _write(
    group: h5py.Group,
    dataset: Dataset,
    table: pl.LazyFrame,
    columns: Callable[[pl.DataFrame], dict[str, Hdf5Column]],
) -> None:
    """Write these columns and those of all windows."""
    ids = table.select("window_id").collect(engine="streaming")["window_id"]
    words = {name: _vocabulary(table, name) for name in _WINDOW_NAMES}

    def block(rows: pl.DataFrame) -> dict[str, Hdf5Column]:
        names = {name: _numbers_of(rows, name, series) for name, series in words.items()}
        common = {
            "floor": _whole_numbers(rows, "floor"),
            **names,
            "window_id": (rows["window_id"].to_list(), None, None),
        }
        return columns(rows) | common

    sessions = (table.filter(pl.col("session") == session).collect() for session in words["session"])
    _fill(group, len(ids), map(block, chain([table.head(0).collect()], sessions)), words)
    write_splits(group, dataset.splits, ids)


def _samples(rows: pl.DataFrame, name: str, samples: int) -> Hdf5Column:
    values = rows[name].explode().to_numpy() if rows.height else np.empty(0, dtype=np.float32)
    return values.reshape(rows.height, samples, 3), UNITS[name].partition(",")[0], "samples x axes"


@contextmanager
def hdf5_file(folder: Folder, name: str) -> Iterator[h5py.File]:
    """Open a new HDF5 file for writing, whole or not at all; raises OSError if the disk did not take all of it."""
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
    """A file that never fails to write; reading gives zeros for data that could not be written."""

    def __init__(self, file: io.FileIO) -> None:
        self._file = file
        self._at = 0
        self.failure: OSError | None = None
        """The first error."""

    def write(self, data: memoryview) -> int:  # type: ignore[override]
        """Write all of it, or nothing after an earlier error."""
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
        """As for any file; its end is the end of the written data."""
        self._at = self._file.seek(offset, whence) if whence == io.SEEK_END else offset
        return self._at

    def tell(self) -> int:
        """As for any file."""
        return self._at

    def truncate(self, size: int | None = None) -> int:
        """As for any file, except after an error."""
        try:
            return self._file.truncate(size)
        except OSError as error:
            self.failure = self.failure or error
            return size or 0

    def flush(self) -> None:
        """Do nothing, because nothing is buffered."""


FILE = "fingerprints.h5"
NOT_HEARD_DBM = -110.0
"""Below all levels that phones report, and close to them for a network; 0 or 100 would be far away."""
_NAMES = ("building", "device", "user", "session")
_FLOATS = ("z", "sigma", "heading_deg", "speed_m_s")
HOLDS = {
    writing.SET: (writing.SPLITS, writing.ONE_SPLIT),
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

    Raises DatasetError if no fingerprint has a position.
    """
    fingerprints, findings = writing.labelled_fingerprints(dataset)
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
    transmitters = dataset.access_points.filter(pl.col("technology").is_in(parts_of(kind))).collect()
    ids = fingerprints.select("scan_id").collect(engine="streaming")["scan_id"]
    words = {name: _vocabulary(fingerprints, name) for name in _NAMES}
    lost = np.zeros(3, dtype=np.int64)

    def block(rows: pl.DataFrame, levels: npt.NDArray[np.float32]) -> dict[str, Hdf5Column]:
        return {
            "X": (levels, "dBm", None),
            "y": _side_by_side(rows, ("x", "y"), "m, BCS"),
            "floor": _whole_numbers(rows, "floor"),
            **{name: _known(rows, name) for name in _FLOATS},
            **{name: _numbers_of(rows, name, series) for name, series in words.items()},
            **{name: _whole_numbers(rows, name) for name in ("start_ns", "end_ns")},
            "scan_id": (rows["scan_id"].to_list(), None, None),
        }

    def blocks() -> Iterator[dict[str, Hdf5Column]]:
        yield block(fingerprints.head(0).collect(), np.empty((0, transmitters.height), dtype=np.float32))
        for tables in writing.labelled_by_session(dataset, fingerprints, context.progress):
            np.add(lost, writing.matrix_losses(tables.readings, NOT_HEARD_DBM), out=lost)
            yield from starmap(block, writing.matrices(tables, transmitters["bssid"], NOT_HEARD_DBM))

    _fill(group, len(ids), blocks(), words)
    group["X"].attrs["not_heard"] = NOT_HEARD_DBM
    write_texts(group, "access_points/bssid", transmitters["bssid"])
    write_texts(group, "access_points/ssid", transmitters["ssid"].fill_null(""))
    group["access_points/frequency_mhz"] = transmitters["frequency_mhz"].to_numpy()
    write_splits(group, dataset.splits, ids)
    return writing.matrix_loss_findings(lost, NOT_HEARD_DBM)


register(writes=ExportFormat("hdf5", HOLDS, write=write))
