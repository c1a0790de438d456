from __future__ import annotations

import math
from pathlib import Path

import pandas as pd
import polars as pl
import pytest

from vislam2tag import api
from vislam2tag.common.errors import DatasetError
from vislam2tag.pipeline.datasets.import_export import COLUMNS_FILE, ImportOptions, import_format

A, B = "02:1a:00:00:00:01", "02:1a:00:00:00:02"


def heard(dataset: api.Dataset) -> list[tuple[object, ...]]:
    """x, y, floor, access point and level of each reading, sorted."""
    table = dataset.readings.join(dataset.fingerprints.select("scan_id", "floor", "x", "y"), on="scan_id")
    return sorted(table.select("x", "y", "floor", "bssid", "rssi_dbm").collect().rows())


def melted(rows: pd.DataFrame, points: list[str], not_heard: float = math.nan) -> list[tuple[object, ...]]:
    long = rows.melt(id_vars=["x", "y", "floor"], value_vars=points)
    long = long[long["value"].notna() & (long["value"] != not_heard)]
    return sorted(long.itertuples(index=False, name=None))


def test_wide_table_with_own_names(tmp_path: Path) -> None:
    path = tmp_path / "sodindoor.csv"
    path.write_text("MAC1,MAC2,ECoord,NCoord,FloorID\n-60,100,10.5,3.2,1.0\n-70,-82,12.5,3.2,2.0\n")
    frame = pd.read_csv(path).rename(columns={"ECoord": "x", "NCoord": "y", "FloorID": "floor"})
    first = import_format(path, tmp_path / "a")
    assert heard(first) == melted(frame, ["MAC1", "MAC2"], 100)
    again = import_format(path, tmp_path / "b", ImportOptions(columns=tmp_path / "a" / COLUMNS_FILE))
    assert heard(again) == heard(first)


def test_wide_table_of_addresses_with_gaps(tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    path.write_text(f"x,y,{A},{B}\n1.5,2,-61.0,\n2.5,2,,-75.0\n")
    frame = pd.read_csv(path).assign(floor=0)
    assert heard(import_format(path, tmp_path / "out")) == melted(frame, [A, B])


def test_decimal_commas_preamble_row_numbers_and_floor_names(tmp_path: Path) -> None:
    folder = tmp_path / "f"
    folder.mkdir()
    (folder / "train.csv").write_text("# a survey\n;px;py;storey;AP1;AP2\n0;1,5;2,5;EG;-60;\n1;2,5;2,5;2. OG;-61;-70\n")
    (folder / "test.csv").write_text("# a survey\n;px;py;storey;AP1;AP2\n0;7,5;2,5;EG;-62;\n")
    parts = [pd.read_csv(file, sep=";", decimal=",", comment="#") for file in folder.iterdir()]
    frame = pd.concat(parts).rename(columns={"px": "x", "py": "y"})
    frame["floor"] = frame["storey"].map({"EG": 0, "2. OG": 2})
    found = import_format(folder, tmp_path / "out")
    assert heard(found) == melted(frame, ["AP1", "AP2"])
    assert "official" in found.info.splits


@pytest.mark.parametrize("suffix", ["csv", "parquet"])
def test_long_table(tmp_path: Path, suffix: str) -> None:
    frame = pl.DataFrame(
        {"X": [1.0, 1.0, 2.0], "Y": [3.0, 3.0, 4.0], "floor": [1, 1, 2], "bssid": [A, B, A], "rssi": [-60, -80, -70]}
    )
    path = tmp_path / f"t.{suffix}"
    frame.write_csv(path) if suffix == "csv" else frame.write_parquet(path)
    found = import_format(path, tmp_path / "out")
    assert heard(found) == sorted(frame.select("X", "Y", "floor", "bssid", pl.col("rssi").cast(pl.Float64)).rows())
    assert found.fingerprints.collect().height == 2


def test_message_names_found_and_expected_columns(tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    path.write_text("foo,qz,AP1\n1,2,-60\n")
    with pytest.raises(DatasetError, match=r"found the columns foo, qz, AP1; expected for x one of x, .*--columns"):
        import_format(path, tmp_path / "out", ImportOptions(format_name="table"))
    assert not (tmp_path / "out").exists()


def test_what_would_be_silently_wrong_is_said(tmp_path: Path) -> None:
    metres = tmp_path / "metres.csv"
    metres.write_text("LONGITUDE,LATITUDE,AP1,AP2\n-7541.2,4864921.1,-60,-70\n-7540.2,4864920.1,-61,-71\n")
    with pytest.raises(DatasetError, match=r'are not degrees.* x = "LONGITUDE", y = "LATITUDE"'):
        import_format(metres, tmp_path / "out", ImportOptions(format_name="table"))
    columns = tmp_path / "columns.toml"
    columns.write_text('x = "LONGITUDE"\ny = "LATITUDE"\nlatitude = ""\nlongitude = ""\n')
    options = ImportOptions(format_name="table", columns=columns)
    found = import_format(metres, tmp_path / "metres", options)
    assert found.fingerprints.select("x", "y").collect().rows() == [(-7541.2, 4864921.1), (-7540.2, 4864920.1)]
    (assumed,) = (each for each in found.info.findings if each.kind == "assumed_columns")
    assert "no column as floor, so that all fingerprints are on floor 0" in assumed.message
    folder = tmp_path / "two"
    folder.mkdir()
    (folder / "a.csv").write_text("x,y,floor,AP1,AP2\n1,2,3,-60,-70\n")
    (folder / "b.csv").write_text("x,y,AP1,AP2\n1,2,-60,-70\n")
    with pytest.raises(DatasetError, match=r"b\.csv: has other columns than a\.csv"):
        import_format(folder, tmp_path / "out")


def test_degrees_become_metres_east_and_north_of_the_origin(tmp_path: Path) -> None:
    path = tmp_path / "degrees.csv"
    path.write_text("lat,lon,AP1,AP2\n50.001,6.0,-60,-70\n50.0,6.001,-61,-71\n")
    found = import_format(path, tmp_path / "out", ImportOptions(origin=(50.0, 6.0)))
    (first, second) = found.fingerprints.select("x", "y").sort("x").collect().rows()
    assert first == (pytest.approx(0, abs=1e-3), pytest.approx(111.23, abs=0.1))
    assert second == (pytest.approx(71.7, abs=0.1), pytest.approx(0, abs=0.01))


def test_rows_of_one_scan_id_are_one_fingerprint_and_two_header_rows_one_header(tmp_path: Path) -> None:
    path = tmp_path / "scans.csv"
    rows = f"7,1.5,2.5,1,{A},-60\n7,1.5,2.5,1,{B},-70\n8,1.5,2.5,1,{A},-65\n"
    path.write_text(f"scan_id,x,y,floor,mac,rssi\n,m,m,,,dBm\n{rows}")
    frame = pd.read_csv(path, skiprows=[1])
    found = import_format(path, tmp_path / "out")
    counts = found.fingerprints.select("readings").collect()["readings"]
    assert sorted(counts) == sorted(frame.groupby("scan_id").size())
    assert heard(found) == sorted(frame[["x", "y", "floor", "mac", "rssi"]].itertuples(index=False, name=None))
