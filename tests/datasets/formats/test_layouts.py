"""Layouts of fingerprint tables, written to their public documentation, equal a reading by pandas."""

from __future__ import annotations

import math
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import polars as pl
import pytest

from vislam2tag import api
from vislam2tag.intake.columns import COLUMNS_FILE
from vislam2tag.pipeline.datasets.import_export import ImportOptions, import_format

POINTS = 6
ADDRESSES = [f"02:1a:00:00:00:0{number}" for number in range(1, POINTS + 1)]
WAPS = [f"WAP00{number}" for number in range(1, POINTS + 1)]
Layout = Callable[[Path], tuple[Path, str | None, pd.DataFrame]]
"""Writes files into a folder. Returns what to import, the ``columns.toml`` that it needs, and what pandas reads: x, y,
floor, part, and a column of levels for each access point, NaN if it was not heard."""


def survey(seed: int, names: list[str], rows: int = 24) -> pd.DataFrame:
    random = np.random.default_rng(seed)
    level = random.integers(-95, -40, (rows, POINTS)).astype(float)
    level[random.random(level.shape) < 0.4] = math.nan
    level[:, 0] = -40 - np.arange(rows)  # no two rows are alike
    place = {"x": random.uniform(0, 50, rows).round(2), "y": random.uniform(0, 30, rows).round(2)}
    return pd.DataFrame({**place, "floor": random.integers(-1, 4, rows)}).join(pd.DataFrame(level, columns=names))


def filled(frame: pd.DataFrame, names: list[str]) -> pd.DataFrame:
    return frame.assign(**{name: frame[name].fillna(100).astype(int) for name in names})


def heard_only(frame: pd.DataFrame, names: list[str], not_heard: float = 100) -> pd.DataFrame:
    return frame.assign(**{name: frame[name].replace(not_heard, math.nan) for name in names})


def ujiindoorloc(folder: Path) -> tuple[Path, str | None, pd.DataFrame]:
    parts = []
    for seed, (name, part) in enumerate((("trainingData.csv", "train"), ("validationData.csv", "test"))):
        frame = filled(survey(seed, WAPS), WAPS).rename(columns={"x": "LONGITUDE", "y": "LATITUDE", "floor": "FLOOR"})
        frame["FLOOR"] = frame["FLOOR"].abs()
        frame = frame[[*WAPS, "LONGITUDE", "LATITUDE", "FLOOR"]].assign(
            BUILDINGID=0, SPACEID=1, RELATIVEPOSITION=2, USERID=3, PHONEID=13, TIMESTAMP=1371713733 + np.arange(24)
        )
        frame.to_csv(folder / name, index=False)
        read = pd.read_csv(folder / name).rename(columns={"LONGITUDE": "x", "LATITUDE": "y", "FLOOR": "floor"})
        parts.append(heard_only(read, WAPS).assign(part=part))
    return folder, None, pd.concat(parts)[["x", "y", "floor", "part", *WAPS]]


def sodindoorloc(folder: Path) -> tuple[Path, str | None, pd.DataFrame]:
    parts, macs = [], [f"MAC{number}" for number in range(1, POINTS + 1)]
    for seed, (name, part) in enumerate((("Training_CETC331.csv", "train"), ("Testing_CETC331.csv", "test"))):
        frame = filled(survey(seed, macs), macs).rename(columns={"x": "ECoord", "y": "NCoord", "floor": "FloorID"})
        frame = frame[[*macs, "ECoord", "NCoord", "FloorID"]]
        frame.assign(BuildingID=1, SceneID=1, UserID=4, PhoneID=3, SampleTimes=1).to_csv(folder / name, index=False)
        read = pd.read_csv(folder / name).rename(columns={"ECoord": "x", "NCoord": "y", "FloorID": "floor"})
        read = heard_only(read, macs).assign(part=part)[["x", "y", "floor", "part", *macs]]
        parts.append(read.rename(columns={mac: f"CETC331 {mac}" for mac in macs}))
    return folder, None, pd.concat(parts)


def dungeon_assistant(folder: Path) -> tuple[Path, str | None, pd.DataFrame]:
    path = folder / "walk.csv"
    frame = survey(3, ADDRESSES).rename(columns={"x": "1", "y": "3", "floor": "2"})
    frame["write_time"] = pd.date_range("2023-12-06 22:25:14", periods=24, freq="s").strftime("%Y-%m-%d %H:%M:%S")
    frame[["1", "2", "3", "write_time", *ADDRESSES]].to_csv(path, index=False)
    read = pd.read_csv(path).rename(columns={"1": "x", "3": "y"}).assign(floor=0, part=None)
    toml = 'x = "1"\ny = "3"\nz = "2"\ntime = "write_time"\nzone = "Europe/Berlin"\naccess_points = "??:*"\n'
    return path, toml, read[["x", "y", "floor", "part", *ADDRESSES]]


