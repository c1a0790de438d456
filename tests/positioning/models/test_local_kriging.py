"""Kriging in signal space: it finds the place and the storey, its circles hold, and it is saved whole."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.positioning.radio_world import assert_says_what_is_unlike, radio_world
from vislam2tag.common.errors import UsageError
from vislam2tag.positioning.model_scores import score
from vislam2tag.positioning.models.local_kriging import LocalKriging
from vislam2tag.positioning.signal_distance import Apart


@pytest.fixture(scope="module")
def fitted() -> LocalKriging:
    return LocalKriging().fit(*radio_world(seed=1))


def test_a_phone_that_hears_fainter_is_located_alike(fitted: LocalKriging) -> None:
    scans, true = radio_world(seed=2, offset_db=-6.0)
    result = score(fitted.predict(scans), true)
    assert result.plane.mean_m is not None
    assert result.plane.mean_m < 6


def test_who_stands_where_a_scan_was_learned_is_found_there(fitted: LocalKriging) -> None:
    scans, places = fitted.learned()
    error_m = places.distance_m(fitted.predict(scans).xy)
    assert np.quantile(error_m, 0.9) < 1.0


def test_a_scan_like_nothing_that_was_learned_says_so(fitted: LocalKriging) -> None:
    assert_says_what_is_unlike(fitted)


def test_a_scan_that_hears_nothing_tells_nothing_of_its_walk(fitted: LocalKriging) -> None:
    scans, _ = radio_world(seed=2)
    deaf = scans.only(scans.row % 6 != 0)
    heard = np.flatnonzero(deaf.heard)
    radii = fitted.predict(deaf).radius_68_m
    np.testing.assert_allclose(radii[heard], fitted.predict(deaf[heard]).radius_68_m)


def test_scans_that_ask_have_the_features_that_radii_were_fitted_to(fitted: LocalKriging) -> None:
    scans = radio_world(seed=2)[0].over(fitted.access_points_)
    nobody = Apart(np.full((len(scans), 1), -1), np.zeros((len(fitted.learned()[0]), 1), np.int64))
    asked, left_out = (fitted._kriged(scans, apart) for apart in (None, nobody))
    assert (asked.voted.storey_probability != left_out.voted.storey_probability).any()  # the regression is asked, too
    np.testing.assert_array_equal(asked.voted.torn, left_out.voted.torn)


def test_walks_are_saved_as_the_same_ones(fitted: LocalKriging) -> None:
    again = LocalKriging()
    again.access_points_, again.storeys_ = fitted.access_points_, fitted.storeys_
    again.restore(fitted.arrays())
    before, after = (np.unique(model.learned()[0].session, return_inverse=True)[1] for model in (fitted, again))
    assert len(set(zip(before.tolist(), after.tolist(), strict=True))) == len(set(before.tolist()))  # the same walks


def test_radii_come_from_a_validation_part_where_there_is_one(fitted: LocalKriging) -> None:
    scans, learned = radio_world(seed=1)
    elsewhere = replace(learned, xy=learned.xy + 30.0)
    model = LocalKriging().fit(scans, learned, validation=(scans, elsewhere))
    assert np.median(model.predict(scans).radius_68_m) > 25 > np.median(fitted.predict(scans).radius_68_m)


def test_wrong_parameters_are_told() -> None:
    with pytest.raises(UsageError, match="k must be 1 or more"):
        LocalKriging(k=0).fit(*radio_world(walks=1))
