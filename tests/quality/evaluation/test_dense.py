from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.quality.evaluation.maps import straight_walk, trajectory_of, without
from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.core.status import Status
from vislam2tag.quality.evaluation.dense import (
    DISTANCES_M,
    SINCE_EDGES_M,
    SPEED_EDGES_M_S,
    TruePath,
    dense_errors,
    dense_figures,
    drift_per_metre,
    relative_errors,
)
from vislam2tag.quality.evaluation.record import DriftSums
from vislam2tag.quality.evaluation.truth import Truth, TruthKind

SECOND = 1_000_000_000


def path_along_x(metres: float = 100.0, speed_m_s: float = 1.0) -> TruePath:
    x = np.arange(0.0, metres + 1e-9, 0.1)
    return TruePath.of(Truth(SECOND + (x / speed_m_s * SECOND).astype(np.int64), np.column_stack((x, 0 * x))))


def times_at(path: TruePath, *metres: float) -> IntArray:
    """When the path is so far along."""
    time_ns = np.interp(metres, path.path_length_m, path.truth.time_ns - SECOND)
    return SECOND + time_ns.astype(np.int64)


def labels_off_by(path: TruePath, offset: FloatArray) -> FloatArray:
    return path.truth.position_bcs + offset


@given(st.floats(-3, 3), st.floats(-3, 3))
def test_a_constant_error_is_no_error_of_the_displacement(x: float, y: float) -> None:
    path = path_along_x()
    labels = trajectory_of(path.truth.time_ns, labels_off_by(path, np.array([x, y])))
    points = dense_errors(labels, path)
    assert points.kind is TruthKind.DENSE
    assert points.error_m == pytest.approx(np.hypot(x, y), abs=1e-9)
    assert points.along_m[5:-5] == pytest.approx(x, abs=1e-9)
    for distance in DISTANCES_M:
        assert relative_errors(points, path.path_length_m, distance) == pytest.approx(0, abs=1e-9)


def test_a_wrong_scale_shows_in_proportion_to_the_way() -> None:
    path = path_along_x()
    points = dense_errors(trajectory_of(path.truth.time_ns, path.truth.position_bcs * 1.02), path)
    for figure in dense_figures(points, path, times_at(path, 0.0)).relative:
        assert figure.pairs == pytest.approx((100 - figure.distance_m) * 10, abs=2)
        assert figure.sum_m / figure.pairs == pytest.approx(0.02 * figure.distance_m, rel=2e-3)
        assert figure.sum_m2 / figure.pairs == pytest.approx((0.02 * figure.distance_m) ** 2, rel=4e-3)


def test_errors_grow_from_landmark_to_landmark() -> None:
    path = path_along_x()
    since = np.mod(path.truth.position_bcs[:, 0], 25.0)
    labels = labels_off_by(path, np.column_stack((0 * since, 0.1 + 0.03 * since)))
    points = dense_errors(trajectory_of(path.truth.time_ns, labels), path)
    figures = dense_figures(points, path, times_at(path, 0.0, 25.0, 50.0, 75.0))
    assert drift_per_metre([figures.drift]) == pytest.approx(0.03, rel=0.01)
    ways = dict(zip(SINCE_EDGES_M, figures.since_landmark, strict=False))
    assert ways[10.0].points == pytest.approx(4 * 100, abs=5)
    assert ways[10.0].sum_m / ways[10.0].labelled == pytest.approx(0.1 + 0.03 * 15, rel=0.02)
    assert ways[50.0].points == 0


def test_before_the_first_landmark_no_way_is_known() -> None:
    path = path_along_x()
    since = path.since_m(times_at(path, 40.0))
    assert np.isnan(since[:399]).all()
    assert since[450] == pytest.approx(5.0, abs=0.01)
    assert np.isnan(path.since_m(np.array([0], dtype=np.int64))).all()


def test_nothing_spans_a_hole_of_the_truth() -> None:
    whole = path_along_x()
    keep = (whole.truth.position_bcs[:, 0] < 30) | (whole.truth.position_bcs[:, 0] > 40)
    path = TruePath.of(Truth(whole.truth.time_ns[keep], whole.truth.position_bcs[keep]))
    points = dense_errors(trajectory_of(path.truth.time_ns, path.truth.position_bcs), path)
    assert len(relative_errors(points, path.path_length_m, 50.0)) == pytest.approx(100, abs=5)
    assert np.isnan(path.since_m(times_at(whole, 10.0))[-1])
    assert np.isnan(path.since_m(times_at(whole, 35.0))).all()
    assert np.isnan(path.speed_m_s).sum() == pytest.approx(10, abs=2)
    assert np.nanmax(path.speed_m_s) == pytest.approx(1.0)


def test_what_is_discarded_is_counted_by_speed_between_the_landmarks() -> None:
    path = path_along_x(10.0, speed_m_s=1.0)
    labels = without(straight_walk(shift=(0.0, 0.5)), slice(20, 40), Status.BREAK)
    figures = dense_figures(dense_errors(labels, path), path, times_at(path, 1.0, 9.0))
    usual = figures.speed[SPEED_EDGES_M_S.index(0.8)]
    assert usual.points == sum(one.points for one in figures.speed) == 81
    assert usual.points - usual.labelled == pytest.approx(20, abs=2)
    assert usual.sum_m / usual.labelled == pytest.approx(0.5)


def sums(distance_m: list[float], error_m: list[float]) -> DriftSums:
    d, e = np.array(distance_m), np.array(error_m)
    return DriftSums(
        points=len(d), distance_m=d.sum(), error_m=e.sum(), distance_m2=(d**2).sum(), distance_error_m2=(d * e).sum()
    )


def test_one_distance_gives_no_slope() -> None:
    assert drift_per_metre([]) is None
    assert drift_per_metre([DriftSums(), sums([2.0, 2.0, 2.0], [0.1, 0.3, 0.6])]) is None


def test_a_walk_that_is_wrong_as_a_whole_is_no_drift() -> None:
    good = sums([1.0, 2.0, 3.0], [0.1, 0.2, 0.3])
    bad = sums([0.0, 1.0], [10.0, 10.2])
    assert drift_per_metre([good]) == pytest.approx(0.1)
    assert drift_per_metre([good, bad]) == pytest.approx((0.2 + 0.1) / (2 + 0.5))