def tuji1(folder: Path) -> tuple[Path, str | None, pd.DataFrame]:
    parts = []
    for seed, (name, part) in enumerate((("training", "train"), ("testing", "test"))):
        frame = filled(survey(seed, WAPS), WAPS)
        frame[WAPS].to_csv(folder / f"RSS_{name}.csv", index=False, header=False)
        places = frame[["x", "y"]].assign(z=0, floor=0, building=0, phone=1)
        places.to_csv(folder / f"Coordinates_{name}.csv", index=False, header=False)
        levels = heard_only(pd.read_csv(folder / f"RSS_{name}.csv", header=None, names=WAPS), WAPS)
        columns = ["x", "y", "z", "floor", "building", "phone"]
        read = pd.read_csv(folder / f"Coordinates_{name}.csv", header=None, names=columns)
        parts.append(read[["x", "y", "floor"]].assign(part=part).join(levels))
    return folder, None, pd.concat(parts)


def trn_tst(folder: Path) -> tuple[Path, str | None, pd.DataFrame]:
    parts = []
    for seed, (name, part) in enumerate((("trn", "train"), ("tst", "test"))):
        frame = filled(survey(seed, WAPS), WAPS)
        frame[WAPS].to_csv(folder / f"TUT3_{name}rss.csv", index=False, header=False)
        places = frame[["x", "y"]].assign(height=3.7, floor=frame["floor"], building=0)
        places.to_csv(folder / f"TUT3_{name}crd.csv", index=False, header=False)
        named = [f"TUT3 {wap}" for wap in WAPS]
        levels = heard_only(pd.read_csv(folder / f"TUT3_{name}rss.csv", header=None, names=named), named)
        columns = ["x", "y", "height", "floor", "building"]
        read = pd.read_csv(folder / f"TUT3_{name}crd.csv", header=None, names=columns)
        parts.append(read[["x", "y", "floor"]].assign(part=part).join(levels))
    return folder, None, pd.concat(parts)


def plain_wide(folder: Path) -> tuple[Path, str | None, pd.DataFrame]:
    path, points = folder / "survey.csv", [f"AP{number}" for number in range(POINTS)]
    survey(5, points).to_csv(path, index=False)
    return path, None, pd.read_csv(path).assign(part=None)


def long_table(folder: Path) -> tuple[Path, str | None, pd.DataFrame]:
    path = folder / "readings.csv"
    long = survey(6, ADDRESSES).melt(["x", "y", "floor"], ADDRESSES, "bssid", "rssi").dropna()
    long.sort_values(["x", "rssi"]).to_csv(path, index=False)
    read = pd.read_csv(path).pivot(index=["x", "y", "floor"], columns="bssid", values="rssi").reset_index()
    return path, None, read.assign(part=None)


LATITUDE, LONGITUDE = 50.0, 6.0


def wigle(folder: Path) -> tuple[Path, str | None, pd.DataFrame]:
    path = folder / "WigleWifi.csv"
    frame = survey(7, ADDRESSES).drop(columns="floor")
    frame = frame.assign(CurrentLatitude=LATITUDE + frame["y"] / 1e5, CurrentLongitude=LONGITUDE + frame["x"] / 1e5)
    frame["FirstSeen"] = [f"2023-11-14 22:{number:02d}:21" for number in range(24)]
    given = ["FirstSeen", "CurrentLatitude", "CurrentLongitude"]
    long = frame.melt(given, ADDRESSES, "MAC", "RSSI").dropna().assign(SSID="n", Type="WIFI")
    path.write_text("WigleWifi-1.6,appRelease=2.90,model=X\n" + long.to_csv(index=False))
    read = pd.read_csv(path, skiprows=1).pivot(index=given, columns="MAC", values="RSSI").reset_index()
    # Metres of a degree on the ellipsoid of WGS 84, at a latitude of 50 degrees.
    squared, sine = 0.00669437999, math.sin(math.radians(LATITUDE))
    normal = 6378137.0 / math.sqrt(1 - squared * sine**2)
    north = math.radians(1) * normal * (1 - squared) / (1 - squared * sine**2)
    east = math.radians(1) * normal * math.cos(math.radians(LATITUDE))
    return (
        path,
        f"origin = [{LATITUDE}, {LONGITUDE}]\n",
        read.assign(
            x=(read["CurrentLongitude"] - LONGITUDE) * east,
            y=(read["CurrentLatitude"] - LATITUDE) * north,
            floor=0,
            part=None,
        )[["x", "y", "floor", "part", *ADDRESSES]],
    )


def decimal_commas(folder: Path) -> tuple[Path, str | None, pd.DataFrame]:
    path, points = folder / "messung.csv", [f"AP{number}" for number in range(POINTS)]
    frame = survey(8, points).rename(columns={"x": "Rechtswert", "y": "Hochwert", "floor": "Stockwerk"})
    frame.to_csv(path, sep=";", decimal=",", encoding="cp1252")
    read = pd.read_csv(path, sep=";", decimal=",", index_col=0, encoding="cp1252")
    return path, None, read.set_axis(["x", "y", "floor", *points], axis=1).assign(part=None)


