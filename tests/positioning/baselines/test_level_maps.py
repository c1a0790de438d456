"""Level maps: by hand in one cell, and nothing told where nothing was heard."""

from __future__ import annotations

import numpy as np
import pytest

from tests.positioning.radio_world import STOREYS, radio_world
from tests.positioning.scans.test_radio_scans import scans_from
from vislam2tag.positioning.baselines import level_maps as module
from vislam2tag.positioning.baselines.level_maps import FAINT_DBM, level_maps
from vislam2tag.positioning.scans.places import ScanPlaces


def test_a_cell_is_the_weighted_mean_of_its_storeys_scans() -> None:
    levels = np.full((3, 6), np.nan)
    levels[0, :2], levels[1, 0], levels[2, 2] = (-50.0, -60.0), -70.0, -40.0
    xy = np.array([[1.0, 1.0], [4.0, 1.0], [1.0, 1.0]])
    places = ScanPlaces(STOREYS, np.array([0, 0, 1]), xy, np.array([1.0, 2.0, 3.0]), np.full(3, np.nan))
    maps = level_maps(scans_from(levels), places, cell_m=2.0, smoothing_m=3.0, prior_scans=0.5)
    row = np.flatnonzero((maps.cells.storey == 0) & (maps.cells.xy == [1.0, 1.0]).all(axis=1))[0]
    near, far = 1.0, np.exp(-9 / 18)
    assert maps.heard[row, 0] == pytest.approx((near + far + 0.5 * 2 / 3) / (near + far + 0.5))
    assert maps.heard[row, 1] == pytest.approx((near + 0.5 / 3) / (near + far + 0.5))
    expected = (near * -50 + far * -70 + 0.5 * FAINT_DBM) / (near + far + 0.5)
    assert maps.level_dbm[row, 0] == pytest.approx(expected)
    assert maps.level_dbm[row, 2] == FAINT_DBM
    assert maps.cells.z[row] == 1.0
    assert set(maps.cells.storey.tolist()) == {0, 1}


def test_cells_lie_near_scans_and_blocks_change_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    scans, places = radio_world(seed=1, walks=1)
    maps = level_maps(scans, places, 3.0, 4.0, 0.1)
    for storey in range(len(STOREYS)):
        cells, own = maps.cells.xy[maps.cells.storey == storey], places.xy[places.storey == storey]
        away = np.hypot(*(cells[:, None] - own).transpose(2, 0, 1))
        assert (away.min(axis=1) < 3.0 * (1.5 + np.sqrt(0.5))).all()
        assert (away.min(axis=0) <= 3.0 * np.sqrt(0.5)).all()
    assert ((maps.heard > 0) & (maps.heard < 1)).all()
    monkeypatch.setattr(module, "_WEIGHTS_AT_ONCE", 100)
    np.testing.assert_allclose(level_maps(scans, places, 3.0, 4.0, 0.1).level_dbm, maps.level_dbm)
