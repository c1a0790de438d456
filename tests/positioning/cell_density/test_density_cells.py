"""Cells near places, and what densities over them answer."""

from __future__ import annotations

import numpy as np
import pytest

from vislam2tag.core.arrays import FloatArray
from vislam2tag.dataset.model import Storey
from vislam2tag.positioning.cell_density.density_cells import DensityCells, cells_near
from vislam2tag.positioning.scans.places import ScanPlaces

STOREYS = (Storey(building="A", floor=0), Storey(building="A", floor=1))


def places(storey: list[int], xy: list[tuple[float, float]], sigma_m: float = np.nan) -> ScanPlaces:
    count = len(storey)
    return ScanPlaces(
        storeys=STOREYS,
        storey=np.array(storey),
        xy=np.array(xy),
        z=np.full(count, np.nan),
        sigma_m=np.full(count, sigma_m),
    )


def line(*x: float) -> DensityCells:
    return DensityCells(np.zeros(len(x), dtype=np.int64), np.column_stack((x, np.zeros(len(x)))))


def test_cells_hold_the_places_and_their_neighbours_on_the_same_storey() -> None:
    cells = cells_near(places([0, 1, 1], [(0.5, 0.5), (-0.1, 4.0), (-0.2, 6.1)]), side_m=2.0)
    assert np.bincount(cells.storey).tolist() == [9, 12]
    lower = cells.centre_m[cells.storey == 0]
    assert sorted(map(tuple, lower.tolist())) == [(x, y) for x in (-1.0, 1.0, 3.0) for y in (-1.0, 1.0, 3.0)]
    assert (np.diff(cells.storey) >= 0).all()


def test_a_label_spreads_over_its_storey_alone_and_wider_where_it_is_unsure() -> None:
    cells = DensityCells(np.array([0, 0, 1]), np.array([[0.0, 0.0], [3.0, 0.0], [0.0, 0.0]]))
    near, unsure = (cells.label_densities(places([0], [(0.0, 0.0)], sigma_m), 1.5)[0] for sigma_m in (np.nan, 3.0))
    assert near[2] == 0
    assert near.sum() == pytest.approx(1)
    assert near[1] / near[0] == pytest.approx(np.exp(-2.0))
    assert unsure[1] / unsure[0] == pytest.approx(np.exp(-9 / (2 * (1.5**2 + 3.0**2))))


def test_the_median_is_not_pulled_by_a_far_second_guess() -> None:
    density: FloatArray = np.array([[0.45, 0.35, 0.2]])
    cells = line(0.0, 1.0, 100.0)
    median = cells.median(density)
    assert median[0, 0] < 2.0
    assert median[0, 1] == 0
    assert cells.spread_m(2 * density, np.zeros((1, 2))) == pytest.approx([0.35 + 20.0])
