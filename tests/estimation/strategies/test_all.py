"""The paper's strategies on hand-made walks with known truth."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.walks import corridor_walk, landmarks_at, rows_of_log
from vislam2tag.common.errors import UsageError
from vislam2tag.core.arrays import with_rows
from vislam2tag.core.status import Status
from vislam2tag.core.tracks import CameraTrack, LandmarkLog, Landmarks, Trajectory
from vislam2tag.core.transforms import Similarity2
from vislam2tag.estimation.settings import MappingSettings
from vislam2tag.estimation.strategy import strategy_named, strategy_names

STATIONS = {"a": (5.0, 0.6), "b": (15.0, -0.6), "c": (25.0, 0.6), "d": (35.0, -0.5)}
ALL = ("global", "global-affine", "local", "local-corrected")


def mapped(name: str, camera: CameraTrack, log: LandmarkLog, landmarks: Landmarks) -> Trajectory:
    return strategy_named(name, MappingSettings()).map(camera, log, landmarks)


def causes(trajectory: Trajectory) -> set[str]:
    return {Status(code).label for code in np.unique(trajectory.status)}


def test_registered_names_and_unknown_name() -> None:
    assert set(ALL) <= set(strategy_names())
    with pytest.raises(UsageError, match="available are: dead-reckoning, floor-plan, global"):
        strategy_named("nonsense", MappingSettings())


@pytest.mark.parametrize("name", ALL)
@given(scale=st.floats(0.8, 1.25), angle=st.floats(-3.1, 3.1), x=st.floats(-50, 50))
def test_a_perfect_tracker_is_mapped_exactly(name: str, scale: float, angle: float, x: float) -> None:
    camera, log, landmarks, truth = corridor_walk(Similarity2(scale * np.exp(1j * angle), complex(x, 3)), STATIONS)
    trajectory = mapped(name, camera, log, landmarks)
    ok = trajectory.status == Status.OK
    assert ok.mean() > 0.7
    np.testing.assert_allclose(trajectory.position_bcs[ok, :2], truth[ok], atol=1e-6)
    assert np.isnan(trajectory.position_bcs[~ok]).all()


@pytest.mark.parametrize("name", ["local", "local-corrected"])
def test_ends_of_the_walk_have_their_cause(name: str) -> None:
    camera, log, landmarks, truth = corridor_walk(Similarity2.identity(), STATIONS)
    trajectory = mapped(name, camera, log, landmarks)
    before, after = truth[:, 0] < 4.9, truth[:, 0] > 35.1
    assert set(trajectory.status[before]) == {Status.BEFORE_FIRST_LANDMARK}
    assert set(trajectory.status[after]) == {Status.AFTER_LAST_LANDMARK}
    assert [visit.landmark for visit in trajectory.visits] == list(STATIONS)
    assert [segment.status for segment in trajectory.segments] == [Status.OK] * 3


def jumped(at_m: float) -> tuple[CameraTrack, LandmarkLog, Landmarks]:
    """Camera and all landmarks seen later displaced by 30 m from a point of the walk on."""
    camera, log, landmarks, truth = corridor_walk(Similarity2.identity(), STATIONS)
    late = truth[:, 0] > at_m
    camera.position_acs[late, 0] += 30
    log.position_acs[late[log.frame], 0] += 30
    return camera, log, landmarks


def test_a_break_discards_its_segment_only() -> None:
    camera, log, landmarks = jumped(20.0)
    corrected, local = (mapped(name, camera, log, landmarks) for name in ("local-corrected", "local"))
    assert [Status(segment.status) for segment in corrected.segments] == [Status.OK, Status.BREAK, Status.OK]
    assert causes(local) == {"ok", "before_first_landmark", "after_last_landmark"}
    segment = corrected.segments[1]
    assert set(corrected.status[segment.start : segment.stop]) == {Status.BREAK}


def test_lost_tracking_discards_both_neighbouring_segments() -> None:
    camera, log, landmarks, truth = corridor_walk(Similarity2.identity(), STATIONS)
    lost = (truth[:, 0] > 19) & (truth[:, 0] < 20)
    log.position_acs[lost[log.frame]] = camera.position_acs[log.frame[lost[log.frame]]]
    log.lost[:] = lost[log.frame]
    trajectory = mapped("local-corrected", camera, log, landmarks)
    between = (truth[:, 0] > 15.1) & (truth[:, 0] < 24.9)
    assert set(trajectory.status[between]) == {Status.TRACKING_LOST}
    assert set(trajectory.status[(truth[:, 0] > 5.1) & (truth[:, 0] < 14.9)]) == {Status.OK}
    assert causes(mapped("local", camera, log, landmarks)) == {"ok", "before_first_landmark", "after_last_landmark"}


def test_local_uses_the_newest_idea_of_each_landmark_global_the_median() -> None:
    camera, log, landmarks = jumped(26.0)
    local = mapped("local", camera, log, landmarks)
    truth = np.arange(800) * 0.03
    assert np.nanmax(np.abs(local.position_bcs[:800, 0] - truth)) < 1e-6
    assert np.nanmax(np.abs(mapped("global", camera, log, landmarks).position_bcs[:800, 0] - truth)) > 0.5


@pytest.mark.parametrize("name", ALL)
@pytest.mark.parametrize("known", [0, 1])
def test_too_few_landmarks_map_nothing(name: str, known: int) -> None:
    camera, log, _, _ = corridor_walk(Similarity2.identity(), STATIONS)
    landmarks = landmarks_at(dict(list(STATIONS.items())[:known]))
    trajectory = mapped(name, camera, log, landmarks)
    assert causes(trajectory) == {"no_mapping"}
    assert np.isnan(trajectory.position_bcs).all()


@pytest.mark.parametrize("name", ALL)
def test_unusable_frames_keep_their_own_status(name: str) -> None:
    camera, log, landmarks, _ = corridor_walk(Similarity2.identity(), STATIONS)
    camera.status[400:403] = Status.INVALID
    camera.position_acs[400:403] = np.nan
    keep = (log.frame < 400) | (log.frame > 402)
    trajectory = mapped(name, camera, rows_of_log(log, keep), landmarks)
    assert trajectory.status[399:404].tolist() == [0, Status.INVALID, Status.INVALID, Status.INVALID, 0]
    assert np.isnan(trajectory.position_bcs[400:403]).all()


def test_landmarks_logged_at_one_spot_map_nothing_between_them() -> None:
    camera, log, landmarks, _ = corridor_walk(Similarity2.identity(), {"a": (5.0, 0.5), "b": (5.0, 0.5)})
    trajectory = mapped("local", camera, log, landmarks)
    assert causes(trajectory) <= {"no_mapping", "before_first_landmark", "after_last_landmark"}


def test_no_frames_at_all() -> None:
    camera, log, landmarks, _ = corridor_walk(Similarity2.identity(), STATIONS)
    none = with_rows(camera, slice(0), "time_ns", "position_acs", "orientation_acs", "status")
    for name in ALL:
        assert len(mapped(name, none, log.select([]), landmarks).status) == 0
