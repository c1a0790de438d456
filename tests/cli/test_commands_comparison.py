"""Commands that divide, compare and join data sets: ``split``, ``verify`` and ``join``."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import polars as pl
import pytest
from typer.testing import CliRunner

from tests.cli.command import the_error, vislam2tag
from tests.datasets.changing import Survey, bssid, surveyed, usual_places
from tests.datasets.factory import small_dataset
from tests.surveys import bytes_of, make_survey
from vislam2tag.cli.app import app
from vislam2tag.common.errors import UsageError
from vislam2tag.datasets.folder import open_dataset, write_dataset
from vislam2tag.datasets.schema import READINGS
from vislam2tag.datasets.splits import split_findings, standard_splits


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    small = small_dataset()
    write_dataset(replace(small, splits=standard_splits(small)), tmp_path / "set")
    return tmp_path / "set"


def test_splits_are_listed_with_their_leakage(folder: Path) -> None:
    before = bytes_of(folder)
    done = vislam2tag("split", folder)
    assert done.returncode == 0, done.stderr
    for text in (
        "3.0  3.0",
        "test_4",
        "12",
        "4 of 4",
        "random: half of the test fingerprints",
        "floor: no floor of the test",
    ):
        assert text in done.stdout
    assert bytes_of(folder) == before


def test_a_split_is_added(folder: Path) -> None:
    arguments = ("--by", "block", "--block-m", "8", "--guard-m", "2.5", "--seed", "1", "--name", "mine")
    done = vislam2tag("split", folder, *arguments)
    assert done.returncode == 0, done.stderr
    assert "mine: half of the test fingerprints" in done.stdout
    assert "random" not in done.stdout
    saved = open_dataset(folder).splits["mine"].info
    assert saved.parameters == {"block_m": 8.0, "guard_m": 2.5, "share": 0.3, "seed": 1}
    before = bytes_of(folder)
    assert vislam2tag("split", folder, *arguments).returncode == 0
    assert bytes_of(folder) == before
    assert "another split of this name" in the_error(vislam2tag("split", folder, "--by", "random", "--name", "mine"))


def test_json_holds_all_figures(folder: Path) -> None:
    found = json.loads(vislam2tag("split", folder, "--json").stdout)
    assert [split["name"] for split in found] == ["block", "day", "device", "floor", "random", "trajectory"]
    (fold,) = found[4]["folds"]
    assert (fold["train"], fold["test"]) == (32, 12)
    assert [fold["distance_m"][name] for name in ("p05", "p25", "p50")] == [3.0, 3.0, 3.0]
    assert found[5]["parameters"] == {"folds": 4, "seed": 0}


def test_kinds_that_the_data_cannot_give(tmp_path: Path) -> None:
    small = small_dataset()
    one = replace(small, tables={**small.tables, "fingerprints": small.fingerprints.filter(device="Pixel")})
    findings = split_findings(one)
    told = replace(one, info=one.info.model_copy(update={"findings": findings}), splits=standard_splits(one))
    write_dataset(told, tmp_path / "set")
    assert "split by device: there is only one device; it is skipped" in vislam2tag("split", tmp_path / "set").stdout
    assert "--by device: there is only one device" in the_error(vislam2tag("split", tmp_path / "set", "--by", "device"))
    write_dataset(one, tmp_path / "none")
    assert "the data set has no split; make one with --by" in vislam2tag("split", tmp_path / "none").stdout


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--seed", "1"), "--seed: also pass --by"),
        (("--name", "x"), "--name: also pass --by"),
        (("--by", "random", "--guard-m", "1"), "--guard-m: does not apply to a split by random"),
        (("--by", "block", "--block-m", "0"), "--block-m 0.0: Input should be greater than 0"),
        (("--by", "block", "--guard-m", "nan"), "--guard-m nan:"),
        (("--by", "random", "--share", "1"), "--share 1.0: Input should be less than 1"),
        (("--by", "trajectory", "--folds", "1"), "--folds 1: Input should be greater than or equal to 2"),
        (("--by", "block", "--block-m", "1000"), "too few blocks of 1000 m"),
        (("--by", "random", "--name", "a/b"), "--name a/b: use letters"),
    ],
)
def test_wrong_usage_is_told(folder: Path, arguments: tuple[str, ...], message: str) -> None:
    found = CliRunner().invoke(app, ["split", str(folder), *arguments]).exception
    assert isinstance(found, UsageError)
    assert message in str(found)


@pytest.fixture
def sets(tmp_path: Path) -> tuple[Path, Path]:
    """A data set, and one in which readings are 3 dB louder."""
    dataset = small_dataset()
    write_dataset(dataset, tmp_path / "one")
    louder = dataset.readings.with_columns(pl.col("rssi_dbm") + 3)
    write_dataset(replace(dataset, tables={**dataset.tables, READINGS: louder}), tmp_path / "louder")
    return tmp_path / "one", tmp_path / "louder"


def test_different(sets: tuple[Path, Path], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "200")
    done = vislam2tag("verify", *sets)
    assert done.returncode == 1
    assert "rows, at most 3 (at" in done.stdout
    assert "different: 4 of" in done.stdout
    assert vislam2tag("verify", *sets, "--tolerance", "3").returncode == 0


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


@pytest.mark.usefixtures("undrawn_figures")
def test_a_later_survey_joins(tmp_path: Path) -> None:
    places = usual_places()
    del places[8]
    write_dataset(surveyed(Survey("base")), tmp_path / "base")
    write_dataset(surveyed(Survey("later", places=places)), tmp_path / "later")
    done = vislam2tag("join", tmp_path / "base", tmp_path / "later", "--out", tmp_path / "joined")
    assert (done.returncode, done.stderr) == (0, "")
    assert bssid(8) in done.stdout
    assert "wifi: access points: 23 unchanged, 1 vanished" in done.stdout
    assert re.search(r"walk \d+ places again", done.stdout)
    assert vislam2tag("verify", tmp_path / "joined", tmp_path / "joined").returncode == 0


@pytest.mark.usefixtures("undrawn_figures")
def test_a_survey_of_another_building_is_doubted(tmp_path: Path) -> None:
    write_dataset(surveyed(Survey("base")), tmp_path / "base")
    others = {100 + index: place for index, place in usual_places().items()}
    write_dataset(surveyed(Survey("later", places=others)), tmp_path / "later")
    done = vislam2tag("join", tmp_path / "base", tmp_path / "later", "--out", tmp_path / "joined")
    assert done.returncode == 0
    assert (
        "most_changed: wifi: 48 of 48 access points changed. Check that the later survey is of the same building"
        in done.stdout
    )


def test_surveys_that_cannot_be_joined(tmp_path: Path) -> None:
    write_dataset(surveyed(Survey("base")), tmp_path / "base")
    floors = tuple(floor.model_copy(update={"width_m": 80.0}) for floor in small_dataset().info.floors)
    later = replace(small_dataset(), info=small_dataset().info.model_copy(update={"floors": floors}))
    write_dataset(later, tmp_path / "later")
    done = vislam2tag("join", tmp_path / "base", tmp_path / "later", "--out", tmp_path / "joined")
    assert "floor 0: width_m is 60 in the base and 80 in the later survey" in the_error(done)
