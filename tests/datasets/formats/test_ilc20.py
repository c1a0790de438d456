"""Indoor Location Competition 2.0: folders, floors, and the real floor."""

from __future__ import annotations

import contextlib
import json
import math
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from matplotlib.path import Path as Outline

from tests.conftest import shared_folder
from tests.mutations import exaggerate, mutate
from vislam2tag.common.errors import DatasetError
from vislam2tag.common.files.archives import folder_of
from vislam2tag.common.files.folder import Folder
from vislam2tag.datasets.folder import write_dataset
from vislam2tag.datasets.format_registry import ImportContext, import_format_of
from vislam2tag.datasets.formats.ilc20 import find_sites, read
from vislam2tag.datasets.model import Dataset
from vislam2tag.sessions.formats.ilc20 import parse_trace
from vislam2tag.site.model import floor_number

T = 1574149352000


@pytest.fixture(scope="module")
def floor(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The real floor's folder."""
    scratch = Folder.at(tmp_path_factory.mktemp("ilc20"))
    return folder_of(shared_folder("ilc20") / "site2-F4.tar.xz", scratch) / "site2" / "F4"


@pytest.fixture(scope="module")
def mall(floor: Path, tmp_path_factory: pytest.TempPathFactory) -> Dataset:
    assert import_format_of(shared_folder("ilc20") / "site2-F4.tar.xz").name == "ilc20"
    assert import_format_of(floor).name == "ilc20"
    return read(floor, ImportContext(Folder.at(tmp_path_factory.mktemp("scratch"))))


def test_all_traces_of_the_real_floor(floor: Path, mall: Dataset) -> None:
    assert [(each.building, each.number, each.name) for each in mall.info.floors] == [("site2", 3, "F4")]
    sessions = mall.sessions.collect()
    assert sessions.height == 26
    assert sessions["device"].unique().to_list() == ["OPPO PBCM10"]
    assert 0.9 < (sessions["labelled_m"] / sessions["distance_m"]).min() <= 1.0  # type: ignore[operator]
    scans = [
        parse_trace(path.read_bytes(), path.name).wifi.filter(~pl.col("repeated"))["scan"].n_unique()
        for path in (floor / "path_data_files").iterdir()
    ]
    found = mall.fingerprints.filter(pl.col("technology") == "wifi").collect()
    assert found.height == sum(scans)
    assert (found["status"] == "ok").all()
    assert mall.info.clock == "unix"
    assert found["date"].min().isoformat() == "2019-11-19"  # type: ignore[union-attr]


def test_levels_and_times_of_the_real_floor(mall: Dataset) -> None:
    readings = mall.readings.collect()
    assert readings["rssi_dbm"].is_between(-110, -10).all()
    wifi = readings.filter(pl.col("scan_id").str.contains("/wifi/"))
    # A few access points come twice in a scan: once as an old result on the channel that they left.
    assert wifi.select("scan_id", "bssid").is_duplicated().sum() == 12
    assert readings["time_ns"].is_between(T * 10**6 - 60 * 10**9, T * 10**6 + 2 * 86400 * 10**9).all()


def test_fingerprints_lie_where_one_can_walk(floor: Path, mall: Dataset) -> None:
    """In the floor's outline and not in a shop; seen in a mirror or upside down they would be in the shops."""
    found = mall.fingerprints.filter(pl.col("x").is_not_null()).select("x", "y").collect().to_numpy()
    (info,) = mall.info.floors
    outline, *shops = outlines(floor, np.array([info.width_m, info.height_m]))
    assert walkable(found, outline, shops) > 0.97
    for mirrored in (np.array([[1, -1]]), np.array([[-1, 1]]), np.array([[-1, -1]])):
        size = np.array([info.width_m, info.height_m])
        assert walkable(np.where(mirrored > 0, found, size - found), outline, shops) < 0.5


def outlines(floor: Path, size_m: np.ndarray) -> list[Outline]:
    """The floor and its shops in the plan's frame: the plan covers the floor's extent in the web's Mercator map."""
    features = json.loads((floor / "geojson_map.json").read_bytes())["features"]
    rings = []
    for feature in features:
        ring = np.radians(feature["geometry"]["coordinates"][0])
        ring = ring[0] if ring.ndim == 3 else ring
        rings.append(np.column_stack((ring[:, 0], np.log(np.tan(math.pi / 4 + ring[:, 1] / 2)))))
    low, high = rings[0].min(axis=0), rings[0].max(axis=0)
    return [Outline((ring - low) / (high - low) * size_m) for ring in rings]


def walkable(position: np.ndarray, outline: Outline, shops: list[Outline]) -> float:
    inside = outline.contains_points(position)
    for shop in shops:
        inside &= ~shop.contains_points(position)
    return float(inside.mean())


def trace(folder: Path, *waypoints: tuple[int, float, float], name: str = "a", wifi: bool = True) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    lines = [f"{T + at}\tTYPE_WAYPOINT\t{x}\t{y}" for at, x, y in waypoints]
    if wifi:
        lines += [f"{T + 4000}\tTYPE_WIFI\tnet\t00:00:00:00:00:01\t-50\t2412\t{T + 3000}"]
        lines += [f"{T + 4000}\tTYPE_WIFI\tnet\t00:00:00:00:00:02\t-60\t2412\t{T + 1000}"]
    (folder / f"{name}.txt").write_text("\n".join(lines) + "\n")


def described(folder: Path, text: str = '{"map_info": {"width": 40, "height": 30}}') -> None:
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "floor_info.json").write_text(text)


