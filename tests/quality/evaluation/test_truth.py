from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.quality.evaluation.maps import errors_at_origin, floor_with, straight_walk, without
from vislam2tag.common.errors import SessionError
from vislam2tag.core.status import Status
from vislam2tag.labeling.settings import TruthSettings
from vislam2tag.quality.evaluation.press_truth import nearest_point_errors
from vislam2tag.quality.evaluation.truth import (
    Truth,
    covariances_at,
    errors_at_frames,
    heading_of,
    press_covariance,
    read_truth,
    residuals_at_presses,
    residuals_at_truth,
    walking_velocity,
)


def truth_along_x(seconds: list[float]) -> Truth:
    moments = np.array(seconds)
    return Truth((1_000_000_000 + moments * 1e9).astype(np.int64), np.column_stack((moments, np.zeros(len(moments)))))


def test_reads_what_the_simulator_and_the_real_walks_have(tmp_path: Path) -> None:
    path = tmp_path / "truth.csv"
    path.write_text("time_ns,x,y,z,floor\n20,3,4,1,0\n10,1.5,2,1,0\n20,3,4,1,0\n")
    truth = read_truth(path)
    assert truth.time_ns.tolist() == [10, 20]
    np.testing.assert_array_equal(truth.position_bcs, [[1.5, 2], [3, 4]])
    path.write_text("time_ns,x,y\n5,1,2\n")
    assert len(read_truth(path).time_ns) == 1


@pytest.mark.parametrize(
    "content",
    ["", "\n", "t,x,y\n1,2,3\n", "time_ns,x,y\n1,a,3\n", "time_ns,x,y\n", "time_ns,x,y\n\n", "time_ns,x,x\n1,2,3\n"],
)
def test_another_file_is_refused(tmp_path: Path, content: str) -> None:
    path = tmp_path / "truth.csv"
    path.write_text(content)
    with pytest.raises(SessionError, match=r"truth\.csv: expected"):
        read_truth(path)


def test_rows_without_time_or_position_are_left_out_and_counted(tmp_path: Path) -> None:
    path = tmp_path / "truth.csv"
    rows = [
        "1,1,2",
        "2,,2",
        "3,NaN,2",
        "",
        "4,inf,2",
        "5,3,4",
        "6,1e300,0",
        "x,1,1",
        "9999999999999999999,1,1",
        "-1,1,1",
    ]
    path.write_text("time_ns,x,y\n" + "\n".join(rows) + "\n7")
    truth = read_truth(path)
    assert truth.time_ns.tolist() == [1, 5]
    (finding,) = truth.findings
    assert (finding.kind, finding.file, finding.count) == ("unusable_truth_rows", "truth.csv", 9)
    assert finding.lines == (3, 4, 5, 6, 8)


def test_errors_at_frames_interpolate_the_truth() -> None:
    walk = without(straight_walk(shift=(0.0, 2.0)), slice(0, 20), Status.BEFORE_FIRST_LANDMARK)
    errors = errors_at_frames(walk, truth_along_x([1.0, 4.0, 8.0]))
    assert np.isnan(errors[:20]).all()
    assert np.isnan(errors[81:]).all()
    np.testing.assert_allclose(errors[20:81], 2.0)


POINTS = np.array([[2.0, 0.5], [6.0, -0.5]])


def at(*seconds: float) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    return (1_000_000_000 + np.array(seconds) * 1e9).astype(np.int64)


def test_errors_are_label_minus_truth() -> None:
    walk = without(straight_walk(shift=(0.3, 0.4)), slice(50, 60), Status.BREAK)
    truth = Truth(at(1.0, 2.55, 5.5, 20.0), np.column_stack(([1.0, 2.55, 5.5, 20.0], np.zeros(4))))
    residuals = residuals_at_truth(walk, truth)
    np.testing.assert_allclose(residuals.error_m, [[0.3, 0.4], [0.3, 0.4], [np.nan] * 2, [np.nan] * 2], atol=1e-9)


def test_presses_are_compared_with_the_nearest_point() -> None:
    walk = without(straight_walk(), slice(90, 101), Status.AFTER_LAST_LANDMARK)
    presses = at(2.05, 5.6, 9.5)
    residuals = residuals_at_presses(walk, presses, POINTS)
    np.testing.assert_allclose(residuals.error_m, [[0.05, -0.5], [-0.4, 0.5], [np.nan] * 2], atol=1e-9)
    np.testing.assert_allclose(
        np.linalg.norm(residuals.error_m, axis=1), nearest_point_errors(walk, presses, floor_with(POINTS)).error_m
    )


