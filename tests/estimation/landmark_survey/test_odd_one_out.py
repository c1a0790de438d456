"""The reference that contradicts all others is named, and no other."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.estimation.landmark_survey.local_maps import building, seen_from
from vislam2tag.estimation.landmark_priors import LandmarkPriors
from vislam2tag.estimation.landmark_survey.comparison import Comparison, Verdict
from vislam2tag.estimation.landmark_survey.landmark_map import join
from vislam2tag.estimation.landmark_survey.local_map import LocalMap
from vislam2tag.estimation.landmark_survey.odd_one_out import Votes, _sights, vote

SEEN = [[0, 1, 2, 3, 4, 5, 6, 7], [4, 5, 6, 7, 8, 9, 10], [8, 9, 10, 11, 0, 1, 2], [0, 2, 4, 6, 8, 10], [1, 3, 5, 7, 9]]
FAULT = 0.8 - 0.6j
"""One metre."""


def survey(seed: int) -> tuple[list[LocalMap], LandmarkPriors]:
    """Twelve landmarks, all surveyed, and five walks past half of them each, with the errors that they state."""
    place, heading = building(12, seed)
    rng = np.random.default_rng(seed)
    maps = []
    for turn, seen in enumerate(SEEN):
        one = seen_from(place, heading, seen, float(turn), 10j * turn)
        maps.append(replace(one, position=one.position + 0.1 * (rng.standard_normal((len(seen), 2)) @ (1, 1j))))
    priors = LandmarkPriors.nothing(12)
    priors.position[:] = place + 0.02 * (rng.standard_normal((12, 2)) @ (1, 1j))
    priors.covariance[:] = np.eye(2) * 0.02**2
    return maps, priors


def voted(maps: list[LocalMap], priors: LandmarkPriors) -> Votes:
    return vote(join(maps, priors))


def names(votes: Votes) -> list[tuple[int, int | None]]:
    return [(one.landmark, one.walk) for one in votes.odd]


def test_nothing_is_odd_where_errors_are_as_stated() -> None:
    for seed in range(6):
        votes = voted(*survey(seed))
        assert names(votes) == []
        assert {one.verdict for one in votes.fitting} == {Verdict.AGREES}
        assert len(votes.fitting) == 12 + sum(map(len, SEEN))


@pytest.mark.parametrize("seed", [0, 1])
def test_a_landmark_surveyed_elsewhere_is_named_with_its_offset(seed: int) -> None:
    maps, priors = survey(seed)
    priors.position[4] += FAULT
    votes = voted(maps, priors)
    assert names(votes) == [(4, None)]
    assert votes.odd[0].offset == pytest.approx(FAULT, abs=0.3)
    assert votes.odd[0].sigma_m < 0.25


@pytest.mark.parametrize("walk", [0, 3])
def test_a_sheet_that_hung_elsewhere_in_one_walk_is_named_with_the_walk(walk: int) -> None:
    maps, priors = survey(2)
    own = maps[walk]
    moved = np.where(own.landmark == 2, own.position + FAULT * np.exp(-1j * walk), own.position)
    maps[walk] = replace(own, position=moved)
    votes = voted(maps, priors)
    assert names(votes) == [(2, walk)]
    assert votes.odd[0].offset == pytest.approx(FAULT, abs=0.4)


@pytest.mark.parametrize(("landmark", "own"), [(4, [0, 1]), (2, [2, 3])])
def test_a_sheet_that_hung_elsewhere_on_one_day_is_named_with_the_day(landmark: int, own: list[int]) -> None:
    maps, priors = survey(5)
    days = ["first" if walk in own else "second" for walk in range(len(maps))]
    for walk in own:
        moved = np.where(maps[walk].landmark == landmark, FAULT * np.exp(-1j * walk), 0)
        maps[walk] = replace(maps[walk], position=maps[walk].position + moved)
    [odd] = vote(join(maps, priors), days).odd
    assert (odd.landmark, odd.walk, odd.day) == (landmark, None, "first")
    assert odd.offset == pytest.approx(FAULT, abs=0.4)
    assert vote(join(*survey(5)), days).odd == ()


@pytest.mark.parametrize("excess", [0.08, -0.06])
def test_a_device_whose_metre_is_off_is_named_and_what_its_walks_saw_is_not(excess: float) -> None:
    devices = ["a", "b", "a", "b", "b"]
    maps, priors = survey(6)
    assert vote(join(maps, priors), devices=devices).odd_devices == ()
    stretched = [
        replace(one, position=one.position * (1 + excess)) if device == "a" else one
        for one, device in zip(maps, devices, strict=True)
    ]
    votes = vote(join(stretched, priors), devices=devices)
    [odd] = votes.odd_devices
    assert (odd.device, odd.walks) == ("a", (0, 2))
    assert odd.excess == pytest.approx(excess, abs=3 * odd.sigma)
    assert votes.odd == ()


def test_where_all_devices_differ_from_the_survey_alike_none_is_named() -> None:
    maps, priors = survey(7)
    stretched = [replace(one, position=one.position * 1.06) for one in maps]
    assert vote(join(stretched, priors), devices=["a", "b", "a", "b", "b"]).odd_devices == ()


def test_how_far_walks_see_landmarks_off_counts_once_for_a_sight() -> None:
    joined = join(*survey(8))
    doubts = replace(joined.doubts, shift_m=0.3, shift=tuple(np.ones(len(seen)) for seen in SEEN))
    best_m = min(one.sigma_m for one in _sights(replace(joined, doubts=doubts)))
    assert 1.0 < best_m / np.hypot(0.1, 0.3) < 1.3


def test_two_faults_are_named_the_greater_first() -> None:
    maps, priors = survey(3)
    priors.position[4] += FAULT
    priors.position[9] += 2.5
    assert names(voted(maps, priors)) == [(9, None), (4, None)]


def test_what_nobody_else_saw_cannot_be_compared() -> None:
    maps, priors = survey(4)
    one = replace(maps[1], landmark=np.array([4, 5, 6, 7, 8, 9, 12]))
    bigger = LandmarkPriors.nothing(13)
    bigger.position[:12], bigger.covariance[:12] = priors.position, priors.covariance
    votes = voted([maps[0], one], bigger)
    found = {(one.landmark, one.walk): one.verdict for one in votes.fitting}
    assert found[12, 1] is Verdict.NOTHING
    assert found[11, None] is Verdict.NOTHING
    assert found[5, None] is Verdict.AGREES
    assert Comparison(11, None).verdict is Verdict.NOTHING
