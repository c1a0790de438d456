"""Learn the distance walked in a second from accelerometer and gyroscope, and integrate it to a path."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
import numpy.typing as npt
import polars as pl
from sklearn.linear_model import Ridge
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

from vislam2tag.api import regular_survey, simulate
from vislam2tag.datasets.model import Dataset
from vislam2tag.datasets.schema import IMU_WINDOWS
from vislam2tag.pipeline.datasets.build import build_dataset

Array = npt.NDArray[np.float64]


def features(windows: pl.DataFrame) -> Array:
    """Mean, spread and spectrum of each axis in the window's own level frame: (w, f)."""
    columns = []
    for name in ("accelerometer", "gyroscope"):
        samples = np.array(windows[name].to_list()).reshape(len(windows), -1, 3)
        spectrum = np.abs(np.fft.rfft(samples - samples.mean(axis=1, keepdims=True), axis=1))[:, 1:7]
        columns += [samples.mean(axis=1), samples.std(axis=1), spectrum.reshape(len(windows), -1)]
    return np.concatenate(columns, axis=1)


def displacement(windows: pl.DataFrame) -> Array:
    """What is learned: the way walked, in the window's own frame (w, 2), m."""
    return windows.select("displacement_x", "displacement_y").to_numpy()


def way_in_building(windows: pl.DataFrame, own: Array) -> Array:
    """Turn ways (w, 2) from the windows' frames into the building's, and add them up; headings are the tracker's."""
    turned = (own[:, 0] + 1j * own[:, 1]) * np.exp(1j * windows["heading_rad"].to_numpy())
    return np.cumsum(np.column_stack((turned.real, turned.imag)), axis=0)


def learn(dataset: Dataset) -> None:
    """Train on some walks and test on the others; print the errors."""
    windows = dataset.tables[IMU_WINDOWS].collect()
    split = dataset.splits["trajectory"]
    train_ids, test_ids = split.train_test_ids(split.info.folds[0])
    train, test = (windows.filter(pl.col("window_id").is_in(ids.implode())) for ids in (train_ids, test_ids))
    model = make_pipeline(StandardScaler(), Ridge(alpha=10.0)).fit(features(train), displacement(train))
    learned, usual = model.predict(features(test)), np.tile(displacement(train).mean(axis=0), (len(test), 1))
    print(f"{len(train)} windows train, {len(test)} of walks never seen test")
    for name, guess in (("learned", learned), ("always the mean", usual)):
        error = np.sqrt(np.mean(np.sum((guess - displacement(test)) ** 2, axis=1)))
        print(f"{name}: a second's way to {error:.2f} m (root mean square)")
    for (session,), walk in test.with_row_index("row").group_by("session", maintain_order=True):
        drift = way_in_building(walk, learned[walk["row"]]) - way_in_building(walk, displacement(walk))
        metres = np.linalg.norm(displacement(walk), axis=1).sum()
        print(f"{session}: after {metres:.0f} m of dead reckoning {np.linalg.norm(drift[-1]):.1f} m off")


def main() -> None:
    """Simulate a survey, build its data set, learn."""
    with tempfile.TemporaryDirectory() as folder:
        survey = Path(folder) / "survey"
        simulate(regular_survey(seed=6, floors=(0,), devices=("LG", "OnePlus"), sessions=3, duration_s=90.0), survey)
        learn(build_dataset(survey, Path(folder) / "dataset"))


if __name__ == "__main__":
    main()
