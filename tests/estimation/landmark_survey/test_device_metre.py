"""What walks of a device take for a metre, against survey and other devices."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.estimation.landmark_survey.local_maps import building, seen_from
from vislam2tag.core.arrays import ComplexArray
from vislam2tag.estimation.landmark_priors import LandmarkPriors
from vislam2tag.estimation.landmark_survey.device_metre import SHARED_SIGMA, DeviceMetre, device_metres
from vislam2tag.estimation.landmark_survey.landmark_map import join
from vislam2tag.estimation.landmark_survey.local_map import LocalMap
from vislam2tag.estimation.landmark_survey.odd_one_out import vote

DEVICES = ("a", "b") * 4
STATED_SIGMA = 0.02
"""By which each walk says that its metre may be off."""


def walked(place: ComplexArray, seen: list[int], longer: float, rng: np.random.Generator) -> LocalMap:
    """A walk that sees landmarks too far apart by ``longer``, beside its own error, as stated."""
    one = seen_from(place, np.zeros(len(place)), seen, 0.0, 0j, 0.05)
    arm = np.column_stack((one.position.real, one.position.imag)).ravel()
    covariance = one.covariance.copy()
    covariance[: len(arm), : len(arm)] += STATED_SIGMA**2 * np.outer(arm, arm)
    position = one.position * (1 + longer) + 0.05 * (rng.standard_normal((len(seen), 2)) @ (1, 1j))
    return replace(one, position=position, covariance=covariance)


def floor(seed: int, longer: dict[str, float], devices: tuple[str, ...] = DEVICES) -> list[LocalMap]:
    """Walks past ten of twelve landmarks each."""
    rng = np.random.default_rng(seed)
    place, _ = building(12, seed)
    return [
        walked(place, sorted(rng.permutation(12)[:10].tolist()), longer.get(one, 0.0) + rng.normal(0, 0.005), rng)
        for one in devices
    ]


def surveyed(seed: int, which: list[int], sigma_m: float) -> LandmarkPriors:
    """A survey of some landmarks with the errors stated."""
    place, _ = building(12, seed)
    rng = np.random.default_rng(seed + 1000)
    priors = LandmarkPriors.nothing(12)
    priors.position[which] = (place + sigma_m * (rng.standard_normal((12, 2)) @ (1, 1j)))[which]
    priors.covariance[which] = np.eye(2) * sigma_m**2
    return priors


def metres(maps: list[LocalMap], priors: LandmarkPriors, devices: tuple[str, ...] = DEVICES) -> list[DeviceMetre]:
    return device_metres(join(maps, priors), devices)


def test_walks_that_tell_nothing_of_a_metre_count_for_nothing() -> None:
    maps, priors = floor(0, {}), surveyed(0, list(range(12)), 0.02)
    several = metres(maps, priors)
    alone = [one.select(np.arange(len(one.landmark)) == 3) for one in floor(1, {})]
    more = metres([*maps, *alone], priors, DEVICES * 2)
    assert [one.walks for one in several] == [(0, 2, 4, 6), (1, 3, 5, 7)]
    for before, after in zip(several, more, strict=True):
        assert after.walks == before.walks
        assert (after.excess, after.sigma) == pytest.approx((before.excess, before.sigma), rel=0.02)


def test_a_device_of_which_one_walk_alone_tells_is_not_compared() -> None:
    maps = floor(0, {})[:3]
    maps.append(maps[1].select(np.arange(len(maps[1].landmark)) == 3))
    assert metres(maps, surveyed(0, list(range(12)), 0.02), ("a", "b", "a", "b")) == []


def test_landmarks_beside_one_another_tell_nothing_of_a_metre() -> None:
    place, _ = building(12, 0)
    place[1] = place[0] + 0.2
    priors = surveyed(0, list(range(12)), 0.001)
    priors.position[:2] = place[:2]
    rng = np.random.default_rng(0)
    near = [walked(place, [0, 1], 0.0, rng) for _ in range(2)]
    maps = [*(walked(place, list(range(1, 12)), 0.0, rng) for _ in range(2)), *near]
    assert metres(maps, priors, ("a", "a", "b", "b")) == []


@pytest.mark.parametrize("sigma_m", [0.3, pytest.param(0.5, marks=pytest.mark.campaign)])
def test_by_a_survey_that_is_not_exact_no_device_is_named_for_another_ones_metre(sigma_m: float) -> None:
    named = []
    for seed in range(20):
        votes = vote(join(floor(seed, {"b": 0.05}), surveyed(seed, [0, 11], sigma_m)), devices=DEVICES)
        named += [one.device for one in votes.odd_devices]
    assert "a" not in named
    assert len(named) < 20


def test_by_an_exact_survey_the_device_is_named_and_no_other_one() -> None:
    for seed in range(20):
        votes = vote(join(floor(seed, {"b": 0.05}), surveyed(seed, list(range(12)), 0.02)), devices=DEVICES)
        assert [one.device for one in votes.odd_devices] == ["b"]


@pytest.mark.campaign
def test_errors_of_the_survey_do_not_shrink_with_walks_that_agree() -> None:
    few, many = (
        metres(floor(3, {}, devices), surveyed(3, [0, 11], 0.5), devices)[0].sigma for devices in (DEVICES, DEVICES * 4)
    )
    place, _ = building(12, 3)
    by_survey = 0.5 / abs(place[11] - place[0]) * 2**0.5
    assert many < few
    assert many > by_survey * 0.9


def test_a_metre_is_never_known_better_than_what_all_devices_share() -> None:
    assert all(one.sigma > SHARED_SIGMA for one in metres(floor(4, {}), surveyed(4, list(range(12)), 0.001)))
