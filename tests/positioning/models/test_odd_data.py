"""Baselines on data that has little to tell: they answer, and their radii are finite."""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np
import pytest

from tests.positioning.radio_world import radio_world
from vislam2tag.common.errors import DatasetError
from vislam2tag.positioning.places import ScanPlaces
from vislam2tag.positioning.radio_scans import RadioScans
from vislam2tag.positioning.registry import model_named

BASELINES: dict[str, dict[str, Any]] = {
    "weighted-knn": {"distance": "cosine"},
    "local-kriging": {"k": 10},
    "cell-density": {"copies": 1},
}
SCANS, PLACES = radio_world(walks=2)
FIRST_STOREY = np.flatnonzero(PLACES.storey == 0)


def one_access_point() -> tuple[RadioScans, ScanPlaces]:
    scans = SCANS.over(SCANS.access_points[:1])
    return scans[scans.heard > 0], PLACES[scans.heard > 0]


def some_labels_missing() -> tuple[RadioScans, ScanPlaces]:
    known = np.arange(len(SCANS)) % 3 > 0
    return SCANS, replace(PLACES, xy=np.where(known[:, None], PLACES.xy, np.nan), z=np.full(len(SCANS), np.nan))


ODD = {
    "one storey": (SCANS[FIRST_STOREY], PLACES[FIRST_STOREY]),
    "one access point": one_access_point(),
    "constant levels": (replace(SCANS, rssi_dbm=np.full(len(SCANS.rssi_dbm), -60.0)), PLACES),
    "one place": (SCANS, replace(PLACES, xy=np.ones((len(SCANS), 2)), storey=np.zeros(len(SCANS), np.int64))),
    "no heights, few labels": some_labels_missing(),
    "no walks": (replace(SCANS, session=np.full(len(SCANS), "")), PLACES),
    "one walk": (replace(SCANS, session=np.full(len(SCANS), "w")), PLACES),
    "a lone scan": (SCANS[:1], PLACES[:1]),
    "twice the same scan": (SCANS[np.array([0, 0])], PLACES[np.array([0, 0])]),
}


@pytest.mark.parametrize(
    ("name", "odd"), [pair for pair in product(BASELINES, ODD) if pair != ("cell-density", "one place")]
)
def test_answers_are_finite(name: str, odd: str) -> None:
    scans, places = ODD[odd]
    found = model_named(name, **BASELINES[name]).fit(scans, places).predict(scans)
    assert found.known.all()
    for values in (found.xy, found.radius_68_m, found.radius_95_m, found.storey_probability):
        assert np.isfinite(values).all()
    assert (found.radius_68_m <= found.radius_95_m).all()
    np.testing.assert_allclose(found.storey_probability.sum(axis=1), 1)


@pytest.mark.parametrize("name", BASELINES)
def test_what_was_never_learned_is_unknown_or_elsewhere(name: str) -> None:
    model = model_named(name, **BASELINES[name])
    model.fit(SCANS[FIRST_STOREY], PLACES[FIRST_STOREY], validation=(SCANS, PLACES))
    assert set(model.predict(SCANS).storey.tolist()) <= {0, -1}
    assert len(model.predict(SCANS[:0])) == 0
    with pytest.raises(DatasetError, match="no fingerprint to learn from"):
        model.fit(SCANS[:0], PLACES[:0])
