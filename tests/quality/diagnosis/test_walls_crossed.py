"""Walls that ways lead through, but for what a tracker's error explains."""

from __future__ import annotations

import numpy as np
import pytest

from vislam2tag.core.arrays import BoolArray, ComplexArray, FloatArray
from vislam2tag.quality.diagnosis.walls_crossed import walls_crossed


def hall(points_m: FloatArray) -> BoolArray:
    """Two rooms, parted at x = 10 by a wall of 20 cm with a door from y = 4 to 5."""
    x, y = points_m.T
    return np.asarray((np.abs(x - 10) > 0.1) | ((y > 4) & (y < 5)))


def across(y: float, x: tuple[float, float] = (6.0, 14.0)) -> ComplexArray:
    return np.asarray(np.arange(*x, 0.5) + 1j * y)


GAP = across(9.0)
GAP[6:10] = np.nan


@pytest.mark.parametrize(
    ("ways", "walls"),
    [
        ([across(4.5)], 0),
        ([across(3.6), across(5.4)], 0),  # through the door, off by less than half a metre
        ([across(2.0)], 1),
        ([across(2.0), across(2.5), across(8.0)], 2),  # twice in one place
        ([across(2.0, (0.0, 8.0))], 0),
        ([GAP], 0),
        ([], 0),
    ],
)
def test_walls_that_ways_lead_through(ways: list[ComplexArray], walls: int) -> None:
    assert walls_crossed(hall, ways) == walls
