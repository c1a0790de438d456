from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import f

from tests.quality.evaluation.maps import straight_walk, trajectory_of, without
from tests.quality.evaluation.stations import (
    BCS_T_STATION,
    CLOCK_NS,
    before_station,
    corridor_walk,
    frame,
    measured,
    with_labels_of,
)
from vislam2tag.common.errors import SurveyError
from vislam2tag.core.status import Status
from vislam2tag.core.tracks import Trajectory
from vislam2tag.quality.evaluation.station_clock import (
    CLIP_M,
    Adjustment,
    FreeParameters,
    StationWalk,
    TrackSegment,
    align_device,
    clock_offset,
    errors_m,
    fit_adjustment,
    mean_clipped_error_m,
    search_clock,
    station_findings,
    station_point_errors,
    track_segment_of,
)
from vislam2tag.quality.evaluation.truth import Truth, TruthKind


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


def three_walks(noise_m: float = 0.0) -> list[Trajectory]:
    return [corridor_walk(1000.0 * (1 + i), seed=i, noise_m=noise_m) for i in range(3)]


def shifted(walk: Trajectory, x: float) -> Trajectory:
    return trajectory_of(walk.time_ns, walk.position_bcs[:, :2] + (x, 0.0))


def test_one_clock_for_all_walks_of_a_device() -> None:
    walks = before_station(three_walks(), clock_s=4.23)
    found = align_device(walks)
    assert (found.adjustment.clock_ns - CLOCK_NS) * 1e-9 == pytest.approx(4.23, abs=1e-3)
    assert found.clock_sigma_s < 1e-3
    assert found.prism_ahead_m.value == pytest.approx(0, abs=0.01)
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
    assert free.prism_ahead_m.value == pytest.approx(0.25, abs=0.02)
    assert free.prism_left_m.value == pytest.approx(-0.1, abs=0.02)
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
    with pytest.raises(SurveyError, match="does not match the labels at any clock offset"):
        align_device([with_labels_of(walk, shifted(walk.reference, 40.0))])


def test_errors_at_the_stations_rate() -> None:
    walk = straight_walk(shift=(0.4, 0.3))
    seconds = np.arange(1.0, 9.0, 0.25)
    time_ns = ((1 + seconds) * 1e9).astype(np.int64)
    truth = Truth(time_ns, np.column_stack((seconds, np.zeros_like(seconds))))
    errors = station_point_errors(walk, truth)
    assert errors.kind is TruthKind.TOTAL_STATION
    np.testing.assert_allclose(errors.error_m, 0.5)
    np.testing.assert_allclose(errors.along_m, 0.4)
    np.testing.assert_allclose(errors.across_m, 0.3)
    assert not station_point_errors(walk, Truth(time_ns + 10**12, truth.position_bcs)).labelled.any()


def test_the_papers_clock_is_that_of_least_error_over_all_walks() -> None:
    walks = [corridor_walk(1000.0, seed=1), corridor_walk(2000.0, seed=2)]
    found = clock_offset([(walk, measured(walk, 4.23)) for walk in walks], BCS_T_STATION)
    assert (found - CLOCK_NS) / 1e9 == pytest.approx(4.23, abs=0.011)


def test_findings_say_why_a_walk_is_not_scored() -> None:
    walks = before_station([corridor_walk(1000.0, seed=1), corridor_walk(2000.0, seed=2)])
    restarted = StationWalk(walks[1].reference, replace(measured(walks[1].reference, 3600.0), left_out=3), frame())
    walks = [walks[0], walks[0], restarted]
    alignment = align_device(walks)
    assert station_findings(walks[0], alignment, 0) == []
    kinds = {finding.kind: finding for finding in station_findings(restarted, alignment, 2)}
    assert list(kinds) == ["station_rows", "station_no_overlap"]
    assert kinds["station_rows"].count == 3
    assert "+3600." in kinds["station_no_overlap"].message


def test_an_unsure_clock_is_a_finding() -> None:
    walk = before_station([corridor_walk()])[0]
    alignment = replace(align_device([walk]), clock_sigma_s=0.4)
    (finding,) = station_findings(walk, alignment, 0)
    assert (finding.kind, "0.40 s" in finding.message) == ("station_clock", True)
