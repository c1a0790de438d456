"""Doors open the wall that they are at, whatever the unit; areas that adjoin become one."""

from __future__ import annotations

import numpy as np
import pytest

from vislam2tag.core.arrays import FloatArray
from vislam2tag.site.plans.indoor import closed_off, door_lines, door_width_m, joined, metres_per_unit, ring_segments
from vislam2tag.site.plans.source import PlanSource

ONE = np.ones(2)
SQUARE = np.array([(0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (0.0, 4.0)])


def moved(x: float, y: float) -> FloatArray:
    return np.asarray(SQUARE + np.array([x, y]))


@pytest.mark.parametrize(
    ("tag", "metres"), [("0.9", 0.9), ("90 cm", 0.9), ("1,2 m", 1.2), (None, 1.0), ("wide", 1.0), ("900", 1.0)]
)
def test_width_of_a_door(tag: object, metres: float) -> None:
    assert door_width_m(tag) == pytest.approx(metres)


def test_a_door_is_on_its_wall() -> None:
    walls = ring_segments([(SQUARE, ())])
    beside, away = door_lines(np.array([(2.0, 0.2), (2.0, 2.0)]), np.array([0.8, 0.8]), walls, ONE)
    assert away is None
    assert beside is not None
    assert np.sort(beside, axis=0).tolist() == [[1.6, 0.0], [2.4, 0.0]]


def test_width_in_the_files_units() -> None:
    scale = np.array([0.5, 2.0])
    line = door_lines(np.array([(4.0, 1.0)]), np.array([1.0]), ring_segments([(SQUARE, ())]), scale)[0]
    assert line is not None
    assert np.ptp(line, axis=0).tolist() == [0.0, 0.5]


def test_units() -> None:
    bounds = (13.0, 13.001, 51.0, 51.001)
    assert metres_per_unit(PlanSource(file="x"), 4326, bounds) == pytest.approx((70_050, 111_320), rel=1e-3)
    assert metres_per_unit(PlanSource(file="x"), 25832, bounds).tolist() == [1, 1]
    extent = {"file": "x", "extent": {"width_m": 20.0}}
    assert metres_per_unit(PlanSource.model_validate(extent), None, (0, 20_000, 0, 9)).tolist() == [0.001, 0.001]


def test_areas_that_adjoin_become_one() -> None:
    polygons = joined([(SQUARE, ()), (moved(4.02, 1.0), ()), (moved(20.0, 0.0), ())], ONE)
    assert len(polygons) == 2


def test_rooms_without_a_door() -> None:
    rooms = [(SQUARE, ()), (moved(9.0, 0.0), ())]
    assert closed_off(rooms, [np.array([(4.1, 1.0), (4.1, 2.0)])], ONE) == 1
    assert closed_off(rooms, [], ONE) == 2
