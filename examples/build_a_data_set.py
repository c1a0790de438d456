"""Build a data set of a survey, and score nearest neighbours on its random split."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
from sklearn.neighbors import KNeighborsRegressor

from vislam2tag.api import build_dataset, regular_survey, simulate


def main() -> None:
    """Print the median error of positions from the signal strengths of three similar fingerprints."""
    with tempfile.TemporaryDirectory() as folder:
        simulate(regular_survey(seed=5, floors=(0,), sessions=2, duration_s=150.0), Path(folder) / "survey")
        dataset = build_dataset(Path(folder) / "survey", Path(folder) / "set", jobs=2)
        split = dataset.splits["random"]
        train, test = split.train_test_ids(split.info.folds[0])
        scans = dataset.fingerprints.filter(technology="wifi", status="ok").collect()
        heard = dataset.readings.collect().pivot("bssid", index="scan_id", values="rssi_dbm", aggregate_function="mean")
        table = scans.join(heard, on="scan_id", maintain_order="left").fill_null(-100.0)
        known, asked = (table.filter(table["scan_id"].is_in(part.implode())) for part in (train, test))
        radios = [name for name in heard.columns if name != "scan_id"]
        model = KNeighborsRegressor(3).fit(known.select(radios), known.select("x", "y"))
        error_m = np.linalg.norm(model.predict(asked.select(radios)) - asked.select("x", "y").to_numpy(), axis=1)
        print(f"{len(known)} fingerprints train, {len(asked)} test: median error {np.median(error_m):.1f} m")


if __name__ == "__main__":
    main()
