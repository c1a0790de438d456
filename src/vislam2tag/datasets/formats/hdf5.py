"""HDF5 matrices for training (docs/reference/exporting.md): what was heard, where, and the parts of every split.

Groups are by technology; columns of a table become their data sets, filled piece by piece. Windows of inertial and
magnetic readings stand beside, with the same splits. The file may lie on a disk which becomes full: the HDF5 library
ends the process by a segmentation fault where it cannot write what it holds as a file is closed. So it writes to a file
object that never fails: what goes wrong first is kept, all after it is dropped, and it is raised once the library is
done.
"""

from __future__ import annotations

import io
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any, cast

import numpy as np
import numpy.typing as npt
import polars as pl

from vislam2tag import __version__
from vislam2tag.common.extras import import_extra
from vislam2tag.common.files.folder import Folder
from vislam2tag.common.findings import Finding
from vislam2tag.datasets.format_registry import ExportContext, ExportFormat, register
from vislam2tag.datasets.model import Dataset, Split
from vislam2tag.datasets.schema import IMU_WINDOWS, MAGNETIC, SCHEMAS, UNITS
from vislam2tag.datasets.writing import (
    ONE_SPLIT,
    SET,
    SPLITS,
    labelled_by_session,
    labelled_fingerprints,
    matrices,
    matrix_loss_findings,
    matrix_losses,
)

if TYPE_CHECKING:
    import h5py


UNKNOWN_NUMBER = -1
"""Stands for a name or time that is not known."""
_CHUNK_CELLS = 65_536
_GZIP = {"compression": "gzip", "compression_opts": 4, "shuffle": True}


@dataclass(frozen=True)
class Hdf5Column:
    """One data set of a group: how it is made of rows of the table."""

    name: str
    kind: npt.DTypeLike
    values: Callable[[pl.DataFrame], Any]
    """Makes the array (rows, *tail)."""
    tail: tuple[int, ...] = ()
    """Shape of one row."""
    unit: str | None = None
    meaning: str | None = None


def float_columns(*names: str) -> list[Hdf5Column]:
    """Columns of numbers; NaN where not known."""
    return [Hdf5Column(name, np.float64, partial(_known, name=name), unit=UNITS.get(name)) for name in names]


def side_by_side(name: str, parts: Sequence[str], unit: str) -> Hdf5Column:
    """Several columns of numbers side by side."""
    return Hdf5Column(
        name,
        np.float64,
        lambda rows: np.column_stack([_known(rows, part) for part in parts]),
        (len(parts),),
        unit,
        ", ".join(parts),
    )


def whole_numbers(name: str, kind: npt.DTypeLike) -> Hdf5Column:
    """A column of whole numbers."""
    return Hdf5Column(
        name,
        kind,
        lambda rows: rows[name].fill_null(UNKNOWN_NUMBER).to_numpy(),
        unit="ns" if name[-3:] == "_ns" else None,
    )


def text_column(name: str) -> Hdf5Column:
    """A column of different texts."""
    import h5py  # of an extra

    return Hdf5Column(name, h5py.string_dtype(), lambda rows: rows[name].to_list())


def vocabulary_column(table: pl.LazyFrame, name: str) -> tuple[Hdf5Column, pl.Series]:
    """A column of numbers that stand for names, and the names."""
    words = table.select(pl.col(name).drop_nulls().unique()).collect(engine="streaming")[name].sort()
    numbered = pl.DataFrame({"word": words}).with_row_index("number")

    def numbers(rows: pl.DataFrame) -> Any:
        found = pl.DataFrame({"word": rows[name]}).join(numbered, on="word", how="left", maintain_order="left")
        return found["number"].cast(pl.Int32).fill_null(UNKNOWN_NUMBER).to_numpy()

    meaning = f"row of vocabularies/{name}; {UNKNOWN_NUMBER}: not known"
    return Hdf5Column(name, np.int32, numbers, meaning=meaning), words


def _known(rows: pl.DataFrame, name: str) -> Any:
    return rows[name].fill_null(float("nan")).to_numpy()


class Hdf5Table:
    """The data sets of a group, filled from the front."""

    def __init__(
        self, group: h5py.Group, count: int, columns: Iterable[Hdf5Column], vocabularies: Mapping[str, pl.Series]
    ) -> None:
        self._group, self._columns, self._at = group, tuple(columns), 0
        for column in self._columns:
            _create(group, count, column)
        for name, words in vocabularies.items():
            write_texts(group, f"vocabularies/{name}", words)

    def add(self, rows: pl.DataFrame) -> None:
        """Write the next rows of every column."""
        span = slice(self._at, self._at + rows.height)
        for column in self._columns:
            self._group[column.name][span] = column.values(rows)
        self._at += rows.height


