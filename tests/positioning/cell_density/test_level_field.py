"""The path loss finds where access points stand and how they fade, from what is heard and what is not.

The field of levels puts scans near where they were taken, also where nobody was.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.positioning.radio_fields import surveyed
from vislam2tag.datasets.model import Storey
from vislam2tag.positioning.cell_density import level_field as module
from vislam2tag.positioning.cell_density.level_field import LevelField, fitted_path_loss, learned_fields, unheard_dbm
from vislam2tag.positioning.places import ScanPlaces
from vislam2tag.positioning.radio_scans import CheckedArrays

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


def learned(*rows: slice, noise_db: float = 3.0) -> LevelField:
    scans, places = surveyed(300)
    chosen = np.r_[rows] if rows else np.arange(len(places))
    return learned_fields(scans[chosen].dense(), places[chosen], [noise_db])[0]


def test_it_puts_scans_where_they_were_taken() -> None:
    scans, places = surveyed(100, seed=1)
    error_m = places.distance_m(learned().place(scans.dense(), places.storey))
    assert error_m.mean() < 1.6


def test_it_reaches_where_nobody_was() -> None:
    scans, places = surveyed(300)
    far = places.xy[:, 0] > np.quantile(places.xy[:, 0], 0.8)
    (field,) = learned_fields(scans[~far].dense(), places[~far], [3.0])
    found = field.place(scans[far].dense(), places.storey[far])
    assert places[far].distance_m(found).mean() < 3.5
    east_m = field.cells.centre_m[:, 0]
    beyond, walked = east_m > places.xy[~far, 0].max() + 5, (east_m > 2) & (east_m < 20)
    assert np.median(field.variance[beyond]) > 1.3 * np.median(field.variance[walked])


def test_a_common_offset_changes_little() -> None:
    scans, places = surveyed(100, seed=1)
    field = learned()
    either = [field.place(scans.dense() - offset_db, places.storey) for offset_db in (0.0, 5.0)]
    assert np.median(np.hypot(*(either[0] - either[1]).T)) < 1.0


def test_cells_grow_with_what_must_be_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    many = len(learned().cells)
    monkeypatch.setattr("vislam2tag.positioning.cell_density.level_field._MOST_NUMBERS", many)
    assert 0 < len(learned().cells) * 16 <= many


def test_nothing_heard_is_somewhere_on_the_storey() -> None:
    field = learned()
    silent = np.full((1, field.level_dbm.shape[1]), np.nan)
    assert np.isfinite(field.place(silent, np.array([1]))).all()


def test_a_storey_that_was_not_learned_has_places_too() -> None:
    scans, places = surveyed(40)
    ground = places.storey == 0
    (field,) = learned_fields(scans[ground].dense(), places[ground], [3.0])
    assert np.isfinite(field.place(scans.dense(), places.storey)).all()


def test_one_scan() -> None:
    scans, places = surveyed(2)
    (field,) = learned_fields(scans[np.array([0])].dense(), places[np.array([0])], [3.0])
    found = field.place(scans.dense(), np.array([0, 0]))
    assert np.hypot(*(found[0] - places.xy[0])) < 12


def test_it_comes_back_from_its_arrays() -> None:
    scans, places = surveyed(30)
    field = learned()
    back = LevelField.restored(CheckedArrays(field.arrays(), s=9, a=field.level_dbm.shape[1]))
    np.testing.assert_array_equal(back.place(scans.dense(), places.storey), field.place(scans.dense(), places.storey))


def test_where_frames_lie_does_not_matter() -> None:
    """As in UJIIndoorLoc, millions of metres from the origin."""
    scans, places = surveyed(60)
    away_m = np.array([-7600.5, 4864900.5])
    moved = replace(places, xy=places.xy + away_m)
    here, there = (learned_fields(scans.dense(), either, [3.0])[0] for either in (places, moved))
    found = [field.place(scans.dense(), places.storey) for field in (here, there)]
    assert np.median(np.hypot(*(found[1] - away_m - found[0]).T)) < 0.3


def test_many_scans_are_asked_part_after_part(monkeypatch: pytest.MonkeyPatch) -> None:
    scans, places = surveyed(60)
    (field,) = learned_fields(scans.dense(), places, [6.0])
    whole = field.place(scans.dense(), places.storey)
    monkeypatch.setattr(module, "_MOST_NUMBERS", 7 * len(field.cells))
    np.testing.assert_allclose(field.place(scans.dense(), places.storey), whole, atol=1e-9)
    assert field.place(scans.dense()[:0], places.storey[:0]).shape == (0, 2)
