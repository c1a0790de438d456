"""Probabilistic fingerprinting: the likelihood by another way, phones with offsets, radii that hold."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from tests.positioning.radio_world import radio_world
from vislam2tag.common.errors import UsageError
from vislam2tag.positioning.metrics import plane_error_m, score
from vislam2tag.positioning.models import probabilistic
from vislam2tag.positioning.models.probabilistic import Probabilistic
from vislam2tag.positioning.registry import model_named


def test_the_likelihood_is_that_of_levels_with_a_shared_offset() -> None:
    scans, places = radio_world(seed=1, walks=1)
    model = Probabilistic(noise_db=5.0, offset_db=3.0).fit(scans, places)
    asked = scans[:3]
    found = model._log_likelihood(model._maps, asked)
    for index, levels in enumerate(asked.dense()):
        heard = np.isfinite(levels)
        covariance = 25.0 * np.eye(heard.sum()) + 9.0
        expected = [
            np.log(np.where(heard, share, 1 - share)).sum()
            + multivariate_normal(level[heard], covariance).logpdf(levels[heard])
            for share, level in zip(model._maps.heard[:20], model._maps.level_dbm[:20], strict=True)
        ]
        difference = found[index, :20] - expected
        np.testing.assert_allclose(difference, difference[0], atol=1e-8)


def test_it_learns_and_its_radii_hold() -> None:
    shares: list[float] = []
    model = model_named("probabilistic")
    model.progress = lambda done, total: shares.append(done / total)
    model.fit(*radio_world(seed=1))
    scans, true = radio_world(seed=2)
    result = score(model.predict(scans), true)
    assert result.plane.mean_m is not None
    assert result.plane.mean_m < 3
    assert result.floor_hit is not None
    assert result.floor_hit > 0.97
    assert result.inside_68 == pytest.approx(0.68, abs=0.12)
    assert result.inside_95 == pytest.approx(0.95, abs=0.05)
    assert shares == sorted(shares)
    assert shares[-1] == 1


def test_a_phone_that_hears_everything_fainter_does_little_harm() -> None:
    model = Probabilistic().fit(*radio_world(seed=1))
    rigid = Probabilistic(offset_db=0.1).fit(*radio_world(seed=1))
    scans, true = radio_world(seed=2, offset_db=-8.0)
    error, without = (plane_error_m(one.predict(scans), true).mean() for one in (model, rigid))
    assert error < 0.9 * without


def test_what_is_saved_predicts_the_same_and_blocks_change_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    model = Probabilistic().fit(*radio_world(seed=1, walks=2))
    again = Probabilistic()
    again.access_points_, again.storeys_ = model.access_points_, model.storeys_
    again.restore(model.arrays())
    scans, _ = radio_world(seed=3, walks=2)
    one, other = model.predict(scans), again.predict(scans)
    np.testing.assert_array_equal(one.xy, other.xy)
    np.testing.assert_array_equal(one.radius_95_m, other.radius_95_m)
    monkeypatch.setattr(probabilistic, "_LIKELIHOODS_AT_ONCE", 3000)
    np.testing.assert_allclose(model.predict(scans).xy, one.xy, atol=1e-9)


def test_one_scan_is_enough_and_a_validation_part_is_used() -> None:
    scans, places = radio_world(seed=1, walks=1)
    lone = Probabilistic().fit(scans[:1], places[:1]).predict(scans[:2])
    assert np.hypot(*(lone.xy - places.xy[0]).T).max() < 6
    assert (lone.radius_68_m >= 100).all()
    calibrated = Probabilistic().fit(scans, places, validation=(scans, places)).predict(scans)
    assert calibrated.radius_68_m.mean() < Probabilistic().fit(scans, places).predict(scans).radius_68_m.mean()


def test_wrong_parameters_are_told() -> None:
    with pytest.raises(UsageError, match=r"noise_db=0\.0: must be above 0"):
        model_named("probabilistic", noise_db=0.0).fit(*radio_world(walks=1))