def imported(path: Path, tmp_path: Path) -> Dataset:
    return write_dataset(read(path, ImportContext(Folder.at(tmp_path / "scratch"))), tmp_path / "set")


def test_readings_lie_where_the_walker_was_when_they_were_received(tmp_path: Path) -> None:
    trace(tmp_path / "in" / "mall" / "B1" / "path_data_files", (0, 0, 0), (4000, 8, 4))
    dataset = imported(tmp_path / "in", tmp_path)
    assert dataset.readings.select("bssid", "floor", "x", "y").collect().rows() == [
        ("00:00:00:00:00:02", -1, pytest.approx(2), pytest.approx(1)),
        ("00:00:00:00:00:01", -1, pytest.approx(6), pytest.approx(3)),
    ]
    (row,) = dataset.fingerprints.collect().rows(named=True)
    assert (row["scan_id"], row["building"], row["floor"], row["status"]) == ("mall.B1.a/wifi/000001", "mall", -1, "ok")
    assert row["speed_m_s"] == pytest.approx(math.hypot(8, 4) / 4, rel=0.01)
    assert [finding.kind for finding in dataset.info.findings] == ["no_floor_info"]


def test_many_floors_and_sites_with_metadata_apart(tmp_path: Path) -> None:
    for site in ("one", "two"):
        for name in ("F1", "L2", "3F", "B1"):
            trace(tmp_path / "in" / "train" / site / name, (0, 0, 0), (4000, 8, 4))
            described(tmp_path / "in" / "metadata" / site / name)
            (tmp_path / "in" / "metadata" / site / name / "floor_image.png").write_bytes(site.encode())
    dataset = imported(tmp_path / "in", tmp_path)
    assert [(each.building, each.number, each.name) for each in dataset.info.floors] == [
        (site, number, name)
        for site in ("one", "two")
        for number, name in ((-1, "B1"), (0, "F1"), (1, "L2"), (2, "3F"))
    ]
    assert {(each.width_m, each.height_m) for each in dataset.info.floors} == {(40.0, 30.0)}
    assert Path(dataset.files["plans/two.floor_-1.png"]).read_bytes() == b"two"
    found = dataset.fingerprints.select("session", "building", "floor").collect()
    assert found.rows() == [
        (f"{site}.{name}.a", site, number)
        for site in ("one", "two")
        for name, number in (("3F", 2), ("B1", -1), ("F1", 0), ("L2", 1))
    ]


def test_floors_without_a_number_are_told_and_left_out(tmp_path: Path) -> None:
    trace(tmp_path / "in" / "mall" / "F1" / "path_data_files", (0, 0, 0), (4000, 8, 4))
    trace(tmp_path / "in" / "mall" / "BM" / "path_data_files", (0, 0, 0), (4000, 8, 4))
    described(tmp_path / "in" / "mall" / "F1")
    (finding,) = find_sites(tmp_path / "in").findings
    assert (finding.kind, finding.count, finding.file) == ("unknown_floor", 1, "mall/BM/path_data_files/a.txt")


