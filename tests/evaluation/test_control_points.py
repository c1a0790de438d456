from __future__ import annotations

import numpy as np
import pytest

from tests.evaluation.maps import straight_walk, without
from vislam2tag.core.status import Status
from vislam2tag.evaluation.control_points import is_faulty, press_errors, walk_error
from vislam2tag.evaluation.tables import WalkErrors, over_walks
from vislam2tag.survey.model import SessionKey

POINTS = np.array([[2.0, 0.5], [6.0, -0.5]])


def presses(*seconds: float) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    return (1_000_000_000 + np.array(seconds) * 1e9).astype(np.int64)


def test_error_is_to_the_nearest_point_at_the_interpolated_position() -> None:
    errors = press_errors(straight_walk(), presses(2.05, 5.6), POINTS)
    np.testing.assert_allclose(errors, [np.hypot(0.05, 0.5), np.hypot(0.4, 0.5)])


def test_presses_outside_the_mapped_part_do_not_count() -> None:
    walk = without(straight_walk(), slice(40, 101), Status.AFTER_LAST_LANDMARK)
    errors = press_errors(walk, presses(2.0, 6.0, 30.0), POINTS)
    np.testing.assert_array_equal(np.isfinite(errors), [True, False, False])
    assert walk_error(errors) == pytest.approx(0.5)
    assert np.isnan(walk_error(errors[1:]))


def test_faulty_means_that_corrected_keeps_less_than_local() -> None:
    local = without(straight_walk(), slice(90, 101), Status.AFTER_LAST_LANDMARK)
    assert not is_faulty(local, local)
    assert is_faulty(local, without(local, slice(50, 60), Status.BREAK))


def test_statistics_over_walks_leave_out_unlabelled_and_faulty_ones() -> None:
    key = SessionKey(1, "LG_ref", "a")
    walks = [WalkErrors(key, {"local": e}, e > 2) for e in (0.4, 0.6, 5.0)] + [
        WalkErrors(key, {"local": float("nan")}, False)
    ]
    everything, sound = over_walks(walks, "local"), over_walks(walks, "local", only_non_faulty=True)
    assert (everything.walks, everything.mean_m, everything.median_m, everything.max_m) == (3, 2.0, 0.6, 5.0)
    assert (sound.walks, sound.max_m) == (2, 0.6)
    assert over_walks([], "local").walks == 0
