from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import f

from tests.quality.evaluation.maps import trajectory_of
from tests.quality.evaluation.total_station.stations import (
    CLOCK_NS,
    before_station,
    corridor_walk,
    frame,
    measured,
    with_labels_of,
)
from vislam2tag.common.errors import SurveyError
from vislam2tag.core.tracks import Trajectory
from vislam2tag.quality.evaluation.total_station.alignment import StationWalk, align_device
from vislam2tag.quality.evaluation.total_station.fit import FreeParameters
from vislam2tag.quality.evaluation.total_station.station_errors import station_point_errors


def three_walks(noise_m: float = 0.0) -> list[Trajectory]:
    return [corridor_walk(1000.0 * (1 + i), seed=i, noise_m=noise_m) for i in range(3)]


def shifted(walk: Trajectory, x: float) -> Trajectory:
    return trajectory_of(walk.time_ns, walk.position_bcs[:, :2] + (x, 0.0))


def test_one_clock_for_all_walks_of_a_device() -> None:
    walks = before_station(three_walks(), clock_s=4.23)
    found = align_device(walks)
    assert (found.adjustment.clock_ns - CLOCK_NS) * 1e-9 == pytest.approx(4.23, abs=1e-3)
    assert found.clock_sigma_s < 1e-3
    assert found.prism.ahead_m.value == pytest.approx(0, abs=0.01)
    for walk, truth in zip(walks, found.truths, strict=True):
        assert truth is not None
        assert station_point_errors(walk.reference, truth).error_m.max() < 0.02


@pytest.mark.parametrize("draws", [8, pytest.param(30, marks=pytest.mark.campaign)])
def test_the_stated_sigma_of_the_clock_is_its_scatter(draws: int) -> None:
    """Of normal errors and a jackknife over four walks the ratio of squares follows F: one test in a hundred misses."""
    errors, sigmas = [], []
    for seed in range(draws):
        exact = [corridor_walk(1000.0 * (1 + i), seed=9 * seed + i) for i in range(4)]
        noisy = [corridor_walk(1000.0 * (1 + i), seed=9 * seed + i, noise_m=0.2) for i in range(4)]
        pairs = zip(before_station(exact), noisy, strict=True)
        found = align_device([with_labels_of(walk, labels) for walk, labels in pairs])
        errors.append((found.adjustment.clock_ns - CLOCK_NS) * 1e-9)
        sigmas.append(found.clock_sigma_s)
    least, most = f.interval(0.99, draws, 3 * draws)
    assert least < np.mean(np.square(errors)) / np.mean(np.square(sigmas)) < most


def test_no_walk_places_itself() -> None:
    # One walk's labels are a metre ahead in time: its own clock would hide that, the others' shows it.
    walks = before_station(three_walks())
    late = walks[0].reference
    walks[0] = with_labels_of(walks[0], trajectory_of(late.time_ns + 1_000_000_000, late.position_bcs[:, :2]))
    found = align_device(walks)
    assert found.truths[0] is not None
    errors = station_point_errors(walks[0].reference, found.truths[0])
    assert np.nanmedian(errors.along_m) == pytest.approx(-1.0, abs=0.25)
    assert found.truths[1] is not None
    assert found.clock_sigma_s > 0.01


def test_a_single_walk_is_cut_into_parts() -> None:
    found = align_device(before_station([corridor_walk()], clock_s=-1.5))
    assert found.folds == 4
    assert (found.adjustment.clock_ns - CLOCK_NS) * 1e-9 == pytest.approx(-1.5, abs=1e-3)


def test_prism_and_drift_are_found_and_taken_off() -> None:
    exact = three_walks()
    walks = [StationWalk(walk, measured(walk, 0.8, (0.25, -0.1), 40.0, 1001.0), frame()) for walk in exact]
    plain, free = align_device(walks), align_device(walks, FreeParameters(drift=True, prism=True))
    assert free.prism.ahead_m.value == pytest.approx(0.25, abs=0.02)
    assert free.prism.left_m.value == pytest.approx(-0.1, abs=0.02)
    assert free.drift_ppm is not None
    assert free.drift_ppm.value == pytest.approx(40.0, abs=4.0)
    assert plain.drift_ppm is None
    errors = [
        [
            np.nanmean(station_point_errors(w.reference, t).error_m)
            for w, t in zip(walks, found.truths, strict=True)
            if t
        ]
        for found in (plain, free)
    ]
    assert max(errors[1]) < 0.05 < min(errors[0])


def test_bad_labels_are_scored_and_do_not_move_the_clock() -> None:
    walks = before_station(three_walks(), clock_s=2.0)
    walks[1] = with_labels_of(walks[1], shifted(walks[1].reference, 7.0))
    found = align_device(walks)
    assert (found.adjustment.clock_ns - CLOCK_NS) * 1e-9 == pytest.approx(2.0, abs=0.02)
    assert found.truths[1] is not None
    assert np.nanmean(station_point_errors(walks[1].reference, found.truths[1]).error_m) == pytest.approx(7.0, abs=0.05)


def test_a_walk_on_another_clock_is_left_out() -> None:
    walks = before_station(three_walks())
    track = measured(walks[2].reference, clock_s=7200.0)
    walks[2] = StationWalk(walks[2].reference, track, walks[2].frame)
    found = align_device(walks)
    assert [truth is None for truth in found.truths] == [False, False, True]
    assert found.off_s[2] == pytest.approx(7200.0, abs=1.0)
    assert found.clock_sigma_s < 1e-3


def test_a_track_from_elsewhere_is_refused() -> None:
    walk = before_station([corridor_walk()])[0]
    with pytest.raises(SurveyError, match="matches the labels at no clock offset"):
        align_device([with_labels_of(walk, shifted(walk.reference, 40.0))])
