"""Ranges to access points from the phone's file through labels to the data set."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import polars as pl
import pytest

from vislam2tag.datasets.access_points import merged_radios
from vislam2tag.datasets.model import Dataset
from vislam2tag.datasets.privacy import Privacy, hashed, with_privacy
from vislam2tag.datasets.schema import RTT
from vislam2tag.datasets.schema import SCHEMAS as OF_DATASETS
from vislam2tag.labeling.tables import SCHEMAS
from vislam2tag.pipeline.datasets.build import build_dataset
from vislam2tag.pipeline.labels.process import process
from vislam2tag.simulation.scenario import Scenario, regular_survey
from vislam2tag.simulation.settings import SessionLayout
from vislam2tag.simulation.survey import WritingOptions, simulate


@pytest.fixture(scope="module")
def scenario() -> Scenario:
    return regular_survey(3, "mild", (0,), ("LG",), 1, 40.0, rtt=True)


@pytest.fixture(scope="module")
def labels(scenario: Scenario, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("ranges")
    simulate(scenario, folder / "survey", WritingOptions(layout=SessionLayout.PHONE))
    process(folder / "survey", folder / "labels")
    return folder / "labels"


@pytest.fixture(scope="module")
def built(labels: Path) -> Dataset:
    return build_dataset(labels, labels.parent / "set")


def test_each_range_has_the_position_of_the_phone(scenario: Scenario, labels: Path) -> None:
    rows = pl.read_parquet(labels / "rtt" / "*.parquet")
    assert list(rows.schema.items()) == list(SCHEMAS["rtt"].items())
    placed = rows.filter(pl.col("status") == "ok", "responder")
    assert len(placed) > 20
    building = scenario.building
    points = np.array([building.ap_position[building.ap_bssid.index(name)] for name in placed["bssid"]])
    away = np.linalg.norm(points[:, :2] - placed.select("x", "y").to_numpy(), axis=1)
    assert np.median(np.abs(placed["range_m"].to_numpy() - np.hypot(away, points[:, 2] - 1.4))) < 1.0


def test_the_data_set_has_every_range_once(labels: Path, built: Dataset) -> None:
    rows = built.tables[RTT].collect()
    assert list(rows.schema.items()) == list(OF_DATASETS[RTT].items())
    logged = pl.read_parquet(labels / "rtt" / "*.parquet").filter(pl.col("status") != "duplicate")
    columns = ["bssid", "time_ns", "range_m", "range_sigma_m", "responder", "x", "y"]
    assert rows.select(columns).sort(columns).equals(logged.select(columns).sort(columns))
    assert rows["range_id"].is_unique().all()
    assert set(rows["session"]) == set(built.sessions.collect()["session"])
    assert "range_sigma_m" in (labels.parent / "set" / "README.md").read_text(encoding="utf-8")


def test_addresses_are_hidden_and_merged_as_those_of_readings(built: Dataset) -> None:
    names = set(built.tables[RTT].collect()["bssid"])
    key = b"sixteen bytes, or more"
    hidden = with_privacy(built, Privacy(hash_key=key)).tables[RTT].collect()
    assert set(hidden["bssid"]) == {hashed(name, key) for name in names}
    gone = built.access_points.collect().with_columns(nomap=pl.col("bssid") == min(names)).lazy()
    left = with_privacy(Dataset(built.info, {**built.tables, "access_points": gone}), Privacy())
    assert set(left.tables[RTT].collect()["bssid"]) == names - {min(names)}
    merged = merged_radios(built)
    assert set(merged.tables[RTT].collect()["bssid"]) <= set(merged.access_points.collect()["bssid"])
