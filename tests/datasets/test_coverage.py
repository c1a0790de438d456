from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import polars as pl
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse.csgraph import dijkstra

from tests.datasets.factory import SCANS, small_dataset
from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.cell_grid import CellGrid, WalkableArea
from vislam2tag.datasets.coverage import FloorCoverage, GapWalk, coverage, gap_walks, walk_graph
from vislam2tag.datasets.model import Dataset, Storey
from vislam2tag.datasets.schema import FINGERPRINTS, MAGNETIC, READINGS, in_schema
from vislam2tag.datasets.settings import CoverageSettings


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


def plan(*lines: str, cell_m: float = 1.0) -> FloorCoverage:
    """``.`` walkable and covered, ``o`` a gap, else no way; the last line is row 0."""
    letters = np.array([list(line) for line in lines[::-1]])
    grid = CellGrid((10.0, 20.0), cell_m, *letters.shape)
    return FloorCoverage(Storey("", 0), grid, {}, np.isin(letters, (".", "o")), letters == ".", 0)


def cells_along(walk: GapWalk, coverage: FloorCoverage) -> np.ndarray:
    """Every cell (k, 2) that a walk runs through."""
    points = []
    for a, b in itertools.pairwise(walk.points_m):
        points.append(a + (b - a) * np.linspace(0, 1, 200)[:, None])
    return coverage.grid.cells_of(np.concatenate([*points, walk.points_m]))


def test_from_the_middle_of_a_corridor_the_nearer_end_comes_first() -> None:
    (walk,) = gap_walks(plan("o......o"), 0.5, (13.4, 20.5))
    assert walk.length_m == pytest.approx(3 + 7)
    assert walk.points_m.tolist() == [[13.5, 20.5], [10.5, 20.5], [17.5, 20.5]]
    assert walk.stops_m.tolist() == [[10.5, 20.5], [17.5, 20.5]]
    assert walk.minutes(2.0) == pytest.approx(10 / 2 / 60)


def test_without_a_start_it_begins_where_the_walk_is_shortest() -> None:
    (walk,) = gap_walks(plan("..o..o.o"), 0.5)
    assert walk.length_m == pytest.approx(5)


def test_a_wall_is_walked_around_and_no_corner_cut() -> None:
    coverage = plan("o.#.o", "..#..", ".....")
    (walk,) = gap_walks(coverage, 0.5)
    # Straight down, along the lowest row below the wall, and up again: one diagonal step on either side.
    assert walk.length_m == pytest.approx(2 * (1 + np.sqrt(2)) + 2)
    assert coverage.walkable[tuple(cells_along(walk, coverage).T)].all()


def test_neighbouring_gaps_are_filled_from_one_stop() -> None:
    (walk,) = gap_walks(plan("...", ".oo", ".oo"), 2.0)
    assert len(walk.stops_m) == 1
    assert (walk.length_m, walk.gap_cells) == (0, 4)


def test_parts_that_hang_not_together_take_a_walk_each_and_the_larger_comes_first() -> None:
    walks = gap_walks(plan("o.#o.o"), 0.5, (10.5, 20.5))
    assert [walk.gap_cells for walk in walks] == [2, 1]
    assert [walk.length_m for walk in walks] == [2, 0]


def test_no_gap_takes_no_walk() -> None:
    assert gap_walks(plan("..", "..")) == ()


def test_metres_follow_the_cells() -> None:
    (walk,) = gap_walks(plan("o..o", cell_m=2.5), 1.0)
    assert walk.length_m == pytest.approx(7.5)


def best_length(length_m: FloatArray) -> float:
    orders = np.array(list(itertools.permutations(range(len(length_m)))))
    return float(length_m[orders[:, :-1], orders[:, 1:]].sum(axis=1).min())


@settings(max_examples=40)
@given(st.integers(0, 10_000))
def test_every_gap_is_reached_over_walkable_cells_on_nearly_the_shortest_way(seed: int) -> None:
    rng = np.random.default_rng(seed)
    letters = np.where(rng.random((9, 12)) < 0.2, "#", ".")
    letters[rng.integers(0, 9, 7), rng.integers(0, 12, 7)] = "o"
    coverage = plan(*("".join(line) for line in letters))
    gaps = coverage.grid.centres_m(np.argwhere(coverage.gaps))
    walks = gap_walks(coverage, 0.5)
    reached = np.concatenate([walk.stops_m for walk in walks])
    assert sorted(map(tuple, reached)) == sorted(map(tuple, gaps))
    places_m, graph = walk_graph(coverage)
    for walk in walks:
        assert coverage.walkable[tuple(cells_along(walk, coverage).T)].all()
        steps = np.linalg.norm(np.diff(walk.points_m, axis=0), axis=1)
        assert steps.sum() == pytest.approx(walk.length_m)
        places = [int(np.flatnonzero((places_m == stop).all(axis=1))[0]) for stop in walk.stops_m]
        length_m = dijkstra(graph, directed=False, indices=places)[:, places]
        assert walk.length_m <= 1.1 * best_length(length_m) + 1e-6
