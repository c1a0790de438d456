"""``vislam2tag verify`` as its users run it."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import polars as pl
import pytest

from tests.cli.command import the_error, vislam2tag
from tests.datasets.factory import small_dataset
from tests.surveys import make_survey
from vislam2tag.datasets.folder import write_dataset
from vislam2tag.datasets.schema import READINGS


@pytest.fixture
def sets(tmp_path: Path) -> tuple[Path, Path]:
    """A data set, and one in which readings are 3 dB louder."""
    dataset = small_dataset()
    write_dataset(dataset, tmp_path / "one")
    louder = dataset.readings.with_columns(pl.col("rssi_dbm") + 3)
    write_dataset(replace(dataset, tables={**dataset.tables, READINGS: louder}), tmp_path / "louder")
    return tmp_path / "one", tmp_path / "louder"


def test_the_same(sets: tuple[Path, Path]) -> None:
    done = vislam2tag("verify", sets[0], sets[0])
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.startswith("the same: ")


def test_different(sets: tuple[Path, Path], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "200")
    done = vislam2tag("verify", *sets)
    assert done.returncode == 1
    assert "rows, at most 3 (at" in done.stdout
    assert "different: 4 of" in done.stdout
    assert vislam2tag("verify", *sets, "--tolerance", "3").returncode == 0


def test_json_has_all(sets: tuple[Path, Path]) -> None:
    done = vislam2tag("verify", *sets, "--json")
    assert done.returncode == 1
    found = json.loads(done.stdout)
    assert {table["table"] for table in found["differences"]} == {READINGS}


def test_two_labellings_of_a_survey(tmp_path: Path) -> None:
    survey = make_survey(tmp_path / "survey", devices=("LG",), sessions=1, seconds=60)
    for strategy in ("smoother", "local"):
        out = tmp_path / strategy
        assert vislam2tag("process", survey, "--out", out, "--jobs", "1", "--strategy", strategy).returncode == 0
    done = vislam2tag("verify", tmp_path / "smoother", tmp_path / "local")
    assert done.returncode == 1
    assert "x, y: " in done.stdout
    assert "strategy: smoother, local" in done.stdout
    found = json.loads(vislam2tag("verify", tmp_path / "smoother", tmp_path / "local", "--json").stdout)["labels"]
    (walk,) = found["sessions"]
    frames = [
        pl.read_parquet(tmp_path / name / "trajectory" / f"{walk['id']}.parquet") for name in ("smoother", "local")
    ]
    both = frames[0].select("x", "y").hstack(frames[1].select(x_b="x", y_b="y")).drop_nulls()
    apart = ((both["x"] - both["x_b"]) ** 2 + (both["y"] - both["y_b"]) ** 2).sqrt()
    assert walk["frames_compared"] == len(both) > 1000
    assert walk["apart_median_m"] == pytest.approx(apart.median())
    assert 0 < walk["apart_median_m"] < walk["apart_p95_m"]
    assert walk["labelled_a"] > walk["labelled_b"]
    same = json.loads(vislam2tag("verify", tmp_path / "local", tmp_path / "local", "--json").stdout)
    assert [(one["apart_p95_m"], same["labels"]["settings"]) for one in same["labels"]["sessions"]] == [(0.0, [])]
    assert vislam2tag("verify", tmp_path / "local", tmp_path / "local").stdout.startswith("the same: ")


def test_nothing_to_compare(tmp_path: Path) -> None:
    assert "holds nothing to compare" in the_error(vislam2tag("verify", tmp_path, tmp_path))
