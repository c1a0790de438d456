from __future__ import annotations

from dataclasses import replace

import numpy as np
import polars as pl
import pytest

from tests.dataset.factory import SCANS, small_dataset
from vislam2tag.core.cell_grid import WalkableArea
from vislam2tag.dataset.coverage.floor_coverage import coverage
from vislam2tag.dataset.model import Dataset, Storey
from vislam2tag.dataset.schema import FINGERPRINTS, MAGNETIC, READINGS, in_schema
from vislam2tag.dataset.settings import CoverageSettings


def with_tables(dataset: Dataset, **tables: pl.DataFrame) -> Dataset:
    return replace(dataset, tables={**dataset.tables, **{name: table.lazy() for name, table in tables.items()}})


def test_labelled_fingerprints_are_counted_where_they_lie_by_device() -> None:
    ground, upper = coverage(small_dataset())
    assert (ground.storey, upper.storey) == (("", 0), ("", 1))
    assert {device: int(counts.sum()) for device, counts in ground.fingerprints.items()} == {
        "Galaxy": SCANS - 1,
        "Pixel": SCANS - 1,
    }
    row, column = ground.grid.cells_of(np.array([[5.0, 10.0]]))[0]
    assert (ground.fingerprints["Galaxy"][row, column], ground.fingerprints["Pixel"][row, column]) == (1, 0)
    assert ground.total.sum() == 2 * (SCANS - 1)
    assert ground.grid.centres_m(np.array([[row, column]])).tolist() == [[5.0, 11.0]]


def test_cells_between_scans_are_walkable_where_readings_are_labelled_and_gaps_far_from_scans() -> None:
    dataset = small_dataset()
    readings = dataset.readings.collect()
    # A reading labelled 3 cells beyond the last labelled scan: walked, but without a fingerprint.
    stray = readings.tail(1).with_columns(floor=pl.lit(0, pl.Int32), x=pl.lit(43.0), y=pl.lit(10.5))
    (ground, _) = coverage(with_tables(dataset, **{READINGS: pl.concat([readings, stray])}))
    (gap,) = np.argwhere(ground.gaps)
    assert ground.grid.centres_m(gap[None]).tolist() == [[43.0, 11.0]]
    assert ground.share == pytest.approx(1 - 1 / ground.walkable.sum())


@pytest.mark.parametrize(("radius_m", "covered"), [(0.5, 1), (2.0, 5), (3.0, 9)])
def test_a_fingerprint_covers_what_lies_within_the_radius(radius_m: float, covered: int) -> None:
    dataset = small_dataset()
    one = dataset.fingerprints.collect().head(1)
    nothing = dataset.readings.collect().head(0)
    area = WalkableArea(np.ones((10, 10), dtype=bool), (0.0, 5.0), 2.0)
    (floor,) = coverage(
        with_tables(dataset, **{FINGERPRINTS: one, READINGS: nothing}),
        settings=CoverageSettings(radius_m=radius_m),
        walkable={Storey("", 0): area},
    )
    assert floor.covered.sum() == covered
    assert floor.gaps.sum() == 100 - covered


def test_a_walkable_area_brings_its_own_cells_and_grows_by_what_was_walked_beside_it() -> None:
    mask = np.zeros((4, 6), dtype=bool)
    mask[1, 2] = True
    (ground, upper) = coverage(small_dataset(), walkable={Storey("", 0): WalkableArea(mask, (6.5, 12.5), 0.5)})
    assert ground.grid.cell_m == 0.5
    assert upper.grid.cell_m == 2.0
    left, right, low, high = ground.grid.extent_m
    assert (left, low) == (5.0, 10.0)
    assert right >= 35.0
    assert high >= 15.0
    place = ground.grid.cells_of(np.array([[7.75, 13.25]]))
    assert ground.walkable[tuple(place[0])]
    assert ground.walkable.sum() == 1 + 2 * (SCANS - 1)


def test_a_floor_with_a_walkable_area_alone_is_a_gap() -> None:
    area = WalkableArea(np.ones((3, 2), dtype=bool), (0.0, 0.0), 1.0)
    *_, cellar = coverage(small_dataset(), walkable={Storey("", 5): area})
    assert cellar.storey == ("", 5)
    assert cellar.share == 0
    assert cellar.gaps.all()


def test_magnetic_windows_tell_where_a_walk_went() -> None:
    window = in_schema(
        MAGNETIC, pl.DataFrame({"window_id": ["w"], "building": [None], "floor": [0], "x": [51.0], "y": [11.0]})
    )
    (ground, _) = coverage(with_tables(small_dataset(), **{MAGNETIC: window}))
    assert ground.gaps.sum() == 1


def test_a_label_in_another_town_is_counted_and_left_out() -> None:
    dataset = small_dataset()
    fingerprints = dataset.fingerprints.collect()
    far = fingerprints.head(1).with_columns(scan_id=pl.col("scan_id") + "0", x=pl.lit(1e6))
    (ground, _) = coverage(with_tables(dataset, **{FINGERPRINTS: pl.concat([fingerprints, far])}))
    assert ground.far == 1
    assert ground.total.sum() == 2 * (SCANS - 1)
    assert ground.grid.columns < 100


def test_other_technologies_do_not_cover() -> None:
    (ground, _) = coverage(small_dataset(), "ble")
    assert ground.share == 0
    assert ground.fingerprints == {}


def test_uncertain_fingerprints_show_where_people_walk_but_do_not_cover() -> None:
    dataset = small_dataset()
    doubtful = pl.when(pl.col("device") == "Pixel").then(pl.lit("uncertain")).otherwise(pl.col("status"))
    fingerprints = dataset.fingerprints.with_columns(status=doubtful).collect()
    (ground, _) = coverage(with_tables(dataset, **{FINGERPRINTS: fingerprints}))
    assert list(ground.fingerprints) == ["Galaxy"]
    assert ground.walkable.sum() == 2 * (SCANS - 1)
    assert ground.gaps.sum() == SCANS - 1


@pytest.mark.parametrize(("sigma_m", "walkable"), [(1.9, True), (2.1, False), (None, True)])
def test_where_somebody_may_not_have_been_nobody_need_walk(sigma_m: float | None, walkable: bool) -> None:
    """A reading labelled far from all others, more or less sure than the radius of 2 m."""
    readings = small_dataset().readings.collect()
    stray = readings.tail(1).with_columns(
        floor=pl.lit(0, pl.Int32), x=pl.lit(43.0), y=pl.lit(-4.5), sigma=pl.lit(sigma_m, pl.Float64)
    )
    (ground, *_) = coverage(with_tables(small_dataset(), **{READINGS: pl.concat([readings, stray])}))
    assert ground.gaps.any() == walkable


def test_labelled_fingerprints_count_however_sure_they_are() -> None:
    doubtful = small_dataset().fingerprints.with_columns(sigma=pl.lit(5.0)).collect()
    readings = small_dataset().readings.collect().head(0)
    (ground, _) = coverage(with_tables(small_dataset(), **{FINGERPRINTS: doubtful, READINGS: readings}))
    assert (ground.far, ground.share) == (0, 1.0)
    assert ground.total.sum() == 2 * (SCANS - 1)