def test_a_finger_off_in_time_is_off_along_the_walk() -> None:
    north_m_s = np.array([[0.0, 2.0], [np.nan, np.nan]])
    found = press_covariance(north_m_s, TruthSettings(press_sigma_s=0.5, press_sigma_m=0.1))
    np.testing.assert_allclose(found[0], [[0.01, 0.0], [0.0, 1.01]])
    assert np.isnan(found[1]).all()


def test_a_truth_file_may_tell_how_exact_it_is(tmp_path: Path) -> None:
    (tmp_path / "truth.csv").write_text("time_ns,x,y,sigma_m\n1,0,0,0.3\n2,1,0,\n3,2,0,0.1\n")
    truth = read_truth(tmp_path / "truth.csv")
    assert (truth.sigma_or(9.0).tolist(), [one.lines for one in truth.findings]) == ([0.3, 0.1], [(3,)])
    (tmp_path / "truth.csv").write_text("time_ns,x,y\n1,0,0\n")
    assert read_truth(tmp_path / "truth.csv").sigma_or(9.0).tolist() == [9.0]


def test_covariances_are_linear_between_usable_frames() -> None:
    walk = straight_walk()
    covariance = np.arange(101.0)[:, None, None] * np.array([[2.0, -1.0], [-1.0, 3.0]])
    covariance[40:43] = np.nan
    status = walk.status.copy()
    status[40:43] = Status.INVALID
    status[60], covariance[60] = Status.BREAK, np.nan
    found = covariances_at(at(1.05, 4.1, 5.95, 6.0, 7.0), replace(walk, covariance_bcs=covariance, status=status))
    np.testing.assert_allclose(found[:, 0, 0], [21.0, 82.0, np.nan, np.nan, 140.0])
    np.testing.assert_allclose(found[:, 0, 1], found[:, 0, 0] / -2)
    np.testing.assert_allclose(found[:, 1, 1], found[:, 0, 0] * 1.5)
    np.testing.assert_array_equal(found[:, 1, 0], found[:, 0, 1])


def test_no_usable_frame_has_no_covariance() -> None:
    walk = straight_walk(3)
    walk.status[:] = Status.INVALID
    assert np.isnan(covariances_at(at(0.1), walk)).all()


SECOND = 1_000_000_000


def test_ahead_and_left_of_a_northward_walk() -> None:
    found = errors_at_origin(np.array([[0.0, 2.0], [-3.0, 0.0]]), heading_rad=np.pi / 2)
    assert found.along_m == pytest.approx([2.0, 0.0])
    assert found.across_m == pytest.approx([0.0, 3.0])


@given(st.floats(-5, 5), st.floats(-5, 5), st.floats(-7, 7))
def test_along_and_across_make_up_the_error(x: float, y: float, heading: float) -> None:
    found = errors_at_origin(np.array([[x, y]]), heading_rad=heading)
    assert np.hypot(found.along_m, found.across_m) == pytest.approx(found.error_m, abs=1e-12)


def test_without_a_label_or_a_heading_nothing_is_told() -> None:
    found = errors_at_origin(np.array([[np.nan, np.nan], [1.0, 1.0]]), heading_rad=np.array([0.0, np.nan]))
    assert found.labelled.tolist() == [False, True]
    assert np.isnan(found.error_m).tolist() == [True, False]
    assert np.isnan(found.along_m).all()
    assert len(found.select(found.labelled)) == 1


def test_arrays_of_different_length_are_refused() -> None:
    with pytest.raises(ValueError, match="same number"):
        replace(errors_at_origin(np.zeros((2, 2))), heading_rad=np.zeros(3))


def test_direction_of_walking_and_of_standing() -> None:
    time_ns = np.arange(0, 20 * SECOND, SECOND // 10)
    x = np.minimum(time_ns * 1e-9, 10.0)
    heading = heading_of(walking_velocity(np.array([5, 15]) * SECOND, time_ns, np.column_stack((x, -x))))
    assert heading[0] == pytest.approx(-np.pi / 4)
    assert np.isnan(heading[1])


def test_no_direction_across_an_unknown_stretch() -> None:
    time_ns = np.arange(10) * SECOND
    path = np.column_stack((np.arange(10.0), np.zeros(10)))
    path[5] = np.nan
    heading = heading_of(walking_velocity(np.array([2, 5, 8]) * SECOND, time_ns, path))
    assert np.isfinite(heading).tolist() == [True, False, True]
