"""Votes: the storey first, then the mean on it, and how far all of them lie apart."""

from __future__ import annotations

import numpy as np
import pytest

from tests.positioning.radio_world import STOREYS
from vislam2tag.positioning.baselines.votes import Votes, counted_votes, joined_answers
from vislam2tag.positioning.scans.places import ScanPlaces

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
    both = joined_answers([answer, counted_votes(Votes(votes.index[:0], votes.weight[:0]), PLACES), answer])
    np.testing.assert_array_equal(both.storey, [0, 2, 0, 2])
