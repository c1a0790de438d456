"""``vislam2tag split`` as its users run it."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest
from typer.testing import CliRunner

from tests.cli.command import the_error, vislam2tag
from tests.datasets.factory import small_dataset
from tests.surveys import bytes_of
from vislam2tag.cli.app import app
from vislam2tag.common.errors import UsageError
from vislam2tag.datasets.folder import open_dataset, write_dataset
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
    for text in ("3.0  3.0", "test_4", "12", "4 of 4", "random: half of the test fingerprints", "floor: no test"):
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
    assert "split by device: there is only one device; it is left out" in vislam2tag("split", tmp_path / "set").stdout
    assert "--by device: there is only one device" in the_error(vislam2tag("split", tmp_path / "set", "--by", "device"))
    write_dataset(one, tmp_path / "none")
    assert "no splits; --by makes one" in vislam2tag("split", tmp_path / "none").stdout


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--seed", "1"), "--seed: belongs to a new split"),
        (("--name", "x"), "--name: names a new split"),
        (("--by", "random", "--guard-m", "1"), "--guard-m: a split by random takes no such option"),
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


def test_no_data_set_is_one_line_and_exit_code_2(tmp_path: Path) -> None:
    assert "is no data set" in the_error(vislam2tag("split", tmp_path))
