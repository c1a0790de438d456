"""Speed of radio maps against scikit-learn's Gaussian process fitted to each access point on its own.

One floor of 80 x 40 m with 200 access points and 2000 fingerprints. On the one side all its maps, as
``vislam2tag radio-maps`` makes them (kernel, folds left out, shares heard, 1 m cells); on the other
GaussianProcessRegressor with the same kernel, whose likelihood is maximised for each access point, and its prediction
of the same cells, on a sample of access points and scaled to all. Both run in turn in one thread.

    python benchmarks/radio_map_speed.py
    python benchmarks/radio_map_speed.py --access-points 50 --fingerprints 500 --repeats 1
"""

from __future__ import annotations

import argparse
import statistics
import warnings

import numpy as np
import polars as pl
from measure import seconds
from sklearn.exceptions import ConvergenceWarning
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import WhiteKernel
from threadpoolctl import threadpool_limits

from vislam2tag.dataset.model import Dataset, DatasetInfo, FloorInfo
from vislam2tag.dataset.radio_mapping.map_process import MapKernel
from vislam2tag.dataset.radio_mapping.map_readings import MapPlace, map_readings
from vislam2tag.dataset.radio_mapping.radio_maps import FloorMaps, radio_maps
from vislam2tag.dataset.schema import ACCESS_POINTS, FINGERPRINTS, READINGS, SESSIONS, empty_table, in_schema
from vislam2tag.dataset.settings import RadioMapSettings

SIZE_M = np.array([80.0, 40.0])
WALKS, NOISE_DB, FAINTEST_DBM = 20, 3.0, -90.0
SAMPLE = 4
"""Access points that are fitted on their own."""


def main() -> None:
    """Make the set, map it both ways in turn, print the ratio."""
    options = _options()
    dataset = _dataset(options.access_points, options.fingerprints)
    settings = RadioMapSettings(most=options.access_points)
    ratios = []
    with threadpool_limits(limits=1):
        maps = next(radio_maps(dataset, settings))
        for _ in range(options.repeats):
            own = seconds(_all, dataset, settings)
            each = seconds(_one_by_one, dataset, maps) * len(maps.maps) / min(SAMPLE, len(maps.maps))
            ratios.append(own / each)
    heard = sum(one.readings for one in maps.maps)
    print(f"{len(maps.maps)} access points, {maps.scans} fingerprints, {heard} readings, {maps.grid.shape} cells")
    low, high = min(ratios), max(ratios)
    print(f"radio_maps / scikit-learn one by one: {statistics.median(ratios):.3f} ({low:.3f} to {high:.3f})")


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--access-points", type=int, default=200)
    parser.add_argument("--fingerprints", type=int, default=2000)
    parser.add_argument("--repeats", type=int, default=3)
    return parser.parse_args()


def _all(dataset: Dataset, settings: RadioMapSettings) -> None:
    for maps in radio_maps(dataset, settings):
        del maps


def _one_by_one(dataset: Dataset, maps: FloorMaps) -> None:
    """Fit and predict a sample of the access points, each with a kernel of its own."""
    chosen = [maps.maps[index] for index in np.linspace(0, len(maps.maps) - 1, SAMPLE).astype(int)]
    names = [one.bssid for one in chosen]
    readings = map_readings(dataset, MapPlace("", 0, "wifi"), names, {})
    start = MapKernel()
    for number, name in enumerate(names):
        position, rssi, _ = readings.of(number)
        process = GaussianProcessRegressor(start.smooth() + WhiteKernel(start.noise_db**2), normalize_y=False)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ConvergenceWarning)
            process.fit(position, rssi - rssi.mean())
        index = [one.bssid for one in maps.maps].index(name)
        cells = np.argwhere(np.isfinite(maps.mean_dbm[index]))
        process.predict(maps.grid.centres_m(cells), return_std=True)


def _dataset(access_points: int, fingerprints: int) -> Dataset:
    """Walks along the lines of a grid of corridors, log-distance path loss, noise."""
    rng = np.random.default_rng(1)
    place = rng.uniform((0, 0), SIZE_M, (access_points, 2))
    along = rng.uniform((0, 0), SIZE_M, (fingerprints, 2))
    lane = np.round(along / 10) * 10
    across = rng.random(fingerprints) < 0.5
    position = np.where(np.column_stack((across, ~across)), along, lane) + rng.normal(0, 0.4, (fingerprints, 2))
    distance = np.linalg.norm(position[:, None] - place, axis=2)
    rssi = -38 - 30 * np.log10(np.maximum(distance, 1)) + rng.normal(0, NOISE_DB, distance.shape)
    scan, point = np.nonzero(rssi >= FAINTEST_DBM)
    walk = np.arange(fingerprints) * WALKS // fingerprints
    ids = np.array([f"walk_{walk[number]:02d}/wifi/{number:06d}" for number in range(fingerprints)])
    names = np.array([f"02:00:00:00:{number // 256:02x}:{number % 256:02x}" for number in range(access_points)])
    common = {"technology": "wifi", "building": "", "floor": 0, "device": "phone", "status": "ok"}
    tables = {
        FINGERPRINTS: pl.DataFrame({"scan_id": ids, "x": position[:, 0], "y": position[:, 1]}).with_columns(
            session=pl.Series([f"walk_{number:02d}" for number in walk]),
            **{name: pl.lit(value) for name, value in common.items()},
        ),
        READINGS: pl.DataFrame(
            {"scan_id": ids[scan], "bssid": names[point], "rssi_dbm": rssi[scan, point], "floor": 0}
            | {"x": position[scan, 0], "y": position[scan, 1]}
        ),
        ACCESS_POINTS: pl.DataFrame({"bssid": names, "technology": "wifi"}),
        SESSIONS: empty_table(SESSIONS),
    }
    info = DatasetInfo(name="benchmark", floors=(FloorInfo(number=0),))
    return Dataset(info, {name: in_schema(name, table).lazy() for name, table in tables.items()})


if __name__ == "__main__":
    main()
