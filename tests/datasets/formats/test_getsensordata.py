"""GetSensorData logs as data sets: degrees to metres."""

from __future__ import annotations

import contextlib
import datetime as dt
import io
import zipfile
from pathlib import Path

import numpy as np
import polars as pl
import pytest

from tests.mutations import exaggerate, mutate
from tests.sessions.getsensordata import BOOT_S, ORIGIN, OTHER, acce, posi, text, wifi
from vislam2tag.common.errors import DatasetError
from vislam2tag.common.files.folder import Folder
from vislam2tag.datasets.folder import write_dataset
from vislam2tag.datasets.format_registry import ImportContext, import_format_of
from vislam2tag.datasets.formats.getsensordata import read
from vislam2tag.datasets.model import Dataset
from vislam2tag.site.georeference import Georeference


def walk(*extra: str) -> bytes:
    return text(acce(1), posi(2, 10, 20), wifi(6, BOOT_S + 3.995), wifi(6, BOOT_S + 4.995, mac=OTHER),
                *extra, posi(12, 30, 0), acce(13))  # fmt: skip


def imported(path: Path, tmp_path: Path, origin: tuple[float, float] | None = None) -> Dataset:
    return write_dataset(read(path, ImportContext(Folder.at(tmp_path / "scratch"), origin)), tmp_path / "set")


def test_readings_in_metres_from_the_origin(tmp_path: Path) -> None:
    (tmp_path / "log.txt").write_bytes(walk())
    assert import_format_of(tmp_path / "log.txt").name == "getsensordata"
    dataset = imported(tmp_path / "log.txt", tmp_path, (ORIGIN.latitude_deg, ORIGIN.longitude_deg))
    rows = dataset.readings.select("x", "y").collect().to_numpy()
    assert rows == pytest.approx(np.array([[14, 16], [16, 14]]), abs=0.005)
    (row,) = dataset.fingerprints.collect().rows(named=True)
    assert (row["building"], row["floor"], row["device"], row["date"]) == (
        "2",
        1,
        "samsung SM-A310F",
        dt.date(2016, 7, 7),
    )
    assert row["scan_id"] == "log/wifi/000001"
    (floor,) = dataset.info.floors
    assert floor.georeference == ORIGIN
    assert dataset.info.sources[0].settings["origin"] == [40.3133, -3.4835]
    (session,) = dataset.sessions.collect().rows(named=True)
    assert session["distance_m"] == pytest.approx(np.hypot(20, 20), abs=0.01)
    assert session["started"] == dt.datetime(2016, 7, 7, 12, 31, 3)


def test_without_an_origin_it_is_the_south_west_corner(tmp_path: Path) -> None:
    (tmp_path / "log.txt").write_bytes(text(acce(1), posi(2, 10, 20), wifi(6, BOOT_S + 4), posi(12, 30, 5)))
    dataset = imported(tmp_path / "log.txt", tmp_path)
    assert dataset.info.floors[0].georeference == Georeference(latitude_deg=40.3133, longitude_deg=-3.4834)
    found = dataset.readings.select("x", "y").collect()
    assert found["x"].min() > 0  # type: ignore[operator]
    assert found["y"].min() > 0  # type: ignore[operator]


def test_floors_and_buildings_change_within_a_walk(tmp_path: Path) -> None:
    more = (posi(14, 30, 0, floor=2), wifi(17, BOOT_S + 13.0), wifi(18, BOOT_S + 16.0), posi(20, 30, 9, floor=2))
    (tmp_path / "log.txt").write_bytes(walk() + "\n".join((*more, posi(30, 0, 0, 0, 3))).encode())
    dataset = imported(tmp_path / "log.txt", tmp_path)
    assert [(floor.building, floor.number) for floor in dataset.info.floors] == [("2", 1), ("2", 2), ("3", 0)]
    found = dataset.fingerprints.select("building", "floor", "status").collect().rows()
    assert found == [("2", 1, "ok"), ("", None, "gap"), ("2", 2, "ok")]
    (session,) = dataset.sessions.collect().rows(named=True)
    assert (session["building"], session["floor"]) == ("", None)


def test_a_tap_in_another_town_is_none(tmp_path: Path) -> None:
    (tmp_path / "log.txt").write_bytes(walk(posi(9, 20_000, 0)))
    dataset = imported(tmp_path / "log.txt", tmp_path)
    assert [(finding.kind, finding.count) for finding in dataset.info.findings] == [("far_taps", 1)]
    assert dataset.readings.select(pl.col("x").max()).collect().item() < 30


def test_archives_and_folders_of_logs(tmp_path: Path) -> None:
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w") as archive:
        archive.writestr("training/T02.txt", walk())
        archive.writestr("training/T01.txt", walk())
        archive.writestr("readme.txt", "no log")
    (tmp_path / "ipin.zip").write_bytes(packed.getvalue())
    assert import_format_of(tmp_path / "ipin.zip").name == "getsensordata"
    dataset = imported(tmp_path / "ipin.zip", tmp_path)
    assert dataset.sessions.collect()["session"].to_list() == ["training.T01", "training.T02"]


@pytest.mark.parametrize(
    ("content", "said"),
    [(b"hello", "contains no log"), (text(acce(1)), "no log has a POSI row")],
)
def test_wrong_files_are_told(tmp_path: Path, content: bytes, said: str) -> None:
    (tmp_path / "a.txt").write_bytes(content)
    with pytest.raises(DatasetError, match=said):
        read(tmp_path, ImportContext(Folder.at(tmp_path / "scratch")))


def test_a_damaged_log_is_read_or_told(tmp_path: Path) -> None:
    data, read_whole = walk(posi(8, 1, 1)).replace(b";", b"; "), 0
    for seed in range(40):
        rng, folder = np.random.default_rng(seed), tmp_path / str(seed)
        folder.mkdir()
        (folder / "log.txt").write_bytes(exaggerate(mutate(data, rng), rng).replace(b"; ", b";"))
        with contextlib.suppress(DatasetError):
            imported(folder / "log.txt", folder)
            read_whole += 1
    assert 0 < read_whole < 40