def test_walks_with_too_few_taps_or_no_readings(tmp_path: Path) -> None:
    traces = tmp_path / "in" / "mall" / "F1" / "path_data_files"
    described(tmp_path / "in" / "mall" / "F1")
    trace(traces, (0, 0, 0), name="one")
    trace(traces, name="none")
    trace(traces, (0, 0, 0), (4000, 8, 4), name="silent", wifi=False)
    dataset = imported(tmp_path / "in", tmp_path)
    assert dataset.sessions.select("name", "floor", "fingerprints", "labelled_s").collect().rows() == [
        ("none", 0, 1, 0.0),
        ("one", 0, 1, 0.0),
        ("silent", 0, 0, 4.0),
    ]
    assert (
        dataset.fingerprints.select("x", "floor", "building", "status").collect().rows()
        == [(None, None, "", "outside_frames")] * 2
    )
    findings = {finding.kind: finding.count for finding in dataset.info.findings}
    assert findings == {"too_few_taps": 2, "unlabelled_fingerprints": 2}


def test_a_waypoint_outside_the_plan_is_none(tmp_path: Path) -> None:
    trace(tmp_path / "in" / "mall" / "F1" / "path_data_files", (0, 0, 0), (2000, 90, 4), (4000, 8, 4))
    described(tmp_path / "in" / "mall" / "F1")
    dataset = imported(tmp_path / "in", tmp_path)
    assert [(finding.kind, finding.count) for finding in dataset.info.findings] == [("taps_outside_plan", 1)]
    assert dataset.readings.select(pl.col("x").max()).collect().item() == pytest.approx(6)


@pytest.mark.parametrize(
    "text",
    [
        "{}",
        "no",
        "[" * 100_000,
        '{"map_info": {"width": "wide", "height": 1}}',
        '{"map_info": {"width": 1e7, "height": 1}}',
        '{"map_info": {"width": NaN, "height": 1}}',
        '{"map_info": {"width": %s, "height": 1}}' % ("1" * 400),
    ],
)
def test_a_broken_floor_info_is_told(tmp_path: Path, text: str) -> None:
    trace(tmp_path / "mall" / "F1" / "path_data_files", (0, 0, 0))
    described(tmp_path / "mall" / "F1", text)
    with pytest.raises(DatasetError, match=r"F1/floor_info.json: cannot be read; expected"):
        find_sites(tmp_path)


@pytest.mark.slow
def test_a_damaged_trace_is_read_or_told(tmp_path: Path) -> None:
    read_whole = 0
    for seed in range(40):
        rng, folder = np.random.default_rng(seed), tmp_path / str(seed)
        traces = folder / "in" / "mall" / "F1" / "path_data_files"
        trace(traces, (0, 0, 0), (4000, 8, 4))
        data = (traces / "a.txt").read_bytes() + f"{T + 9}\tTYPE_MAGNETIC_FIELD\t1\t2\t3\t3\n".encode()
        damaged = exaggerate(mutate(data.replace(b"\t", b"; "), rng), rng).replace(b"; ", b"\t")
        (traces / "a.txt").write_bytes(damaged)
        with contextlib.suppress(DatasetError):
            imported(folder / "in", folder)
            read_whole += 1
    assert read_whole > 20


def test_no_trace(tmp_path: Path) -> None:
    (tmp_path / "readme.txt").write_text("hello")
    with pytest.raises(DatasetError, match="contains no trace"):
        find_sites(tmp_path)


NUMBERS = {
    -2: ("B2", "LG2"),
    -1: ("B1", "B", "BF", "LG", "LG1"),
    0: ("F1", "1F", "L1", "G"),
    1: ("l2", "F2"),
    3: ("F4",),
    11: ("12F",),
    None: ("BM", "M", "F", "P2", "LM", "F4b"),
}


@pytest.mark.parametrize(("number", "name"), [(number, name) for number, names in NUMBERS.items() for name in names])
def test_numbers_of_floors(name: str, number: int | None) -> None:
    assert floor_number(name) == number


def test_the_same_traces_make_the_same_bytes(tmp_path: Path) -> None:
    trace(tmp_path / "in" / "mall" / "F1" / "path_data_files", (0, 0, 0), (4000, 8, 4))
    for name in ("a", "b"):
        write_dataset(read(tmp_path / "in", ImportContext(Folder.at(tmp_path / f"scratch-{name}"))), tmp_path / name)
    for file in (tmp_path / "a").rglob("*.*"):
        assert file.read_bytes() == (tmp_path / "b" / file.relative_to(tmp_path / "a")).read_bytes()
