"""Distances by the index are those that SciPy computes from all levels; order and groups are kept.

Votes: the storey first, then the mean on it, and how far all of them lie apart.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
import pytest
from scipy.spatial.distance import cdist

from tests.positioning.radio_world import STOREYS, radio_world
from vislam2tag.positioning import signal_distance
from vislam2tag.positioning.places import ScanPlaces
from vislam2tag.positioning.radio_scans import Representation, joined_rows, represented, represented_levels
from vislam2tag.positioning.signal_distance import Apart, ScanIndex, SignalDistance, Votes, counted_votes

SCIPY: dict[SignalDistance, Literal["braycurtis", "euclidean", "cosine"]] = {
    SignalDistance.SORENSEN: "braycurtis",
    SignalDistance.EUCLIDEAN: "euclidean",
    SignalDistance.COSINE: "cosine",
}
LEARNED, _ = radio_world(seed=1)
ASKED, _ = radio_world(seed=2)


def index_of(distance: SignalDistance) -> ScanIndex:
    return ScanIndex.of(LEARNED, represented_levels(LEARNED.rssi_dbm, Representation.POWED), distance)


@pytest.mark.parametrize("distance", SignalDistance)
def test_distances_are_those_over_all_levels(distance: SignalDistance) -> None:
    asked = ASKED.over(LEARNED.access_points)
    one, other = (represented(scans, Representation.POWED) for scans in (asked, LEARNED))
    expected = cdist(one, other, SCIPY[distance])
    level = represented_levels(asked.rssi_dbm, Representation.POWED)
    found = index_of(distance).nearest(asked, level, len(LEARNED))
    np.testing.assert_allclose(found.away, np.sort(expected, axis=1), atol=1e-12)
    np.testing.assert_allclose(np.take_along_axis(expected, found.which, axis=1), found.away, atol=1e-12)
    few = index_of(distance).nearest(asked, level, 3)
    np.testing.assert_array_equal(few.which, found.which[:, :3])


@pytest.mark.parametrize("distance", SignalDistance)
def test_among_very_many_scans_the_nearest_cells_alone_are_looked_into(
    distance: SignalDistance, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = ASKED.over(LEARNED.access_points)
    level = represented_levels(asked.rssi_dbm, Representation.POWED)
    groups = Apart(np.arange(len(asked))[:, None] % 5, np.arange(len(LEARNED))[:, None] % 5)
    exact = index_of(distance).nearest(asked, level, 3, groups)
    monkeypatch.setattr(signal_distance, "MOST_READINGS", 0)
    index = index_of(distance)
    assert index.cells is not None
    assert sum(len(cell.members) for cell in index.cells.cells) == len(LEARNED)
    monkeypatch.setattr(signal_distance, "PROBED", len(index.cells.cells))
    whole = index.nearest(asked, level, 3, groups)
    np.testing.assert_array_equal(whole.which, exact.which)
    np.testing.assert_allclose(whole.away, exact.away, atol=1e-12)
    monkeypatch.setattr(signal_distance, "PROBED", 6)
    some = index.nearest(asked, level, 3, groups)
    assert np.mean(some.which[:, 0] == exact.which[:, 0]) > 0.9
    assert (some.away >= exact.away - 1e-12).all()
    monkeypatch.setattr(signal_distance, "PROBED", 1)
    few = index.nearest(asked, level, len(LEARNED))
    assert np.isinf(few.away[:, -1]).all()  # what no cell held is no neighbour


def test_scans_of_the_same_group_are_no_neighbours_and_the_first_of_equals_comes_first() -> None:
    twice = LEARNED[np.array([4, 5, 4, 5])]
    index = ScanIndex.of(twice, represented_levels(twice.rssi_dbm, Representation.POWED), SignalDistance.SORENSEN)
    one = LEARNED[np.array([5])]
    level = represented_levels(one.rssi_dbm, Representation.POWED)
    assert index.nearest(one, level, 3).which.tolist() == [[1, 3, 0]]
    apart = Apart(np.array([[7, 1]]), np.array([[0, 2], [7, 2], [7, 3], [0, 3]]))
    found = index.nearest(one, level, 4, apart)
    assert found.which.tolist() == [[3, 0, 1, 2]]
    assert np.isinf(found.away[0, 2:]).all()
    of_two_kinds = Apart.among(np.array([1]), np.array([0, 7, 7, 0]), np.array([2, 2, 3, 3]))
    assert np.isinf(index.nearest(one, level, 4, of_two_kinds).away[0]).tolist() == [False, True, True, True]


def test_a_scan_that_shares_nothing_is_as_far_as_can_be() -> None:
    index = index_of(SignalDistance.SORENSEN)
    np.testing.assert_array_equal(index.away(np.empty(0, np.int64), np.empty(0)), np.ones(len(LEARNED)))


PLACES = ScanPlaces(
    STOREYS,
    np.array([0, 0, 1, 2]),
    np.array([[0.0, 0.0], [4.0, 0.0], [0.0, 8.0], [1.0, 1.0]]),
    np.array([1.0, np.nan, 5.0, np.nan]),
    np.full(4, np.nan),
)


def test_position_and_height_are_means_on_the_storey_with_most() -> None:
    votes = Votes(np.array([[0, 1, 2], [2, 3, 3]]), np.array([[1.0, 3.0, 2.0], [1.0, 1.0, 1.0]]))
    answer = counted_votes(votes, PLACES)
    np.testing.assert_allclose(answer.storey_probability, [[4 / 6, 2 / 6, 0], [0, 1 / 3, 2 / 3]])
    assert answer.storey.tolist() == [0, 2]
    np.testing.assert_allclose(answer.xy, [[3.0, 0.0], [1.0, 1.0]])
    np.testing.assert_array_equal(answer.z, [1.0, np.nan])
    assert answer.spread_m[0] == pytest.approx(np.sqrt((9 + 3 * 1 + 2 * (9 + 64)) / 6))
    assert answer.spread_m[1] == pytest.approx(np.sqrt(50 / 3))
    both = joined_rows([answer, counted_votes(Votes(votes.index[:0], votes.weight[:0]), PLACES), answer])
    np.testing.assert_array_equal(both.storey, [0, 2, 0, 2])
