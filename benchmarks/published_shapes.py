"""Readers of UJIIndoorLoc and UTSIndoorLoc on generated files of the shape and size of the published ones.

The files themselves are not here. Levels, places and floors are drawn; columns, separators, the value for "not heard"
and the numbers of rows and access points are those of the publications. Prints what was read, the time as a multiple of
what Polars takes to read the same text, and the peak of memory.

    python benchmarks/published_shapes.py
"""

from __future__ import annotations

import resource
import tempfile
import time
from pathlib import Path

import numpy as np
import polars as pl

from vislam2tag.pipeline.positioning.benchmark import public_dataset
from vislam2tag.positioning.scans.learning_data import learning_data

HEARD = 18
"""Access points in a scan, as in UJIIndoorLoc."""


def levels(rng: np.random.Generator, rows: int, access_points: int) -> np.ndarray:
    """Return dBm (rows, access_points), 100 where not heard."""
    table = np.full((rows, access_points), 100)
    table[np.arange(rows)[:, None], rng.integers(0, access_points, (rows, HEARD))] = rng.integers(
        -100, -40, (rows, HEARD)
    )
    return table


def uji(folder: Path, rng: np.random.Generator) -> None:
    """Write 19937 and 1111 fingerprints of 520 access points, three buildings with up to five floors."""
    for name, rows in (("trainingData.csv", 19937), ("validationData.csv", 1111)):
        building = rng.integers(0, 3, rows)
        columns = dict(zip((f"WAP{n:03d}" for n in range(1, 521)), levels(rng, rows, 520).T, strict=True)) | {
            "LONGITUDE": -7600 + 100.0 * building + rng.uniform(0, 90, rows),
            "LATITUDE": 4864750 + rng.uniform(0, 200, rows),
            "FLOOR": rng.integers(0, np.where(building == 2, 5, 4)),
            "BUILDINGID": building,
            "SPACEID": rng.integers(1, 250, rows),
            "RELATIVEPOSITION": rng.integers(1, 3, rows),
            "USERID": rng.integers(1, 19, rows),
            "PHONEID": rng.integers(1, 25, rows),
            "TIMESTAMP": 1371713733 + np.arange(rows),
        }
        pl.DataFrame(columns).write_csv(folder / name)


def uts(folder: Path, rng: np.random.Generator) -> None:
    """Write 9108 and 388 fingerprints of 589 access points on 16 floors."""
    for name, rows in (("UTS_training.csv", 9108), ("UTS_test.csv", 388)):
        columns = dict(zip((f"WAP{n:03d}" for n in range(1, 590)), levels(rng, rows, 589).T, strict=True)) | {
            "Pos_x": rng.uniform(0, 80, rows),
            "Pos_y": rng.uniform(0, 60, rows),
            "Floor_ID": rng.integers(0, 16, rows),
        }
        pl.DataFrame(columns).write_csv(folder / name)


def main() -> None:
    """Write, read, and print."""
    for name, write in (("ujiindoorloc", uji), ("utsindoorloc", uts)):
        with tempfile.TemporaryDirectory() as folder:
            write(Path(folder), np.random.default_rng(0))
            begun = time.monotonic()
            for file in sorted(Path(folder).iterdir()):
                pl.read_csv(file)
            plain = time.monotonic() - begun
            begun = time.monotonic()
            with public_dataset(name, Path(folder)) as dataset:
                data = learning_data(dataset)
                train, test = data.train_test(dataset.splits["official"], dataset.splits["official"].info.folds[0])
            ratio = (time.monotonic() - begun) / plain
            peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
            print(
                f"{name}: {len(train)} train, {len(test)} test, {len(data.scans.access_points)} access points, "
                f"{len(data.scans.rssi_dbm)} readings, {len(data.places.storeys)} floors; "
                f"{ratio:.0f} times as long as Polars reads the text; peak {peak:.1f} GiB",
                flush=True,
            )


if __name__ == "__main__":
    main()
