"""Predictions as a table, and the errors in it."""

from __future__ import annotations

import numpy as np
import pytest

from vislam2tag.dataset.model import Storey
from vislam2tag.positioning.benchmark.predictions import PREDICTIONS, predictions_table, with_errors
from vislam2tag.positioning.scans.places import Positions, ScanPlaces

STOREYS = (Storey("a", 0), Storey("a", 1))


def test_truth_and_answers_stand_side_by_side() -> None:
    nan = np.nan
    truth = ScanPlaces(STOREYS, np.array([0, 1, 1]), np.array([[0.0, 0], [3, 4], [1, 1]]), np.zeros(3), np.zeros(3))
    found = Positions(
        storeys=STOREYS,
        storey=np.array([0, 0, -1]),
        xy=np.array([[3.0, 4], [3, 4], [nan, nan]]),
        z=np.array([0.0, nan, nan]),
        storey_probability=np.zeros((3, 2)),
        radius_68_m=np.array([1.0, 2, nan]),
        radius_95_m=np.array([2.0, 4, nan]),
    )
    table = predictions_table(np.array(["s1", "s2", "s3"]), truth, found)
    assert dict(table.schema) == PREDICTIONS
    assert table["floor"].to_list() == [0, 1, 1]
    assert table["found_floor"].to_list() == [0, 0, None]
    assert table["found_z"].to_list() == [0.0, None, None]
    errors = with_errors(table)
    assert errors["error_m"].to_list() == [pytest.approx(5.0), pytest.approx(0.0), None]
    assert errors["on_floor"].to_list() == [True, False, False]
