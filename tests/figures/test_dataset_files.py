from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from matplotlib.figure import Figure

from tests.dataset.factory import small_dataset
from vislam2tag.dataset.schema import REQUIRED, empty_table
from vislam2tag.dataset.statistics import dataset_statistics
from vislam2tag.figures import dataset_files


def rendered(figure: Figure, kind: str) -> bytes:
    """Stand for a figure's file: drawing it takes a second."""
    return f"{kind} with {len(figure.axes)} panels".encode()


def test_every_figure_and_table_is_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(dataset_files, "rendered", rendered)
    dataset = small_dataset()
    dataset_files.write_dataset_figures(dataset, dataset_statistics(dataset), tmp_path / "figures")
    files = {path.name: path.read_text() for path in (tmp_path / "figures").iterdir()}
    stems = {Path(name).stem for name in files}
    assert stems == {"table_3", "fingerprints", "coverage", "access_points", "rssi", "sigma", "over_time"}
    assert len(files) == 3 + 2 * 6
    assert files["coverage.svg"] == "svg with 2 panels"


def test_an_empty_set_has_its_table_alone(tmp_path: Path) -> None:
    empty = replace(small_dataset(), tables={name: empty_table(name).lazy() for name in REQUIRED})
    dataset_files.write_dataset_figures(empty, dataset_statistics(empty), tmp_path)
    assert sorted(path.suffix for path in tmp_path.iterdir()) == [".csv", ".md", ".tex"]