def header_rows(folder: Path) -> tuple[Path, str | None, pd.DataFrame]:
    path = folder / "groups.csv"
    frame = survey(9, WAPS)
    frame[["x", "y"]] = (frame[["x", "y"]] / 0.3048).round(3)
    frame.columns = pd.MultiIndex.from_tuples(
        [("x", "ft"), ("y", "ft"), ("floor", ""), *((name, "dBm") for name in WAPS)]
    )
    frame.to_csv(path, index=False)
    read = pd.read_csv(path, header=[0, 1])
    read.columns = ["x", "y", "floor", *WAPS]
    return path, None, read.assign(x=read["x"] * 0.3048, y=read["y"] * 0.3048, part=None)


def xlsx(folder: Path) -> tuple[Path, str | None, pd.DataFrame]:
    path = folder / "survey.xlsx"
    survey(10, ADDRESSES).to_excel(path, index=False)
    return path, None, pd.read_excel(path).assign(part=None)


def parquet(folder: Path) -> tuple[Path, str | None, pd.DataFrame]:
    path = folder / "survey.parquet"
    frame = survey(11, ADDRESSES).sample(frac=1.0, random_state=1).rename(columns={"floor": "level_no"})
    frame.to_parquet(path, index=True)
    read = pd.read_parquet(path).rename(columns={"level_no": "floor"}).assign(part=None)
    return path, 'floor = "level_no"\n', read


def two_files(folder: Path) -> tuple[Path, str | None, pd.DataFrame]:
    points = [f"AP{number}" for number in range(POINTS)]
    for seed, name in enumerate(("my_train", "my_test")):
        survey(seed, points).to_csv(folder / f"{name}.csv", index=False)
    parts = [pd.read_csv(folder / f"my_{part}.csv").assign(part=part) for part in ("train", "test")]
    return folder, None, pd.concat(parts)


def archive(folder: Path) -> tuple[Path, str | None, pd.DataFrame]:
    _, toml, read = two_files(folder)
    return Path(shutil.make_archive(str(folder / "survey"), "zip", folder)), toml, read


LAYOUTS: tuple[Layout, ...] = (
    *(ujiindoorloc, sodindoorloc, dungeon_assistant, tuji1, trn_tst, plain_wide, long_table, wigle, decimal_commas),
    *(header_rows, xlsx, parquet, two_files, archive),
)
Fingerprint = tuple[str | None, int, frozenset[tuple[str, float]]]


def expected_of(frame: pd.DataFrame) -> dict[Fingerprint, tuple[float, float]]:
    points = [name for name in frame.columns if name not in ("x", "y", "floor", "part")]
    return {
        (
            row["part"],
            int(row["floor"]),
            frozenset((name, float(row[name])) for name in points if not math.isnan(row[name])),
        ): (row["x"], row["y"])
        for row in frame.to_dict("records")
    }


def found_in(dataset: api.Dataset) -> dict[Fingerprint, tuple[float, float]]:
    heard: dict[str, set[tuple[str, float]]] = {}
    for scan, bssid, level in dataset.readings.select("scan_id", "bssid", "rssi_dbm").collect().rows():
        heard.setdefault(scan, set()).add((bssid, level))
    split = dataset.splits.get("official")
    part = {} if split is None else dict(split.groups.select("id", "group").rows())
    rows = dataset.fingerprints.select("scan_id", "floor", "x", "y").collect().rows()
    return {(part.get(scan), floor, frozenset(heard.get(scan, ()))): (x, y) for scan, floor, x, y in rows}


@pytest.mark.parametrize("layout", LAYOUTS, ids=lambda layout: layout.__name__)
def test_a_layout_equals_a_reading_by_pandas(tmp_path: Path, layout: Layout) -> None:
    folder = tmp_path / "files"
    folder.mkdir()
    path, toml, frame = layout(folder)
    columns = tmp_path / "columns.toml"
    if toml is not None:
        columns.write_text(toml)
    options = ImportOptions(columns=None if toml is None else columns)
    dataset = import_format(path, tmp_path / "out", options)
    expected, found = expected_of(frame), found_in(dataset)
    assert len(expected) == len(frame)
    assert found.keys() == expected.keys()
    assert found == {
        key: pytest.approx(place, abs=0.01 if layout is wigle else 1e-9) for key, place in expected.items()
    }
    points = [name for name in frame.columns if name not in ("x", "y", "floor", "part")]
    assert dataset.readings.select(pl.len()).collect().item() == int(frame[points].notna().sum().sum())
    if (tmp_path / "out" / COLUMNS_FILE).exists():
        again = import_format(path, tmp_path / "again", ImportOptions(columns=tmp_path / "out" / COLUMNS_FILE))
        assert found_in(again) == found
