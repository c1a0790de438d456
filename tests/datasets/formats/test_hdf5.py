"""HDF5 matrices, read by h5py alone."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import polars as pl
import pytest

from tests.datasets.factory import SCANS, small_dataset
from tests.datasets.formats.round_trip import (
    ODD_DEVICE,
    exported,
    odd_dataset,
    signatures,
    signatures_of_hdf5,
    with_split,
)
from tests.datasets.test_technologies import JOINED
from vislam2tag.datasets.formats.hdf5 import FILE, NOT_HEARD_DBM
from vislam2tag.datasets.schema import ACCESS_POINTS, FINGERPRINTS
from vislam2tag.pipeline.datasets.build import build_dataset

KNOWN = 4 * (SCANS - 1)


def test_matrices_units_and_names(tmp_path: Path) -> None:
    dataset = odd_dataset()
    exported(dataset, "hdf5", tmp_path / "out")
    with h5py.File(tmp_path / "out" / FILE) as file:
        assert file.attrs["clock"] == "boot"
        group = file["wifi"]
        assert group["X"].shape == (KNOWN, 10)
        assert group["X"].dtype == np.float32
        assert group["X"].attrs["not_heard"] == NOT_HEARD_DBM
        assert group["y"].attrs["unit"] == "m, BCS"
        assert group["sigma"][:].tolist() == [0.1] * KNOWN
        assert set(group["vocabularies/device"].asstr()[:]) == {ODD_DEVICE, "Pixel"}
        assert group["scan_id"].asstr()[0] == "floor_0.Galaxy.walk/wifi/000000"
        assert group["start_ns"][1] - group["start_ns"][0] == 3_000_000_000
    assert signatures_of_hdf5(tmp_path / "out") == signatures(dataset)


def test_parts_of_every_fold_are_rows(tmp_path: Path) -> None:
    dataset = with_split(small_dataset(), folds=2)
    exported(dataset, "hdf5", tmp_path / "out")
    known = dataset.fingerprints.drop_nulls("x").select("scan_id", "session").collect()
    with h5py.File(tmp_path / "out" / FILE) as file:
        fold = file["wifi/splits/by_walk/fold_1"]
        assert fold.attrs["name"] == "floor_0.Pixel.walk/x"
        test = known[fold["test"][:].tolist()]
        assert set(test["session"]) == {"floor_0.Pixel.walk"}
        assert len(test) == SCANS - 2
        assert len(fold["train"]) == 3 * (SCANS - 2)
        assert not set(fold["train"][:]) & set(fold["test"][:])


def test_each_technology_has_its_own_matrix(tmp_path: Path) -> None:
    plain = small_dataset()
    beacon = pl.col("bssid").str.starts_with("00:11:22:33:01")
    kind = pl.when(beacon).then(pl.lit("ble")).otherwise("technology").alias("technology")
    walk = pl.when(pl.col("session").str.contains("Pixel")).then(pl.lit("ble")).otherwise("technology")
    tables = {
        **plain.tables,
        ACCESS_POINTS: plain.access_points.with_columns(kind),
        FINGERPRINTS: plain.fingerprints.with_columns(walk.alias("technology")),
    }
    exported(replace(plain, tables=tables), "hdf5", tmp_path / "out")
    with h5py.File(tmp_path / "out" / FILE) as file:
        assert {name: group["X"].shape for name, group in file.items()} == {
            "ble": (KNOWN // 2, 5),
            "wifi": (KNOWN // 2, 5),
        }


def test_windows_of_inertial_and_magnetic_readings(labels: Path, tmp_path: Path) -> None:
    dataset = build_dataset(labels, tmp_path / "set")
    exported(dataset, "hdf5", tmp_path / "out")
    windows = dataset.tables["imu_windows"].collect()
    magnetic = dataset.tables["magnetic"].filter(pl.col("x").is_not_null()).collect()
    assert windows.height > 50
    with h5py.File(tmp_path / "out" / FILE) as file:
        ((name, group),) = file["imu"].items()
        rate_hz = group.attrs["rate_hz"]
        assert name == f"{group['gyroscope'].shape[1]}_samples_at_{rate_hz:g}_hz"
        assert group["accelerometer"].shape == (windows.height, round(rate_hz), 3)
        assert group["accelerometer"][7].ravel().tolist() == windows["accelerometer"][7].to_list()
        assert group["displacement"][7].tolist() == [windows["displacement_x"][7], windows["displacement_y"][7]]
        assert group["window_id"].asstr()[:].tolist() == windows["window_id"].to_list()
        assert file["magnetic/X"][:, 0].tolist() == magnetic["norm_ut"].to_list()
        assert group["accelerometer"].attrs["unit"] == "m/s^2"


def test_pieces_of_any_size_make_the_same_matrices(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    exported(small_dataset(), "hdf5", tmp_path / "a")
    monkeypatch.setattr("vislam2tag.datasets.writing._CELLS_AT_ONCE", 30)
    exported(small_dataset(), "hdf5", tmp_path / "b")
    assert signatures_of_hdf5(tmp_path / "a") == signatures_of_hdf5(tmp_path / "b")


FULL_DISK = """
import resource, sys
import numpy as np
from pathlib import Path
from vislam2tag.common.files.folder import Folder
from vislam2tag.datasets.formats.hdf5 import hdf5_file

for most in (1, 1_000, 50_000, 200_000):
    resource.setrlimit(resource.RLIMIT_FSIZE, (most, resource.RLIM_INFINITY))
    try:
        with hdf5_file(Folder.at(Path(sys.argv[1])), "a.h5") as file:
            made = file.create_dataset("X", (4, 25_000), np.float32, chunks=(1, 25_000), compression="gzip")
            for row in range(4):
                made[row] = np.random.default_rng(row).random(25_000)
            file.create_group("g", track_order=True).attrs["unit"] = "m"
    except OSError as error:
        print(error.strerror)
"""


def test_a_full_disk_is_one_error(tmp_path: Path) -> None:
    """The HDF5 library by itself ends the process; a greatest size of files stands for the disk."""
    command = [sys.executable, "-c", FULL_DISK, str(tmp_path)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.splitlines() == ["File too large"] * 4
    assert not list(tmp_path.iterdir())


def test_the_matrix_of_both_technologies_has_all_transmitters(tmp_path: Path) -> None:
    exported(JOINED, "hdf5", tmp_path / "out")
    with h5py.File(tmp_path / "out" / FILE) as file:
        (group,) = file.values()
        points = group["access_points/bssid"].asstr()[:].tolist()
        levels = group["X"][:]
    known = JOINED.fingerprints.drop_nulls("x").select("scan_id")
    heard = JOINED.readings.join(known, on="scan_id", how="semi").select("scan_id", "bssid").unique().collect()
    assert points == JOINED.access_points.collect()["bssid"].to_list()
    assert (levels != NOT_HEARD_DBM).sum() == heard.height > 0
