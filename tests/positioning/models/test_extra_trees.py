"""Extremely randomised trees: votes of leaves, radii that hold, seeds that repeat."""

from __future__ import annotations

import numpy as np
import pytest

from tests.positioning.radio_world import radio_world
from vislam2tag.common.errors import UsageError
from vislam2tag.positioning.metrics import score
from vislam2tag.positioning.models.extra_trees import MOST_TREES, ExtraTrees
from vislam2tag.positioning.registry import model_named


def test_learned_scans_are_where_they_were() -> None:
    scans, places = radio_world(seed=1, walks=2)
    found = ExtraTrees(trees=10).fit(scans, places).predict(scans)
    np.testing.assert_allclose(found.xy, places.xy)
    np.testing.assert_array_equal(found.storey, places.storey)
    np.testing.assert_allclose(found.z, places.z)


def test_it_learns_and_its_radii_hold() -> None:
    shares: list[float] = []
    model = model_named("extra-trees", trees=50)
    model.progress = lambda done, total: shares.append(done / total)
    model.fit(*radio_world(seed=1))
    scans, true = radio_world(seed=2)
    result = score(model.predict(scans), true)
    assert result.plane.mean_m is not None
    assert result.plane.mean_m < 6
    assert result.floor_hit is not None
    assert result.floor_hit > 0.95
    assert result.inside_68 == pytest.approx(0.68, abs=0.12)
    assert result.inside_95 == pytest.approx(0.95, abs=0.05)
    assert shares == sorted(shares)
    assert shares[-1] == 1


def test_the_same_seed_gives_the_same_answers_and_saved_ones_too() -> None:
    learned, asked = radio_world(seed=1, walks=2), radio_world(seed=3, walks=2)[0]
    model = ExtraTrees(trees=10, seed=4).fit(*learned)
    again = ExtraTrees(trees=10, seed=4).fit(*learned)
    for name, array in model.arrays().items():
        np.testing.assert_array_equal(array, again.arrays()[name])
    loaded = ExtraTrees(trees=10)
    loaded.access_points_, loaded.storeys_ = model.access_points_, model.storeys_
    loaded.restore(model.arrays())
    np.testing.assert_array_equal(loaded.predict(asked).xy, model.predict(asked).xy)
    np.testing.assert_array_equal(loaded.predict(asked).radius_68_m, model.predict(asked).radius_68_m)
    other = ExtraTrees(trees=10, seed=5).fit(*learned)
    assert (other.predict(asked).xy != model.predict(asked).xy).any()


def test_one_scan_is_enough_and_a_validation_part_is_used() -> None:
    scans, places = radio_world(seed=1, walks=1)
    lone = ExtraTrees(trees=3).fit(scans[:1], places[:1]).predict(scans[:2])
    np.testing.assert_allclose(lone.xy, places.xy[[0, 0]])
    assert (lone.radius_68_m >= 100).all()
    calibrated = ExtraTrees(trees=3).fit(scans, places, validation=(scans, places)).predict(scans)
    assert (calibrated.radius_68_m < 1).all()


@pytest.mark.parametrize(
    "parameters", [{"trees": 0}, {"trees": MOST_TREES + 1}, {"levels_a_split": 0.0}, {"storey_m": -1.0}]
)
def test_wrong_parameters_are_told(parameters: dict[str, float]) -> None:
    with pytest.raises(UsageError, match="there are 1 to 100000 trees"):
        model_named("extra-trees", **parameters).fit(*radio_world(walks=1))
