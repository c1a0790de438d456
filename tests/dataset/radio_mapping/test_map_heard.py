"""The share of scans that hear an access point."""

from __future__ import annotations

import numpy as np
import pytest

from vislam2tag.dataset.radio_mapping.map_heard import WIDTHS_M, best_width, heard_error, heard_matrix, heard_share


def test_a_reading_given_twice_is_heard_once() -> None:
    matrix = heard_matrix(np.array([0, 0, 2]), np.array([1, 1, 0]), 3, 2)
    assert matrix.toarray().tolist() == [[0, 1], [0, 0], [1, 0]]


def test_near_many_scans_the_share_is_theirs_and_far_away_the_floors() -> None:
    scans = np.zeros((400, 2))
    heard = heard_matrix(np.arange(100), np.zeros(100, dtype=np.int64), 400, 1)
    share = heard_share(np.array([[0.0, 0.0], [500.0, 0.0]]), scans, heard, np.array([0.9]), 1.0)
    assert share[0, 0] == pytest.approx(0.25, abs=0.01)
    assert share[1, 0] == pytest.approx(0.9)


def test_it_changes_from_place_to_place() -> None:
    scans = np.column_stack((np.repeat([0.0, 30.0], 50), np.zeros(100)))
    heard = heard_matrix(np.arange(50), np.zeros(50, dtype=np.int64), 100, 1)
    share = heard_share(np.array([[0.0, 1.0], [30.0, 1.0]]), scans, heard, np.array([0.5]), 2.0)
    assert share[:, 0] == pytest.approx([1, 0], abs=0.02)
    assert ((share >= 0) & (share <= 1)).all()


@pytest.mark.parametrize(("period_m", "expected"), [(4.0, WIDTHS_M[0]), (1e6, WIDTHS_M[-1])])
def test_the_width_follows_how_quickly_the_share_changes(period_m: float, expected: float) -> None:
    rng = np.random.default_rng(1)
    scans = np.column_stack((rng.uniform(0, 60, 1500), np.zeros(1500)))
    probability = 0.5 + 0.5 * np.sign(np.sin(2 * np.pi * scans[:, 0] / period_m + 1)) * (period_m < 1e5)
    scan = np.flatnonzero(rng.random(1500) < probability)
    heard = heard_matrix(scan, np.zeros(len(scan), dtype=np.int64), 1500, 1)
    assert best_width(scans, np.arange(1500) % 5, heard) == expected


def test_a_scan_does_not_predict_its_own_fold() -> None:
    scans = np.zeros((10, 2))
    heard = heard_matrix(np.arange(5), np.zeros(5, dtype=np.int64), 10, 1)
    fold = np.repeat([0, 1], 5)
    assert heard_error(scans, fold, heard, 1.0)[0] > 0.5
