"""The written tables: schema, types, one row for each raw row, true positions."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import polars as pl
import pytest

from vislam2tag.labeling import tables
from vislam2tag.labeling.results import SessionResult

RAW = {"trajectory": "poses", "wifi": "wifi", "sensors": "sensors"}
SCHEMAS = {name: tables.SCHEMAS[name] for name in RAW}


def results(out: Path) -> list[SessionResult]:
    return [SessionResult.model_validate_json(path.read_bytes()) for path in sorted(out.glob("sessions/*.json"))]


@pytest.mark.parametrize("table", SCHEMAS)
def test_all_files_of_a_folder_read_together_with_the_specified_schema(clean_run: Path, table: str) -> None:
    together = pl.read_parquet(clean_run / table / "*.parquet")
    assert list(together.schema.items()) == list(SCHEMAS[table].items())
    assert len(list((clean_run / table).glob("*.parquet"))) == 4


@pytest.mark.parametrize("table", SCHEMAS)
def test_one_row_for_each_raw_row_in_file_order(clean_run: Path, clean_survey: Path, table: str) -> None:
    for result in results(clean_run):
        rows = pl.read_parquet(clean_run / table / f"{result.slug}.parquet")
        account = next(file for file in result.files if file.role == RAW[table])
        raw = clean_survey / f"floor_{result.floor}" / result.device / result.session / account.name
        assert len(rows) == account.rows == account.lines == raw.read_bytes().count(b"\n")
        if table != "trajectory":
            assert rows["row"].to_list() == list(range(1, len(rows) + 1))


@pytest.mark.parametrize("table", SCHEMAS)
def test_positions_are_null_unless_labelled(local_run: Path, table: str) -> None:
    rows = pl.read_parquet(local_run / table / "*.parquet")
    labelled = rows["status"].is_in(["ok", "uncertain"])
    assert 0.2 < labelled.mean() < 1  # type: ignore[operator]
    assert rows["x"].is_not_null().equals(labelled)
    assert rows["y"].is_not_null().equals(labelled)
    assert not rows.select(pl.col("x", "y").is_nan().any()).to_numpy().any()


@pytest.mark.parametrize("table", SCHEMAS)
def test_metadata_names_frame_units_stage_and_version(clean_run: Path, table: str) -> None:
    path = next((clean_run / table).glob("*.parquet"))
    metadata = json.loads(pl.read_parquet_metadata(path)["vislam2tag"])
    assert set(metadata) == {"frame", "units", "stage", "version"}
    assert metadata["units"]["x"] == "m"
    assert set(metadata["units"]) <= set(SCHEMAS[table])


def test_labels_of_a_perfect_tracker_are_true(clean_run: Path, clean_survey: Path) -> None:
    for result in results(clean_run):
        folder = clean_survey / f"floor_{result.floor}" / result.device / result.session
        truth = pl.read_csv(folder / "truth.csv")
        for table in SCHEMAS:
            rows = pl.read_parquet(clean_run / table / f"{result.slug}.parquet").drop_nulls("x")
            knots = truth["time_ns"].to_numpy()
            true = [np.interp(rows["time_ns"].to_numpy(), knots, truth[axis].to_numpy()) for axis in "xy"]
            error = np.hypot(rows["x"].to_numpy() - true[0], rows["y"].to_numpy() - true[1])
            assert np.median(error) < 0.15
            assert error.max() < 0.8


def test_camera_orientation_looks_where_the_walk_goes(clean_run: Path) -> None:
    """The camera looks along -z of its frame, mostly forward: its heading agrees with the way."""
    rows = pl.read_parquet(next((clean_run / "trajectory").glob("*.parquet"))).drop_nulls("x")
    q = rows.select("qx", "qy", "qz", "qw").to_numpy().T
    np.testing.assert_allclose(np.linalg.norm(q, axis=0), 1, atol=1e-9)
    forward = np.stack((-2 * (q[0] * q[2] + q[1] * q[3]), -2 * (q[1] * q[2] - q[0] * q[3])))
    way = np.gradient(rows.select("x", "y").to_numpy(), axis=0).T
    moving = np.linalg.norm(way, axis=0) > 0.015
    cosine = np.sum(forward * way, axis=0)[moving] / np.linalg.norm(way, axis=0)[moving]
    assert np.median(cosine) > 0.5
