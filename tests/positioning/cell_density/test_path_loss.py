"""The path loss finds where access points stand and how they fade, from what is heard and what is not."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vislam2tag.dataset.model import Storey
from vislam2tag.positioning.cell_density.path_loss import fitted_path_loss, unheard_dbm
from vislam2tag.positioning.scans.places import ScanPlaces

FAINTEST_DBM = -90.0
STANDS = np.array([[5.0, 8.0], [30.0, 15.0], [44.0, 10.0]])
"""The last one beyond where anybody was."""


def heard(n: int, storeys: int = 1, exponent: float = 3.0) -> tuple[np.ndarray, ScanPlaces]:
    """Levels at places of 40 x 20 m, 15 dB fainter on the second storey."""
    rng = np.random.default_rng(0)
    storey, xy = np.arange(n) % storeys, rng.uniform(0, 1, (n, 2)) * (40.0, 20.0)
    away = np.hypot(np.linalg.norm(xy[:, None] - STANDS, axis=2), 3.0)
    level = -35 - 10 * exponent * np.log10(away) - 15.0 * storey[:, None] + rng.normal(0, 2, (n, 3))
    names = tuple(Storey("", number) for number in range(storeys))
    return np.where(level < FAINTEST_DBM, np.nan, level), ScanPlaces(names, storey, xy, np.zeros(n), np.zeros(n))


def test_it_finds_places_exponents_and_storeys() -> None:
    found = fitted_path_loss(*heard(200, storeys=2), FAINTEST_DBM)
    assert np.hypot(*(found.xy - STANDS).T).max() < 4.0
    np.testing.assert_allclose(found.exponent, 3.0, atol=0.4)
    np.testing.assert_allclose(found.power_dbm[0] - found.power_dbm[1], 15.0, atol=3.0)


def test_it_tells_levels_where_nobody_was() -> None:
    level, places = heard(300)
    beyond = places.xy[:, 0] > 30
    found = fitted_path_loss(level[~beyond], places[~beyond], FAINTEST_DBM)
    error_db = found.level_dbm(places.storey[beyond], places.xy[beyond]) - level[beyond]
    assert np.nanmedian(np.abs(error_db)) < 4.0


def test_what_is_not_heard_tells_something() -> None:
    """Levels fall beyond the faintest: who looks at heard ones alone sees them level out."""
    level, places = heard(300, exponent=5.0)
    found = fitted_path_loss(level, places, FAINTEST_DBM)
    silent = np.isnan(level)
    assert silent.mean() > 0.2
    assert (found.level_dbm(places.storey, places.xy)[silent] < FAINTEST_DBM + 3).mean() > 0.8


@given(expected=st.floats(-160, -20), deviation=st.floats(0.5, 15))
def test_unheard_levels_are_no_louder_than_expected(expected: float, deviation: float) -> None:
    level = unheard_dbm(np.array([expected]), deviation, FAINTEST_DBM)[0]
    assert level <= expected
    assert level >= min(expected, FAINTEST_DBM) - 3 * deviation


def test_loud_ones_were_missed_and_faint_ones_are_as_expected() -> None:
    loud, near, faint = unheard_dbm(np.array([-50.0, -88.0, -120.0]), 4.0, FAINTEST_DBM)
    assert loud == pytest.approx(-50.0, abs=0.01)
    assert near < FAINTEST_DBM
    assert faint == pytest.approx(-120.0, abs=0.01)


def test_levels_fall_with_distance_whatever_is_heard() -> None:
    level, places = heard(60)
    rising = -90.0 + np.linalg.norm(places.xy[:, None] - STANDS, axis=2)
    assert (fitted_path_loss(rising, places, FAINTEST_DBM).exponent >= 1.0).all()
    assert (fitted_path_loss(level, places, FAINTEST_DBM).exponent > 2.0).all()
