"""Expected sigmas in cells and by distance."""

from __future__ import annotations

import numpy as np
import pytest

from tests.preparation.planning.floors import INNER, ring
from vislam2tag.preparation.planning.prediction import ExpectedLabels
from vislam2tag.preparation.planning.refine import distance_classes, sigma_map


def walk(y: float, variance: float) -> ExpectedLabels:
    path = np.column_stack((np.arange(1.0, 29.0, 0.1), np.full(280, y)))
    return ExpectedLabels(path, np.tile(np.eye(2) * variance, (280, 1, 1)))


def test_cells_hold_what_their_walks_expect_and_nothing_lies_in_walls() -> None:
    space, _ = ring()
    found = sigma_map(space, [walk(1.0, 0.04), walk(1.0, 0.08), walk(15.0, 0.01)])
    low, high = (found.grid.cells_of(np.array([(10.0, y)]))[0] for y in (1.0, 15.0))
    assert found.sigma_m[tuple(low)] == pytest.approx(np.sqrt(0.06))
    assert found.sigma_m[tuple(high)] == pytest.approx(0.1)
    inside = found.grid.cells_of(np.array([((INNER[0] + INNER[2]) / 2, (INNER[1] + INNER[3]) / 2)]))[0]
    assert np.isnan(found.sigma_m[tuple(inside)])
    side = found.grid.cells_of(np.array([(1.0, 5.0)]))[0]
    assert found.sigma_m[tuple(side)] == pytest.approx(np.sqrt(0.06), rel=0.05)


def test_all_that_can_be_walked_has_a_value_however_far_from_a_walk() -> None:
    space, _ = ring()
    short = ExpectedLabels(np.array([(1.0, 1.0)]), np.eye(2)[None] * 0.04)
    found = sigma_map(space, [short])
    cells = np.argwhere(np.ones(found.grid.shape, dtype=np.bool_))
    walkable = (space.clearance_at(found.grid.centres_m(cells)) > 0.2).reshape(found.grid.shape)
    assert walkable.any()
    assert found.sigma_m[walkable] == pytest.approx(0.2)


def test_without_walks_nothing_is_expected() -> None:
    space, _ = ring()
    assert np.isnan(sigma_map(space, []).sigma_m).all()
    assert distance_classes(space, np.array([(5.0, 0.0)]), []) == []


def test_classes_go_by_the_way_to_the_nearest_landmark() -> None:
    space, _ = ring()
    classes = distance_classes(space, np.array([(1.0, 0.0)]), [walk(1.0, 0.04)])
    assert [(one.low_m, one.high_m) for one in classes][:3] == [(0.0, 5.0), (5.0, 10.0), (10.0, 15.0)]
    assert sum(one.share for one in classes) == pytest.approx(1.0)
    assert all(one.sigma_m == pytest.approx(0.2) for one in classes)
    assert all(one.error_m == pytest.approx(0.2 * np.sqrt(np.pi / 2)) for one in classes)
