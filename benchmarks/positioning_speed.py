"""How long models take to learn many fingerprints, as multiples of ``multi-cel`` in the same run.

    python benchmarks/positioning_speed.py                            20,000 fingerprints: an hour on one core
    python benchmarks/positioning_speed.py --fingerprints 5000

Fingerprints are drawn on five storeys of 100 x 60 m with 30 access points each, whose levels fall with distance; 40
walks. Each model learns once, with its own settings, on one thread.
"""

from __future__ import annotations

import argparse
import time

import numpy as np

from vislam2tag.common.extras import import_extra
from vislam2tag.dataset.model import Storey
from vislam2tag.positioning.registry import model_named
from vislam2tag.positioning.scans.places import ScanPlaces
from vislam2tag.positioning.scans.radio_scans import RadioScans, scans_from_readings

STOREYS, ACCESS_POINTS, WALKS = 5, 30, 40
SIZE_M = np.array([100.0, 60.0])
FAINTEST_DBM = -92.0
MODELS = ("multi-cel", "regression-net", "cell-density", "cell-density-networks", "weighted-knn", "probabilistic")


def drawn(count: int) -> tuple[RadioScans, ScanPlaces]:
    """Draw fingerprints: exponent 3, 15 dB a storey, shadows and fading of 4 dB."""
    rng = np.random.default_rng(0)
    stands, stands_on = rng.uniform(0, 1, (STOREYS * ACCESS_POINTS, 2)) * SIZE_M, np.arange(STOREYS * ACCESS_POINTS)
    storey, xy = np.arange(count) % STOREYS, rng.uniform(0, 1, (count, 2)) * SIZE_M
    z, sigma_m = np.full(count, np.nan), np.full(count, 0.2)
    away_m = np.hypot(np.linalg.norm(xy[:, None] - stands, axis=2), 2.0)
    between = np.abs(storey[:, None] - stands_on // ACCESS_POINTS)
    level = -35 - 30 * np.log10(away_m) - 15.0 * between + rng.normal(0, 4, away_m.shape)
    row, column = np.nonzero(level > FAINTEST_DBM)
    session = np.char.add("walk", (np.arange(count) * WALKS // count).astype(np.str_))
    scans = scans_from_readings(
        row, np.char.add("ap", column.astype(np.str_)), level[row, column], count, session=session
    )
    storeys = tuple(Storey("", number) for number in range(STOREYS))
    return scans, ScanPlaces(storeys, storey, xy, z, sigma_m)


def main() -> None:
    """Print each model's time beside the first one's."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--fingerprints", type=int, default=20_000)
    count = parser.parse_args().fingerprints
    import_extra("torch").set_num_threads(1)
    scans, places = drawn(count)
    print(f"{count} fingerprints that hear {scans.heard.mean():.0f} access points on average")
    first_s = 0.0
    for name in MODELS:
        start = time.process_time()
        model_named(name).fit(scans, places)
        taken_s = time.process_time() - start
        first_s = first_s or taken_s
        print(f"{name}: {taken_s / first_s:.2f} times {MODELS[0]}'s processor's time", flush=True)


if __name__ == "__main__":
    main()
