"""The field of levels puts scans near where they were taken, also where nobody was."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.positioning.radio_fields import surveyed
from vislam2tag.positioning.cell_density import level_field as module
from vislam2tag.positioning.cell_density.level_field import LevelField, learned_fields
from vislam2tag.positioning.checked_arrays import CheckedArrays


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
