from __future__ import annotations

from dataclasses import replace

import pytest

from tests.dataset.factory import small_dataset
from vislam2tag.dataset.model import Storey
from vislam2tag.dataset.schema import REQUIRED, empty_table
from vislam2tag.dataset.settings import CoverageSettings
from vislam2tag.dataset.statistics import dataset_statistics
from vislam2tag.views.dataset_figures import covered_floors, dataset_figures


def test_every_figure_that_there_is_data_for_is_made() -> None:
    dataset = small_dataset()
    floors = covered_floors(dataset, "wifi", CoverageSettings(), {})
    figures = dict(dataset_figures(dataset_statistics(dataset), floors))
    assert set(figures) == {"fingerprints", "coverage", "access_points", "rssi", "sigma", "over_time"}
    assert [axes.get_title("left")[:11] for axes in figures["coverage"].axes] == ["(a) Floor 0", "(b) Floor 1"]


def test_an_empty_set_has_no_figure() -> None:
    empty = replace(small_dataset(), tables={name: empty_table(name).lazy() for name in REQUIRED})
    assert list(dataset_figures(dataset_statistics(empty), covered_floors(empty, "wifi", CoverageSettings(), {}))) == []


@pytest.mark.parametrize(("start", "length_m"), [(None, 0.0), ((5.0, 11.0), 32.0)])
def test_the_walk_begins_where_it_is_told_to(start: tuple[float, float] | None, length_m: float) -> None:
    dataset = small_dataset(unlabelled=0)
    wide = CoverageSettings(cell_m=4.0, radius_m=0.1)
    tight = covered_floors(dataset, "none", wide, {} if start is None else {Storey("", 0): start})
    assert tight[0].coverage.share == 0
    assert sum(walk.length_m for walk in tight[0].walks) >= length_m
