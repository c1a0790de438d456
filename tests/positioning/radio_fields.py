"""Scans of small buildings whose access points fade with distance: what tiny models learn in seconds."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vislam2tag.datasets.model import Storey
from vislam2tag.positioning.places import ScanPlaces
from vislam2tag.positioning.radio_scans import RadioScans, scans_from_readings

STOREY_HEIGHT_M = 4.0
TWO_FLOORS = ((Storey("A", 0), (40.0, 20.0)), (Storey("A", 1), (24.0, 12.0)))
"""Floors of different size."""
TWO_BUILDINGS = (*TWO_FLOORS, (Storey("B", -1), (16.0, 30.0)), (Storey("B", 0), (16.0, 30.0)))
"""Buildings each in a frame of its own, which overlap."""
FAINTEST_HEARD_DBM = -90.0


def surveyed(
    n: int, floors: Sequence[tuple[Storey, tuple[float, float]]] = TWO_FLOORS, seed: int = 0, noise_db: float = 2.0
) -> tuple[RadioScans, ScanPlaces]:
    """Draw ``n`` scans at random places, equally many a floor; eight access points a floor, always the same ones."""
    rng = np.random.default_rng(seed)
    storeys = tuple(storey for storey, _ in floors)
    size = np.array([size for _, size in floors])
    storey = np.arange(n) % len(floors)
    xy = rng.uniform(0, 1, (n, 2)) * size[storey]
    level = _levels(storeys, size, storey, xy) + rng.normal(0, noise_db, (n, 8 * len(floors)))
    rows, columns = np.nonzero(level > FAINTEST_HEARD_DBM)
    names = np.array([f"ap{column:02d}" for column in range(level.shape[1])], dtype=np.str_)
    floor = np.array([storey.floor for storey in storeys])
    places = ScanPlaces(storeys, storey, xy, STOREY_HEIGHT_M * floor[storey] + 1.0, np.full(n, 0.1))
    return scans_from_readings(rows, names[columns], level[rows, columns], n).over(tuple(names)), places


def _levels(storeys: Sequence[Storey], size: np.ndarray, storey: np.ndarray, xy: np.ndarray) -> np.ndarray:
    """(n, 8 s) log-distance fading; 15 dB a floor between, nothing from other buildings."""
    hung = np.random.default_rng(99).uniform(0, 1, (len(storeys), 8, 2)) * size[:, None]
    distance = np.linalg.norm(xy[:, None, None] - hung, axis=3)
    floor = np.array([one.floor for one in storeys])
    between = np.abs(floor[storey][:, None] - floor)
    building = np.array([one.building for one in storeys])
    other = building[storey][:, None] != building
    level = -35 - 30 * np.log10(np.maximum(distance, 1)) - 15 * between[..., None] - 999 * other[..., None]
    return np.asarray(level.reshape(len(xy), -1))
