from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.preparation.registration.networks import as_array, squares, survey
from vislam2tag.core.similarity import Similarity2
from vislam2tag.preparation.registration.least_squares import SingularError
from vislam2tag.preparation.registration.network import KnownPoint, Shot, adjust_plane
from vislam2tag.preparation.registration.network_search import search_network
from vislam2tag.preparation.registration.record import RegistrationSettings

SETTINGS = RegistrationSettings()


@settings(max_examples=20)
@given(st.integers(0, 10**6))
def test_without_noise_every_point_is_where_it_is(seed: int) -> None:
    exact = survey(seed, landmarks=5, noise=0.0)
    fit = search_network(exact.shots, exact.known, SETTINGS).fit
    for name, place in fit.places.items():
        assert place == pytest.approx(exact.truth[name], abs=1e-6)


def test_stated_regions_hold_as_many_errors_as_they_say() -> None:
    square = []
    for seed in range(60):
        drawn = survey(seed)
        fit = search_network(drawn.shots, drawn.known, SETTINGS).fit
        square += [
            squares(as_array(fit.places[name] - drawn.truth[name]), fit.covariance(name))
            for name in fit.places
            if not name.startswith("K")
        ]
    assert 0.62 < np.mean(np.array(square) < 2.279) < 0.74
    assert 0.92 < np.mean(np.array(square) < 5.991) < 0.98


def test_joint_covariance_holds_the_single_ones() -> None:
    drawn = survey(1)
    fit = search_network(drawn.shots, drawn.known, SETTINGS).fit
    both = fit.covariance("3", "5")
    assert both[:2, :2] == pytest.approx(fit.covariance("3"))
    assert both[2:, 2:] == pytest.approx(fit.covariance("5"))
    assert np.abs(both[:2, 2:]).max() > 0


def test_a_free_scale_is_found_and_a_fixed_one_is_not_changed() -> None:
    drawn = survey(2, noise=0.3)
    longer = [replace(shot, place=1.001 * shot.place) for shot in drawn.shots]
    free = search_network(longer, drawn.known, SETTINGS, free_scale=True).fit
    assert free.scale is not None
    assert free.scale.value == pytest.approx(1 / 1.001, abs=4 * free.scale.sigma)
    assert free.scale.sigma < 2e-4
    assert all(
        abs(one.scale - 1) < 1e-12 for one in search_network(drawn.shots, drawn.known, SETTINGS).fit.maps.values()
    )


def test_one_known_point_leaves_the_frame_undetermined() -> None:
    shots = [Shot(point=name, station="S", place=place, sigma_m=0.003) for name, place in (("a", 0j), ("b", 5j))]
    with pytest.raises(SingularError):
        adjust_plane(shots, [KnownPoint(point="a", place=0j, sigma_m=0.003)], {"S": Similarity2.identity()}, 10.0)


def test_sums_of_squares_do_not_depend_on_the_order() -> None:
    drawn = survey(5)
    fit = search_network(drawn.shots, drawn.known, SETTINGS).fit
    other = search_network(drawn.shots[::-1], drawn.known[::-1], SETTINGS).fit
    assert other.adjusted.square == pytest.approx(fit.adjusted.square)
    assert other.covariance("3") == pytest.approx(fit.covariance("3"))
