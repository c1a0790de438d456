"""What a session knows of its place: its landmarks, its taps, and what other walks say."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.drifting import Drifting, loops
from vislam2tag.core.context import FixLog, PlacingHints, PossiblePosition
from vislam2tag.core.tracks import CameraTrack
from vislam2tag.estimation.floor_plan import facts
from vislam2tag.estimation.floor_plan.evidence import KnownPlace, KnownTurn, PossiblePlaces
from vislam2tag.estimation.floor_plan.facts import MOST_LANDMARKS, SEEN_SIGMA_M, TAP_SIGMA_M, facts_of
from vislam2tag.estimation.landmark_priors import LandmarkPriors
from vislam2tag.estimation.observations import WalkObservations, find_passes
from vislam2tag.estimation.odometry import continuous_odometry

RATE_HZ = 10.0


@pytest.fixture(scope="module")
def walk() -> Drifting:
    """Twice around an ellipse, past eight landmarks."""
    return loops(4, marks=8, laps=2, rate_hz=RATE_HZ)


def seen_on(walk: Drifting) -> tuple[CameraTrack, WalkObservations]:
    camera, log = walk.logged()
    odometry = continuous_odometry(camera, log)
    return camera, WalkObservations(log.ids, odometry, find_passes(camera, log, odometry, 2.5))


def nothing(observations: WalkObservations) -> LandmarkPriors:
    return LandmarkPriors.nothing(len(observations.ids))


def test_a_walk_that_knows_nothing_has_no_facts(walk: Drifting) -> None:
    camera, observations = seen_on(walk)
    assert facts_of(camera, observations, nothing(observations)) == []


def test_each_pass_of_a_surveyed_landmark_is_a_known_place(walk: Drifting) -> None:
    camera, observations = seen_on(walk)
    priors = LandmarkPriors.of(observations.ids, walk.landmarks([2, 5]))
    facts = facts_of(camera, observations, priors)
    passes = observations.passes
    rows = [row for row in range(len(passes.at)) if passes.landmark[row] in (2, 5)]
    assert len(facts) == len(rows) == 4
    for fact, row in zip(facts, rows, strict=True):
        assert isinstance(fact, KnownPlace)
        assert (fact.frame, fact.offset) == (passes.at[row], passes.offset[row])
        assert fact.place == walk.surveyed_at[passes.landmark[row]]
        assert fact.sigma_m == pytest.approx(np.hypot(SEEN_SIGMA_M, 0.02))
        turned = walk.factor[fact.frame] / abs(walk.factor[fact.frame])
        assert walk.truth[fact.frame] + turned * fact.offset == pytest.approx(fact.place, abs=0.1)


def test_of_very_many_passes_some_are_enough(walk: Drifting) -> None:
    long = loops(4, marks=8, laps=11, rate_hz=RATE_HZ)
    camera, observations = seen_on(long)
    assert len(observations.passes.at) > 2 * MOST_LANDMARKS
    facts = facts_of(camera, observations, LandmarkPriors.of(observations.ids, long.landmarks()))
    assert MOST_LANDMARKS / 2 < len(facts) <= MOST_LANDMARKS
    frames = [fact.frame for fact in facts]
    assert max(frames) - min(frames) > 0.9 * len(long.truth)


@pytest.mark.parametrize(
    ("stated", "used"), [(None, [TAP_SIGMA_M] * 3), (np.array([0.2, np.nan, 3.0]), [0.2, TAP_SIGMA_M, 3.0])]
)
def test_taps_are_known_places_of_the_camera(walk: Drifting, stated: np.ndarray | None, used: list[float]) -> None:
    camera, observations = seen_on(walk)
    time_ns = camera.time_ns[0] + np.array([-5.0, 3.04, 7.06]) * 1e9
    places = np.array([(1.0, 2.0), (3.0, 4.0), (5.0, 6.0)])
    fixes = FixLog(time_ns.astype(np.int64), places, ("a", "b", "c"), stated)
    facts = facts_of(replace(camera, fixes=fixes), observations, nothing(observations))
    assert facts == [
        KnownPlace(0, 1 + 2j, used[0]),
        KnownPlace(30, 3 + 4j, used[1]),
        KnownPlace(71, 5 + 6j, used[2]),
    ]


def test_frames_are_counted_in_the_odometry(walk: Drifting) -> None:
    camera, log = walk.logged()
    camera.status[:20] = 10
    odometry = continuous_odometry(camera, log.rows_kept(log.frame >= 20))
    observations = WalkObservations(log.ids, odometry, find_passes(camera, log, odometry, 2.5))
    fixes = FixLog(camera.time_ns[[50]], np.array([(1.0, 2.0)]), ("a",))
    (fact,) = facts_of(replace(camera, fixes=fixes), observations, nothing(observations))
    assert fact.frame == 30


def test_other_walks_say_where_it_may_have_been_and_north_its_turn(
    walk: Drifting, monkeypatch: pytest.MonkeyPatch
) -> None:
    camera, observations = seen_on(walk)
    places = np.array([(1.0, 2.0), (3.0, 4.0)])
    place = PossiblePosition(int(camera.time_ns[40]), places, np.array([0.5, 0.3]), 2.0)
    monkeypatch.setattr(facts, "compass_turn_rad", lambda *_: 0.2)
    hinted = replace(camera, hints=PlacingHints((place,), 1.2))
    possible, turned = facts_of(hinted, observations, nothing(observations))
    assert isinstance(possible, PossiblePlaces)
    assert (possible.frame, possible.sigma_m) == (40, 2.0)
    assert possible.place.tolist() == [1 + 2j, 3 + 4j]
    assert possible.weight.tolist() == [0.5, 0.3]
    middle = len(observations.odometry.path) // 2
    assert turned == KnownTurn(middle, 1.2 + 0.2, facts.COMPASS_SIGMA_RAD)
    without_north = replace(camera, hints=PlacingHints((place,)))
    assert len(facts_of(without_north, observations, nothing(observations))) == 1
