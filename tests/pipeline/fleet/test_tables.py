"""Tables of a fleet: read from the store by one pattern, and only the files that a condition leaves."""

from __future__ import annotations

import duckdb
import fsspec
import polars as pl
from obstore.fsspec import register

from tests.pipeline.fleet.conftest import SmallFleet
from vislam2tag.labeling.tables import SCHEMAS


def parts_read(fleet: SmallFleet, table: str) -> set[str]:
    """Files of a table of which content was asked for since requests were counted last."""
    prefix = f"GET /bucket/{fleet.name}/tables/{table}/"
    return {each.removeprefix(prefix) for each in fleet.s3.seen() if each.startswith(prefix)}


def labels_of(fleet: SmallFleet, survey: str, floor: int) -> pl.DataFrame:
    """What the survey's labels hold of a floor, from the store."""
    store = fleet.s3.store(f"{fleet.name}/labels/{survey}")
    found = [store.get(file.name) for file in store.list("wifi")]
    return pl.concat(pl.read_parquet(each.data) for each in found if each is not None).filter(pl.col("floor") == floor)


def test_polars_reads_them_from_the_store_and_only_what_is_asked_for(fleet: SmallFleet) -> None:
    options = {"aws_endpoint_url": fleet.s3.endpoint, "aws_allow_http": "true"}
    wifi = pl.scan_parquet(f"{fleet.address}/tables/wifi/**/*.parquet", hive_partitioning=True, storage_options=options)
    assert wifi.select("survey", "floor").unique().sort("survey", "floor").collect().rows() == [
        ("hall", 0),
        ("ward", 0),
        ("ward", 1),
    ]
    fleet.s3.seen()
    asked = wifi.filter((pl.col("survey") == "ward") & (pl.col("floor") == 1) & (pl.col("rssi_dbm") > -70))
    assert "FILTER" not in asked.explain()
    found = asked.collect()
    assert parts_read(fleet, "wifi") == {"survey=ward/floor=1/wifi.parquet"}
    whole = labels_of(fleet, "ward", 1)
    assert set(found.columns) == {*SCHEMAS["wifi"], "survey"}
    columns = [name for name in SCHEMAS["wifi"] if name != "floor"]
    assert found.select(columns).equals(whole.filter(pl.col("rssi_dbm") > -70).select(columns))
    assert 0 < len(found) < len(whole)


def test_duckdb_reads_them_from_the_store_and_only_what_is_asked_for(fleet: SmallFleet) -> None:
    """Through obstore: DuckDB's own way to S3 is an extension that it fetches."""
    register("s3")
    connection = duckdb.connect()
    connection.register_filesystem(fsspec.filesystem("s3", client_options={"allow_http": True}))
    pattern = f"{fleet.address}/tables/sessions/*/*/*.parquet"
    all_of = f"SELECT survey, floor, count(*) FROM read_parquet('{pattern}', hive_partitioning = true)"
    fleet.s3.seen()
    asked = f"{all_of} WHERE survey = 'ward' AND floor = 0 AND labelled_share > 0.1 GROUP BY ALL"
    assert connection.execute(asked).fetchall() == [("ward", 0, 1)]
    first = "survey=hall/floor=0/sessions.parquet"  # tells DuckDB the columns
    assert parts_read(fleet, "sessions") - {first} == {"survey=ward/floor=0/sessions.parquet"}
    assert connection.execute(f"{all_of} GROUP BY ALL ORDER BY ALL").fetchall() == [
        ("hall", 0, 2),
        ("ward", 0, 1),
        ("ward", 1, 1),
    ]
