"""Anchors: where the app sets them, and how the tracker's map carries them."""

from __future__ import annotations

import numpy as np
import pytest

from vislam2tag.core.context import AnchorLog
from vislam2tag.core.similarity import as_complex
from vislam2tag.core.tracks import to_plane
from vislam2tag.simulation.model import MapMotion, TrackerLog
from vislam2tag.simulation.scenario import regular_survey
from vislam2tag.simulation.settings import stream
from vislam2tag.simulation.survey import walk_and_track
from vislam2tag.simulation.tracking.anchors import APART_M, FOLLOWED, set_anchors


def tracked(severity: str, seed: int) -> tuple[TrackerLog, MapMotion]:
    scenario = regular_survey(seed, severity, (0,), ("LG",), 1, 120.0)
    _, tracker = walk_and_track(scenario, scenario.sessions[0])
    assert tracker.motion is not None
    return tracker, tracker.motion


@pytest.fixture(scope="module", params=[("none", 3), ("severe", 4)], ids=["none", "severe"])
def walk(request: pytest.FixtureRequest) -> tuple[TrackerLog, MapMotion, AnchorLog]:
    tracker, motion = tracked(*request.param)
    return tracker, motion, set_anchors(tracker, motion, stream(1, "anchors"))


def test_an_anchor_is_set_at_the_camera_as_soon_as_it_is_far_from_the_newest(
    walk: tuple[TrackerLog, MapMotion, AnchorLog],
) -> None:
    tracker, motion, log = walk
    camera = tracker.position_acs.astype(np.float32)
    first = [int(log.frame[log.anchor == number].min()) for number in np.unique(log.anchor)]
    assert len(first) > 5
    for number, (start, stop) in enumerate(zip(first, [*first[1:], len(camera)], strict=True)):
        rows = (log.anchor == number) & (log.frame < stop)
        assert log.frame[rows].tolist() == list(range(start, stop))
        np.testing.assert_array_equal(log.position_acs[rows][0], camera[start])
        apart = np.linalg.norm(log.position_acs[rows] - camera[start:stop], axis=1)
        assert (apart[~motion.lost[start:stop]] < APART_M).all()
        assert not motion.lost[start]


def test_the_newest_are_followed(walk: tuple[TrackerLog, MapMotion, AnchorLog]) -> None:
    _, _, log = walk
    for frame in np.unique(log.frame)[::200].tolist():
        here = np.sort(log.anchor[log.frame == frame])
        assert here.tolist() == list(range(max(0, here[-1] - FOLLOWED + 1), here[-1] + 1))


def test_anchors_stand_still_on_a_faultless_walk() -> None:
    tracker, motion = tracked("none", 3)
    log = set_anchors(tracker, motion, stream(1, "anchors"))
    same = log.anchor[1:] == log.anchor[:-1]
    np.testing.assert_allclose(np.diff(log.position_acs, axis=0)[same], 0, atol=1e-5)


def test_a_map_update_moves_anchors_with_camera_and_landmarks() -> None:
    tracker, motion = tracked("default", 11)
    log = set_anchors(tracker, motion, stream(1, "anchors"))
    updates = [event.frame for event in tracker.events if event.kind == "map_update"]
    disturbed = {carry.frame for carry in motion.carries}
    compared = 0
    for frame in (
        frame for frame in updates if frame not in disturbed and not motion.lost[frame - 1 : frame + 1].any()
    ):
        ratio = motion.factor[frame] / motion.factor[frame - 1]
        before, after = (log.frame == frame - 1, log.frame == frame)
        both = np.intersect1d(log.anchor[before], log.anchor[after])
        old, new = (
            as_complex(to_plane(log.position_acs[rows & np.isin(log.anchor, both)])) for rows in (before, after)
        )
        moved = ratio * (old - motion.shift[frame - 1]) + motion.shift[frame]
        np.testing.assert_allclose(new, moved, atol=1e-4)
        compared += len(both)
    assert compared > 0
