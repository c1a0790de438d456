from __future__ import annotations

import json
from pathlib import Path

import polars as pl
import pytest
from matplotlib.figure import Figure

from tests.datasets.factory import small_dataset
from tests.surveys import bytes_of
from vislam2tag.common.errors import UsageError
from vislam2tag.datasets.folder import write_dataset
from vislam2tag.datasets.model import Storey
from vislam2tag.datasets.schema import READINGS
from vislam2tag.datasets.settings import CoverageSettings
from vislam2tag.pipeline.datasets import figures as dataset_figures
from vislam2tag.pipeline.datasets.figures import make_dataset_figures


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A data set whose ground floor has a gap beyond the last fingerprint; figures are not drawn, which takes long."""
    monkeypatch.setattr(dataset_figures, "rendered", _rendered)
    dataset = small_dataset()
    readings = dataset.readings.collect()
    last = readings.tail(1)
    strays = [last.with_columns(floor=pl.lit(0, pl.Int32), x=pl.lit(x), y=pl.lit(11.0)) for x in (41.0, 43.0, 45.0)]
    tables = {**dataset.tables, READINGS: pl.concat([readings, *strays]).lazy()}
    write_dataset(type(dataset)(dataset.info, tables), tmp_path / "set")
    return tmp_path / "set"


def _rendered(figure: Figure, kind: str) -> bytes:
    return f"{kind} with {len(figure.axes)} panels".encode()


def test_figures_table_and_walk_are_written_the_same_bytes_each_time(folder: Path, tmp_path: Path) -> None:
    out, drawn = tmp_path / "figures", list[tuple[str, int]]()
    make_dataset_figures(folder, out, progress=lambda stem, total: drawn.append((stem, total)))
    stems = {"fingerprints", "coverage", "access_points", "rssi", "sigma", "over_time"}
    assert set(drawn) == {(stem, len(stems)) for stem in stems}
    expected = {f"{stem}.{kind}" for stem in stems for kind in ("svg", "pdf")}
    expected |= {"table_3.csv", "table_3.md", "table_3.tex", "coverage.json", "run.json", ".vislam2tag-files"}
    assert {path.name for path in out.iterdir()} == expected
    before = bytes_of(out)
    make_dataset_figures(folder, out)
    assert bytes_of(out) == before


def test_the_walk_in_coverage_json_begins_at_the_start_and_ends_in_the_gap(folder: Path, tmp_path: Path) -> None:
    settings = CoverageSettings(radius_m=1.0)
    record = make_dataset_figures(folder, tmp_path / "out", settings, {Storey("", 0): (41.0, 11.0)})
    written = json.loads((tmp_path / "out" / "coverage.json").read_text())
    assert written == record.model_dump(mode="json")
    ground, upper = written["floors"]
    (walk,) = (walk for walk in ground["walks"] if walk["points_m"][0] == [41.0, 11.0])
    assert walk["points_m"][-1] == [45.0, 11.0]
    assert (walk["length_m"], walk["gap_m2"]) == (4.0, 12.0)
    assert walk["minutes"] == pytest.approx(4 / 60, abs=1e-3)
    assert (ground["walkable_m2"] - ground["covered_m2"]) >= 12
    assert upper["share"] is None


def test_a_start_on_a_floor_without_labels_is_refused_before_anything_is_written(folder: Path, tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="--start A/7: this floor has no labels; floors with labels: 0, 1"):
        make_dataset_figures(folder, tmp_path / "out", starts={Storey("A", 7): (1.0, 1.0)})
    assert not (tmp_path / "out").exists()
