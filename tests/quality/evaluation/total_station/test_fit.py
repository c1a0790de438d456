from __future__ import annotations

import numpy as np
import pytest

from tests.quality.evaluation.maps import without
from tests.quality.evaluation.total_station.stations import BCS_T_STATION, CLOCK_NS, corridor_walk, measured
from vislam2tag.core.status import Status
from vislam2tag.core.tracks import Trajectory
from vislam2tag.quality.evaluation.total_station.alignment import track_segment_of
from vislam2tag.quality.evaluation.total_station.fit import (
    CLIP_M,
    Adjustment,
    FreeParameters,
    TrackSegment,
    errors_m,
    fit_adjustment,
    mean_clipped_error_m,
    search_clock,
)


def segment(walk: Trajectory, clock_s: float = 0.0) -> TrackSegment:
    return track_segment_of(walk, measured(corridor_walk(), clock_s), BCS_T_STATION)


def test_errors_at_the_right_and_at_no_clock() -> None:
    one = segment(corridor_walk(), 2.0)
    assert errors_m(one, CLOCK_NS + 2_000_000_000) == pytest.approx(0, abs=1e-6)
    assert np.isnan(errors_m(one, CLOCK_NS + 10**12)).all()
    assert mean_clipped_error_m(one, CLOCK_NS + 10**12) == CLIP_M


@pytest.mark.parametrize("clock_s", [-25.25, 0.0, 86_400.0])
def test_the_search_needs_no_guess(clock_s: float) -> None:
    found = search_clock(segment(corridor_walk(), clock_s))
    assert (found - CLOCK_NS) * 1e-9 == pytest.approx(clock_s, abs=0.26)


def test_turns_and_stops_are_not_steady() -> None:
    one = segment(corridor_walk())
    turning = (one.prism_bcs[:, 0] < 0.2) | (one.prism_bcs[:, 0] > 19.8)
    assert turning.any()
    assert not one.steady[turning].any()
    assert one.steady[~turning].mean() > 0.9
    np.testing.assert_allclose(np.linalg.norm(one.ahead, axis=1), 1)


def test_unlabelled_stretches_do_not_count() -> None:
    walk = without(corridor_walk(), slice(400, 900), Status.BREAK)
    one = segment(walk, 0.3)
    found = fit_adjustment([one], Adjustment(int(one.time_ns[0]), CLOCK_NS), FreeParameters())
    assert (found.clock_ns - CLOCK_NS) * 1e-9 == pytest.approx(0.3, abs=1e-3)


def test_a_wild_third_of_the_labels_does_not_matter() -> None:
    walk = corridor_walk()
    walk.position_bcs[300:900, :2] += (3.0, -4.0)
    one = segment(walk, 0.3)
    found = fit_adjustment([one], Adjustment(int(one.time_ns[0]), CLOCK_NS), FreeParameters())
    assert (found.clock_ns - CLOCK_NS) * 1e-9 == pytest.approx(0.3, abs=0.02)


def test_an_adjustment_moves_time_and_place() -> None:
    one = segment(corridor_walk()).part(slice(5, 8))
    moved = Adjustment(int(one.time_ns[0]), 1000, drift_ppm=50.0, ahead_m=0.5, left_m=-0.25)
    lasted = one.time_ns - one.time_ns[0]
    np.testing.assert_array_equal(moved.label_time_ns(one.time_ns), one.time_ns - 1000 - lasted // 20_000)
    offset = one.prism_bcs - moved.camera_bcs(one)
    np.testing.assert_allclose((offset * one.ahead).sum(axis=1), 0.5)
    np.testing.assert_allclose((offset * one.left).sum(axis=1), -0.25)
