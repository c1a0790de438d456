"""cell-density learns a small building, says how sure it is, and takes odd training data."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.positioning.radio_fields import TWO_BUILDINGS, surveyed
from tests.positioning.radio_world import assert_says_what_is_unlike, radio_world
from vislam2tag.common.errors import UsageError
from vislam2tag.positioning.model_scores import score
from vislam2tag.positioning.models.cell_density import CellDensity
from vislam2tag.positioning.registry import model_named


def test_it_learns_buildings_and_floors() -> None:
    model = CellDensity().fit(*surveyed(240, TWO_BUILDINGS))
    scans, places = surveyed(120, TWO_BUILDINGS, seed=1)
    figures = score(model.predict(scans), places)
    assert figures.plane.mean_m is not None
    assert figures.plane.mean_m < 2.5
    assert figures.floor_hit == 1.0
    assert figures.inside_68 == pytest.approx(0.68, abs=0.12)
    assert figures.inside_95 == pytest.approx(0.95, abs=0.05)
    np.testing.assert_allclose(model.predict(scans).storey_probability.sum(axis=1), 1.0)


def test_a_fainter_phone_is_put_where_the_others_are() -> None:
    model = CellDensity().fit(*surveyed(200))
    scans, places = surveyed(100, seed=1)
    fainter = replace(scans, rssi_dbm=scans.rssi_dbm - 6.0)
    errors = [-model.score(either, places) for either in (scans, fainter)]
    assert errors[1] < 1.5 * errors[0]


def test_a_scan_like_nothing_that_was_learned_says_so() -> None:
    assert_says_what_is_unlike(CellDensity().fit(*radio_world(seed=1)))


def test_unsure_labels_reach_further() -> None:
    scans, places = surveyed(40)
    unsure = replace(places, sigma_m=np.full(len(places), 8.0))
    sure, wide = (
        CellDensity().fit(scans, either).density_.answer(scans).spread_m.mean() for either in (places, unsure)
    )
    assert wide > sure


def test_circles_grow_where_nobody_was() -> None:
    scans, places = surveyed(400)
    far = places.xy[:, 0] > np.quantile(places.xy[:, 0], 0.7)
    model = CellDensity().fit(scans[~far], places[~far])
    near, beyond = (model.predict(scans[rows]) for rows in (~far, far))
    assert np.median(beyond.radius_68_m) > 1.5 * np.median(near.radius_68_m)
    figures = score(beyond, places[far])
    assert figures.inside_95 is not None
    assert figures.inside_95 > 0.8


def test_it_reaches_where_nobody_was() -> None:
    scans, places = surveyed(400)
    east = places.xy[:, 0] > np.quantile(places.xy[:, 0], 0.75)
    model = CellDensity().fit(scans[~east], places[~east])
    by_density, answered = model.density_.answer(scans[east]).xy, model.predict(scans[east]).xy
    error_m = [places[east].distance_m(xy).mean() for xy in (by_density, answered)]
    assert error_m[1] < 0.5 * error_m[0]


def test_the_field_is_kept_only_where_it_is_asked() -> None:
    model = CellDensity().fit(*surveyed(200))
    assert any(name.startswith("field") for name in model.arrays())
    model.half_novelty_, model.density_ = np.inf, replace(model.density_, field=None)
    assert not any(name.startswith("field") for name in model.arrays())
    assert np.isfinite(model.predict(surveyed(20, seed=1)[0]).xy).all()


def test_impossible_parameters() -> None:
    with pytest.raises(UsageError, match="copies=-1"):
        model_named("cell-density", copies=-1).fit(*surveyed(10))


def test_progress_is_told() -> None:
    shares: list[float] = []
    model = CellDensity()
    model.progress = lambda done, total: shares.append(done / total)
    model.fit(*surveyed(20))
    assert shares == sorted(shares)
    assert shares[-1] == 1.0
