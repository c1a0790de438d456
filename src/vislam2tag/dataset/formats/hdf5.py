"""HDF5 matrices for training (docs/datasets.md): what was heard, where, and the parts of every split, by technology."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import polars as pl

from vislam2tag import __version__
from vislam2tag.dataset.formats.left_out import SET, SPLITS
from vislam2tag.dataset.formats.registry import ExportContext, register_export
from vislam2tag.dataset.formats.samples import each_labelled, labelled, matrices, matrix_findings
from vislam2tag.dataset.model import Dataset, Split
from vislam2tag.findings import Finding

FILE = "fingerprints.h5"
NOT_HEARD_DBM = -110.0
"""Below what any phone reports, and near enough for a network: 0 or 100 would stand far off."""
_CHUNK_CELLS = 65_536
_GZIP = {"compression": "gzip", "compression_opts": 4, "shuffle": True}
_FLOATS = {"z": "z", "sigma": "sigma", "heading_deg": "heading_deg", "speed_m_s": "speed_m_s"}
_NAMES = ("building", "device", "user", "session")
UNITS = {
    "X": "dBm",
    "y": "m, BCS: x, y",
    "z": "m above the building's zero",
    "sigma": "m, one standard deviation per axis",
    "heading_deg": "degrees from the BCS x axis, counter-clockwise",
    "speed_m_s": "m/s",
    "start_ns": "ns",
    "end_ns": "ns",
}
HOLDS = {
    SET: (SPLITS,),
    "fingerprints": (
        "scan_id",
        "technology",
        "building",
        "floor",
        "x",
        "y",
        *_FLOATS,
        "device",
        "user",
        "session",
        "start_ns",
        "end_ns",
    ),
    "readings": ("scan_id", "bssid", "rssi_dbm"),
    "access_points": ("bssid", "technology", "ssid", "frequency_mhz"),
    "sessions": ("session", "building", "device", "user"),
}
EXPORT_HELP = f"{FILE}: matrix of levels, positions, floors, devices and the parts of every split, for training"


def write(dataset: Dataset, folder: Path, context: ExportContext) -> tuple[Finding, ...]:
    """Write ``fingerprints.h5`` with a group for each technology, piece by piece.

    Raises DatasetError where no fingerprint has a position.
    """
    fingerprints, findings = labelled(dataset)
    kinds = fingerprints.select(pl.col("technology").unique()).collect(engine="streaming")["technology"].sort()
    found = list(findings)
    with h5py.File(folder / FILE, "w", track_order=True) as file:
        info = dataset.info
        file.attrs.update({"name": info.name, "title": info.title, "frame": info.frame, "clock": info.clock})
        file.attrs["version"] = __version__
        for kind in kinds:
            own = fingerprints.filter(pl.col("technology") == kind)
            _technology(file.create_group(kind, track_order=True), dataset, own, kind, context)
            found += matrix_findings(dataset, own, NOT_HEARD_DBM)
    return tuple(found)


@dataclass
class _Filling:
    """Data sets of a group that are filled from the front."""

    group: h5py.Group
    at: int = 0

    def add(self, height: int, values: Mapping[str, Any]) -> None:
        """Write the next ``height`` rows of each."""
        for name, rows in values.items():
            self.group[name][self.at : self.at + height] = rows
        self.at += height


def _technology(
    group: h5py.Group, dataset: Dataset, fingerprints: pl.LazyFrame, kind: str, context: ExportContext
) -> None:
    transmitters = dataset.access_points.filter(pl.col("technology") == kind).collect()
    vocabularies = {name: _vocabulary(fingerprints, name) for name in _NAMES}
    count = fingerprints.select(pl.len()).collect(engine="streaming").item()
    _create(group, count, transmitters.height)
    group["X"].attrs["not_heard"] = NOT_HEARD_DBM
    for name, unit in UNITS.items():
        group[name].attrs["unit"] = unit
    for name, words in vocabularies.items():
        group[name].attrs["meaning"] = f"row of vocabularies/{name}; -1: not known"
        _texts(group, f"vocabularies/{name}", words)
    _texts(group, "access_points/bssid", transmitters["bssid"])
    _texts(group, "access_points/ssid", transmitters["ssid"].fill_null(""))
    group["access_points/frequency_mhz"] = transmitters["frequency_mhz"].cast(pl.Float32).to_numpy()
    filling = _Filling(group)
    for tables in each_labelled(dataset, fingerprints, context.advance):
        for rows, levels in matrices(tables, transmitters["bssid"], NOT_HEARD_DBM):
            filling.add(rows.height, {"X": levels, **_columns(rows, vocabularies)})
    _write_splits(group, dataset.splits, fingerprints)


def _create(group: h5py.Group, count: int, width: int) -> None:
    height = max(1, min(count, _CHUNK_CELLS // max(1, width)))
    chunks = (height, width) if width else None
    group.create_dataset("X", (count, width), np.float32, chunks=chunks, **(_GZIP if width else {}))
    group.create_dataset("y", (count, 2), np.float64, **_GZIP)
    group.create_dataset("floor", (count,), np.int32, **_GZIP)
    for name in _FLOATS:
        group.create_dataset(name, (count,), np.float64, **_GZIP)
    for name in _NAMES:
        group.create_dataset(name, (count,), np.int32, **_GZIP)
    for name in ("start_ns", "end_ns"):
        group.create_dataset(name, (count,), np.int64, **_GZIP)
    group.create_dataset("scan_id", (count,), h5py.string_dtype())


def _columns(rows: pl.DataFrame, vocabularies: Mapping[str, pl.Series]) -> dict[str, Any]:
    return {
        "y": rows.select("x", "y").to_numpy(),
        "floor": rows["floor"].to_numpy(),
        **{name: rows[name].fill_null(float("nan")).to_numpy() for name in _FLOATS},
        **{name: _numbers(rows[name], words) for name, words in vocabularies.items()},
        **{name: rows[name].fill_null(-1).to_numpy() for name in ("start_ns", "end_ns")},
        "scan_id": rows["scan_id"].to_list(),
    }


def _vocabulary(fingerprints: pl.LazyFrame, name: str) -> pl.Series:
    return fingerprints.select(pl.col(name).drop_nulls().unique()).collect(engine="streaming")[name].sort()


def _numbers(column: pl.Series, words: pl.Series) -> Any:
    numbered = pl.DataFrame({"word": words}).with_row_index("number")
    joined = pl.DataFrame({"word": column}).join(numbered, on="word", how="left", maintain_order="left")
    return joined["number"].cast(pl.Int32).fill_null(-1).to_numpy()


def _texts(group: h5py.Group, name: str, words: Iterable[str]) -> None:
    group.create_dataset(name, data=list(words), dtype=h5py.string_dtype())


def _write_splits(group: h5py.Group, splits: Mapping[str, Split], fingerprints: pl.LazyFrame) -> None:
    """Write ``splits/NAME/FOLD/train`` and ``test``: rows of X; fingerprints in neither part are in none."""
    ids = fingerprints.select("scan_id").with_row_index("row").collect(engine="streaming")
    for name, split in splits.items():
        own = group.create_group(f"splits/{name}", track_order=True)
        own.attrs["kind"] = split.info.kind
        for number, fold in enumerate(split.info.folds):
            # A fold's name may hold a slash, which would make a further group of it.
            each = own.create_group(f"fold_{number}", track_order=True)
            each.attrs["name"] = fold.name
            for part, members in zip(("train", "test"), split.parts(fold), strict=True):
                rows = ids.join(pl.DataFrame({"scan_id": members}), on="scan_id", how="semi")["row"]
                each.create_dataset(part, data=rows.cast(pl.Int64).to_numpy())


register_export("hdf5", write, EXPORT_HELP, HOLDS)
