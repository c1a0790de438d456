"""croissant.json is valid and mlcroissant loads the tables by it, value by value."""

from __future__ import annotations

import json
import logging
import math
from pathlib import Path

import mlcroissant
import polars as pl
import pytest

from vislam2tag.dataset.folder import open_dataset, sha256_of
from vislam2tag.dataset.schema import SCHEMAS

pytestmark = [  # mlcroissant's own
    pytest.mark.filterwarnings("ignore:ConjunctiveGraph is deprecated:DeprecationWarning"),
    pytest.mark.filterwarnings("ignore:The inplace keyword:pandas.errors.Pandas4Warning"),
]


@pytest.fixture
def croissant(described_set: Path, caplog: pytest.LogCaptureFixture) -> mlcroissant.Dataset:
    with caplog.at_level(logging.WARNING):
        loaded = mlcroissant.Dataset(jsonld=str(described_set / "croissant.json"))
    assert "not standard" not in caplog.text
    return loaded


def test_it_is_valid_and_states_what_is_known(croissant: mlcroissant.Dataset) -> None:
    context = croissant.metadata.ctx
    assert not context.issues.errors
    assert not context.issues.warnings
    assert str(croissant.metadata.version) == "1.0.0"
    assert croissant.metadata.license == ["https://creativecommons.org/licenses/by/4.0/"]


def test_files_are_named_with_their_checksums(described_set: Path) -> None:
    files = json.loads((described_set / "croissant.json").read_text("utf-8"))["distribution"]
    assert [file["contentUrl"] for file in files] == [
        "fingerprints.parquet",
        "readings.parquet",
        "access_points.parquet",
        "sessions.parquet",
        "splits/again.parquet",
        "splits/device.parquet",
    ]
    for file in files:
        assert file["sha256"] == sha256_of(described_set / file["contentUrl"])


@pytest.mark.parametrize("table", ["fingerprints", "readings", "access_points", "sessions"])
def test_records_are_the_rows(table: str, described_set: Path, croissant: mlcroissant.Dataset) -> None:
    rows = open_dataset(described_set).tables[table].collect()
    records = list(croissant.records(table))
    assert len(records) == len(rows)
    for record, row in zip(records, rows.iter_rows(named=True), strict=True):
        assert set(record) == {f"{table}/{name}" for name in SCHEMAS[table]}
        for name, value in row.items():
            assert same(record[f"{table}/{name}"], value), (name, value)


def same(found: object, expected: object) -> bool:
    """Whether a record's value is a table's: text comes as bytes, nothing as NaN, lists as arrays."""
    if expected is None:
        return found is None or found != found
    if isinstance(expected, str):
        return isinstance(found, bytes) and found.decode() == expected
    if isinstance(expected, float) and isinstance(found, float):
        return math.isclose(found, expected, rel_tol=1e-6)
    if isinstance(expected, list):
        return list(found) == expected  # type: ignore[call-overload, no-any-return]
    if hasattr(expected, "isoformat"):
        return str(found).startswith(str(expected))
    return bool(found == expected)


def test_splits_are_record_sets(described_set: Path, croissant: mlcroissant.Dataset) -> None:
    records = list(croissant.records("split_device"))
    groups = pl.read_parquet(described_set / "splits" / "device.parquet")
    assert [record["split_device/id"].decode() for record in records] == groups["id"].to_list()


def test_a_bare_set_loads_too(bare_set: Path) -> None:
    loaded = mlcroissant.Dataset(jsonld=str(bare_set / "croissant.json"))
    assert len(list(loaded.records("sessions"))) == 4