def _create(group: h5py.Group, count: int, column: Hdf5Column) -> None:
    import h5py

    size = int(np.prod(column.tail, dtype=np.int64))
    packed = count > 0 and size > 0 and column.kind != h5py.string_dtype()
    height = max(1, min(count, _CHUNK_CELLS // max(1, size)))
    made = group.create_dataset(
        column.name,
        (count, *column.tail),
        column.kind,
        chunks=(height, *column.tail) if packed else None,
        **(_GZIP if packed else {}),
    )
    for name in ("unit", "meaning"):
        if text := getattr(column, name):
            made.attrs[name] = text


def write_texts(group: h5py.Group, name: str, words: Iterable[str]) -> None:
    """Write a list of texts."""
    import h5py

    group.create_dataset(name, data=list(words), dtype=h5py.string_dtype())


def write_splits(group: h5py.Group, splits: Mapping[str, Split], ids: pl.Series) -> None:
    """Write ``splits/NAME/fold_N/train`` and ``test``: row numbers; rows in neither part are in none.

    ``ids`` are those of the group's rows, in order; splits that know none of them are left out.
    """
    numbered = pl.DataFrame({"id": ids}).with_row_index("row")
    for name, split in splits.items():
        if not split.groups["id"].is_in(ids.implode()).any():
            continue
        own = group.create_group(f"splits/{name}", track_order=True)
        own.attrs["kind"] = split.info.kind
        for number, fold in enumerate(split.info.folds):
            # A fold's name may hold a slash, which would make a further group of it.
            each = own.create_group(f"fold_{number}", track_order=True)
            each.attrs["name"] = fold.name
            for part, members in zip(("train", "test"), split.train_test_ids(fold), strict=True):
                rows = numbered.join(pl.DataFrame({"id": members}), on="id", how="semi", maintain_order="left")["row"]
                each.create_dataset(part, data=rows.cast(pl.Int64).to_numpy())


_WINDOW_NAMES = ("building", "device", "session")


def write_imu_windows(file: h5py.File, dataset: Dataset) -> None:
    """Write ``imu/N_samples_at_R_hz`` for each length and rate that there is: windows side by side are of one shape."""
    if IMU_WINDOWS not in dataset.tables:
        return
    table = dataset.tables[IMU_WINDOWS].with_columns(samples=pl.col("accelerometer").list.len() // 3)
    shapes = table.select("samples", "rate_hz").unique().sort("samples", "rate_hz").collect(engine="streaming")
    for samples, rate_hz in shapes.iter_rows():
        own = table.filter((pl.col("samples") == samples) & (pl.col("rate_hz") == rate_hz))
        group = file.create_group(f"imu/{samples}_samples_at_{rate_hz:g}_hz", track_order=True)
        group.attrs["rate_hz"] = rate_hz
        _write(
            group,
            dataset,
            own,
            [
                _samples("accelerometer", samples),
                _samples("gyroscope", samples),
                side_by_side("displacement", ("displacement_x", "displacement_y"), UNITS["displacement_x"]),
                *float_columns("heading_change_rad", "heading_rad"),
                side_by_side("start", ("x_start", "y_start"), "m, BCS"),
                side_by_side("end", ("x_end", "y_end"), "m, BCS"),
                *float_columns("sigma_start", "sigma_end"),
                whole_numbers("start_ns", np.int64),
            ],
        )


def write_magnetic(file: h5py.File, dataset: Dataset) -> None:
    """Write ``magnetic``: the windows that have a position."""
    if MAGNETIC not in dataset.tables:
        return
    known = dataset.tables[MAGNETIC].filter(pl.all_horizontal(pl.col("x", "y", "floor").is_not_null()))
    _write(
        file.create_group("magnetic", track_order=True),
        dataset,
        known,
        [
            side_by_side("X", ("norm_ut", "norm_deviation_ut", "vertical_ut", "horizontal_ut"), "microtesla"),
            side_by_side("y", ("x", "y"), "m, BCS"),
            *float_columns("z", "sigma"),
            whole_numbers("readings", np.int32),
            whole_numbers("start_ns", np.int64),
            whole_numbers("end_ns", np.int64),
        ],
    )


def _write(group: h5py.Group, dataset: Dataset, table: pl.LazyFrame, columns: list[Hdf5Column]) -> None:
    """Write these columns and those that all windows have."""
    ids = table.select("window_id").collect(engine="streaming")["window_id"]
    names = {name: vocabulary_column(table, name) for name in _WINDOW_NAMES}
    common = [whole_numbers("floor", np.int32), *(column for column, _ in names.values()), text_column("window_id")]
    filling = Hdf5Table(group, len(ids), [*columns, *common], {name: words for name, (_, words) in names.items()})
    for rows in _each_session(table, names["session"][1]):
        filling.add(rows)
    write_splits(group, dataset.splits, ids)


def _each_session(table: pl.LazyFrame, sessions: pl.Series) -> Iterator[pl.DataFrame]:
    for session in sessions:
        yield table.filter(pl.col("session") == session).collect()


def _samples(name: str, samples: int) -> Hdf5Column:
    def values(rows: pl.DataFrame) -> Any:
        return rows[name].explode().to_numpy().reshape(rows.height, samples, 3)

    return Hdf5Column(name, np.float32, values, (samples, 3), UNITS[name].partition(",")[0], "samples x axes")


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
    lost = np.zeros(3, dtype=np.int64)
    for tables in labelled_by_session(dataset, fingerprints, context.progress):
        lost += matrix_losses(tables.readings, NOT_HEARD_DBM)
        for rows, matrix in matrices(tables, transmitters["bssid"], NOT_HEARD_DBM):
            filling.add(rows.with_columns(pl.Series(_LEVELS, matrix, dtype=pl.Array(pl.Float32, matrix.shape[1]))))
    write_splits(group, dataset.splits, ids)
    return matrix_loss_findings(lost, NOT_HEARD_DBM)


WRITES = ExportFormat("hdf5", HOLDS, write=write)


register(writes=WRITES)
