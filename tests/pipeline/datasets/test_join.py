from __future__ import annotations

import json
from pathlib import Path

import polars as pl
import pytest

from tests.datasets.changing import Survey, bssid, surveyed, usual_places
from vislam2tag.common.errors import DatasetError
from vislam2tag.datasets.folder import open_dataset, write_dataset
from vislam2tag.pipeline.datasets.join import CHANGES, join


@pytest.fixture
def sets(tmp_path: Path) -> tuple[Path, Path]:
    """A data set and a later survey that misses an access point."""
    places = usual_places()
    del places[8]
    write_dataset(surveyed(Survey("base")), tmp_path / "base")
    write_dataset(surveyed(Survey("later", places=places)), tmp_path / "later")
    return tmp_path / "base", tmp_path / "later"


@pytest.mark.usefixtures("undrawn_figures")
def test_the_joined_set_is_whole_and_tells_what_changed(sets: tuple[Path, Path], tmp_path: Path) -> None:
    record = join(*sets, tmp_path / "joined")
    joined = open_dataset(tmp_path / "joined")
    rows = [open_dataset(path).fingerprints.collect().height for path in (*sets, tmp_path / "joined")]
    assert rows[0] + rows[1] == rows[2]
    assert {"random", "trajectory"} <= set(joined.splits)
    assert joined.splits["random"].groups.height == rows[2]
    assert [point.bssid for point in record.technologies[0].changed] == [bssid(8)]
    written = {path.name for path in (tmp_path / "joined" / CHANGES).iterdir()}
    assert written == {"changes.json", "access_points.csv", "places.csv", "wifi.svg", "wifi.pdf"}
    assert json.loads((tmp_path / "joined" / CHANGES / "changes.json").read_text())["later"] == "later"


def test_the_same_sets_give_the_same_bytes(sets: tuple[Path, Path], tmp_path: Path) -> None:
    for name in ("one", "two"):
        join(*sets, tmp_path / name)
    files = sorted(path.relative_to(tmp_path / "one") for path in (tmp_path / "one").rglob("*") if path.is_file())
    assert len(files) > 10
    for file in files:
        assert (tmp_path / "one" / file).read_bytes() == (tmp_path / "two" / file).read_bytes(), file


def test_a_survey_that_is_there_already_brings_nothing_to_compare(sets: tuple[Path, Path], tmp_path: Path) -> None:
    record = join(sets[0], sets[0], tmp_path / "joined")
    assert record.technologies == ()
    assert open_dataset(tmp_path / "joined").readings.select(pl.len()).collect().item() > 0


def test_what_cannot_be_joined_leaves_nothing(sets: tuple[Path, Path], tmp_path: Path) -> None:
    (sets[1] / "dataset.json").unlink()
    with pytest.raises(DatasetError, match="not a data set"):
        join(*sets, tmp_path / "joined")
    assert not (tmp_path / "joined").exists()
