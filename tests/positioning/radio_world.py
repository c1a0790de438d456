"""A small building of two storeys and two wings in which levels fall with distance: something for models to learn."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from vislam2tag.datasets.model import Storey
from vislam2tag.positioning.places import ScanPlaces
from vislam2tag.positioning.radio_scans import RadioScans, scans_from_readings
from vislam2tag.positioning.registry import Positioner

STOREYS = (Storey("east", 0), Storey("east", 1), Storey("west", 0))
FAINTEST_DBM = -92.0
SCANS_A_WALK = 12


def radio_world(
    seed: int = 0, walks: int = 4, SCANS_A_WALK: int = 12, offset_db: float = 0.0
) -> tuple[RadioScans, ScanPlaces]:
    """Scans of ``walks`` walks on each storey, and where they were taken; access points are the same for all seeds."""
    fixed = np.random.default_rng(99)
    points = fixed.uniform(0, 40, (len(STOREYS), 8, 2))
    rng = np.random.default_rng(seed)
    n = walks * SCANS_A_WALK * len(STOREYS)
    storey = np.repeat(np.arange(len(STOREYS)), walks * SCANS_A_WALK)
    xy = rng.uniform(0, 40, (n, 2))
    rows, names, levels = [], [], []
    for on, point in ((on, point) for on in range(len(STOREYS)) for point in range(8)):
        away = np.hypot(*(xy - points[on, point]).T)
        level = -35 - 1.2 * away - 18.0 * (storey != on) + rng.normal(0, 2, n) + offset_db
        heard = np.nonzero(level > FAINTEST_DBM)[0]
        rows.append(heard)
        names += [f"ap-{on}-{point}"] * len(heard)
        levels.append(level[heard])
    session = np.array([f"walk-{index // SCANS_A_WALK}" for index in range(n)])
    scans = scans_from_readings(np.concatenate(rows), np.array(names), np.concatenate(levels), n, session=session)
    places = ScanPlaces(STOREYS, storey, xy, 3.0 * (storey == 1), np.full(n, 0.1))
    return scans, places


def assert_says_what_is_unlike(model: Positioner) -> None:
    """A model of this building tells usual scans from those of a building with the same access points elsewhere."""
    scans, _ = radio_world(seed=2)
    other = np.random.default_rng(0).permutation(len(scans.access_points))
    nowhere = replace(scans, column=other[scans.column])
    usual, strange = (model.predict(one).unlike for one in (scans, nowhere))
    assert usual is not None
    assert strange is not None
    assert usual.mean() < 0.05
    assert strange.mean() > 0.6
