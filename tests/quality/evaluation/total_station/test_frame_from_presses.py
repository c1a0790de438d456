from __future__ import annotations

import numpy as np
import pytest

from tests.quality.evaluation.maps import floor_with
from tests.quality.evaluation.total_station.stations import BCS_T_STATION, CLOCK_NS, corridor_walk, measured
from vislam2tag.common.errors import SurveyError
from vislam2tag.core.arrays import IntArray
from vislam2tag.core.tracks import Trajectory
from vislam2tag.quality.evaluation.control_points.press_truth import press_truth
from vislam2tag.quality.evaluation.total_station.frame import CommonPoints, fit_frame
from vislam2tag.quality.evaluation.total_station.frame_from_presses import clock_by_speed, pressed_points
from vislam2tag.quality.evaluation.total_station.station_file import StationTrack

POINTS = np.array([[3.0, 0.0], [9.0, 0.0], [15.0, 0.0]])


def pressed(walk: Trajectory, late_s: float = 0.0) -> IntArray:
    """Times at which the walk passes the points, first to last, pressed late."""
    x = walk.position_bcs[:, 0]
    passed = [int(np.argmax(x >= point)) for point in POINTS[:, 0]]
    return walk.time_ns[passed] + round(late_s * 1e9)


@pytest.mark.parametrize("clock_s", [-3.3, 0.0, 5000.0])
def test_speeds_tell_the_clock_in_any_frame(clock_s: float) -> None:
    walk = corridor_walk(noise_m=0.05)
    found = clock_by_speed(walk, measured(corridor_walk(), clock_s))
    assert (found - CLOCK_NS) * 1e-9 == pytest.approx(clock_s, abs=0.11)


def test_the_frame_from_presses() -> None:
    walks = [corridor_walk(1000.0 * (1 + seed), seed=seed) for seed in range(3)]
    floor = floor_with(POINTS)
    found = [pressed_points(w, measured(w, 7.0), press_truth(w, pressed(w), floor)) for w in walks]
    frame = fit_frame(CommonPoints.joined(found))
    assert len(frame.residual_m) >= 6
    assert np.abs(frame.bcs_t_station @ (BCS_T_STATION.inverse @ POINTS) - POINTS).max() < 0.6


def test_presses_the_station_did_not_see_do_not_count() -> None:
    walk = corridor_walk()
    track = measured(walk)
    moments = pressed(walk)
    blind = np.abs(track.time_ns - CLOCK_NS - moments[1]) < 1_500_000_000
    gappy = StationTrack(track.time_ns[~blind], track.position[~blind])
    assert pressed_points(walk, gappy, press_truth(walk, moments, floor_with(POINTS))).names == ("point 0", "point 2")


def test_another_motion_is_refused() -> None:
    with pytest.raises(SurveyError, match="never move alike"):
        clock_by_speed(corridor_walk(duration_s=15.0), measured(corridor_walk()))
