"""Durations and lengths of a walk, counted by hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import polars as pl
import pytest

from tests.pipeline.labels.mapped import walk
from vislam2tag.core.status import Status, counts_by_label
from vislam2tag.labeling.status_column import status_codes
from vislam2tag.pipeline.labels.statistics import (
    distance_m,
    frame_seconds,
    scan_statistics,
    sigma_statistics,
)

OK, UNCERTAIN, LOST, INVALID = Status.OK, Status.UNCERTAIN, Status.TRACKING_LOST, Status.INVALID


def test_each_usable_frame_stands_for_the_time_to_the_next() -> None:
    camera, trajectory = walk(np.array([0.0, 0.5, 1.5, 4.0]), [OK, UNCERTAIN, LOST, OK])
    assert frame_seconds(camera, trajectory, 2.0) == {"ok": 0.5, "uncertain": 1.0, "tracking_lost": 2.5}
    assert counts_by_label(trajectory.status) == {"ok": 2, "tracking_lost": 1, "uncertain": 1}


def test_a_mapped_frame_stands_for_no_long_time() -> None:
    camera, trajectory = walk(np.array([0.0, 3.0, 4.0, 6.0, 7.0]), [OK, OK, INVALID, OK, OK])
    camera = replace(camera, status=np.array([0, 0, INVALID, 0, 0], dtype=np.int8))
    assert frame_seconds(camera, trajectory, 2.0) == {"ok": 1.0, "gap": 3.0, "invalid": 3.0}


def test_the_length_is_that_on_the_floor_where_it_is_mapped_and_the_trackers_elsewhere() -> None:
    camera, trajectory = walk(np.arange(8.0), [OK] * 4 + [LOST] * 4)
    trajectory.position_bcs[:4, 0] *= 1.1
    assert distance_m(camera, trajectory) == pytest.approx(3 * 1.1 + 4)


def test_how_sure_the_mapped_frames_are() -> None:
    _, trajectory = walk(np.arange(4.0), [OK, OK, UNCERTAIN, LOST], sigma_m=0.2)
    trajectory.covariance_bcs[2] = np.eye(2) * 4.0
    found = sigma_statistics(trajectory)
    assert found is not None
    assert (found.median_m, sum(found.frames.values())) == (0.2, 3)
    assert found.uncertain_share == pytest.approx(1 / 3, abs=1e-6)
    _, lost = walk(np.arange(2.0), [LOST, LOST])
    assert sigma_statistics(lost) is None


def test_scans_and_statuses_of_a_table() -> None:
    table = pl.DataFrame(
        {
            "scan": [1, 1, 2, 3],
            "time_ns": [0, 0, 4 * 10**9, 8 * 10**9],
            "bssid": ["a", "b", "a", "a"],
            "repeated": [False, False, False, True],
            "status": ["gap", "ok", "ok", "duplicate"],
        }
    )
    assert list(counts_by_label(status_codes(table)).items()) == [("ok", 2), ("gap", 1), ("duplicate", 1)]
    found = scan_statistics(table)
    assert found is not None
    assert (found.scans, found.readings, found.repeated, found.access_points) == (3, 4, 1, 2)
    assert found.median_interval_s == 4.0
    assert scan_statistics(table.clear()) is None
