"""``vislam2tag figures`` as its users run it."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.cli.command import the_error, vislam2tag
from tests.datasets.factory import small_dataset
from vislam2tag.cli.commands_datasets import start_of
from vislam2tag.common.errors import UsageError
from vislam2tag.datasets.folder import write_dataset


@pytest.fixture(scope="module")
def dataset(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("data") / "set"
    write_dataset(small_dataset(), folder)
    return folder


def test_figures_are_drawn_and_coverage_is_shown(dataset: Path, tmp_path: Path) -> None:
    done = vislam2tag("figures", dataset, "--out", tmp_path / "out", "--start", "0:5,11")
    assert done.returncode == 0, done.stderr
    assert "walk that fills the gaps" in done.stdout
    assert (tmp_path / "out" / "coverage.svg").read_bytes().startswith(b"<?xml")
    assert (tmp_path / "out" / "rssi.pdf").read_bytes().startswith(b"%PDF")


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (("--start", "1;2"), "--start 1;2: give FLOOR:X,Y"),
        (("--cell-m", "0"), "--cell-m 0.0: Input should be greater than or equal to 0.05"),
        (("--radius-m", "nan"), "--radius-m nan: Input should be"),
    ],
)
def test_wrong_values_are_one_line(dataset: Path, tmp_path: Path, arguments: tuple[str, ...], told: str) -> None:
    assert told in the_error(vislam2tag("figures", dataset, "--out", tmp_path / "out", *arguments))
    assert not (tmp_path / "out").exists()


def test_no_data_set_and_foreign_folders_are_one_line(dataset: Path, tmp_path: Path) -> None:
    assert "is no data set" in the_error(vislam2tag("figures", tmp_path, "--out", tmp_path / "out"))
    (tmp_path / "mine").write_text("mine")
    assert "was not made by vislam2tag figures" in the_error(vislam2tag("figures", dataset, "--out", tmp_path))


def test_starts_may_name_a_building() -> None:
    assert start_of("1:12.5,-3") == (("", 1), (12.5, -3.0))
    assert start_of("wing a/b/-1:0,4") == (("wing a/b", -1), (0.0, 4.0))
    with pytest.raises(UsageError, match="BUILDING/FLOOR"):
        start_of("1:2")
