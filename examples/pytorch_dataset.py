"""Fingerprints as a PyTorch data set: batches of signal strengths with the place of each (needs the extra models)."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
import torch
from torch.utils.data import DataLoader, TensorDataset

from vislam2tag.api import Dataset, dataset, regular_survey, simulate

NOT_HEARD_DBM = -100.0


def tensors_of(made: Dataset, scan_ids: set[str]) -> TensorDataset:
    """Signal strengths (n, access points) as shares of the strongest, and places (n, 2) in metres, of these scans."""
    scans = made.fingerprints.filter(technology="wifi", status="ok").collect()
    heard = made.readings.collect().pivot("bssid", index="scan_id", values="rssi_dbm", aggregate_function="mean")
    table = scans.join(heard, on="scan_id", maintain_order="left").fill_null(NOT_HEARD_DBM)
    own = table.filter(table["scan_id"].is_in(list(scan_ids)))
    strength = own.select(name for name in heard.columns if name != "scan_id").to_numpy() - NOT_HEARD_DBM
    place = own.select("x", "y").to_numpy()
    return TensorDataset(torch.from_numpy(strength.astype(np.float32) / 70), torch.from_numpy(place.astype(np.float32)))


def main() -> None:
    """Train a small network on one part of the random split and score it on the other."""
    torch.manual_seed(1)
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder)
        simulate(regular_survey(seed=5, floors=(0,), sessions=2, duration_s=150.0), root / "survey")
        made = dataset(root / "survey", root / "set")
        split = made.splits["random"]
        train, test = (tensors_of(made, set(ids)) for ids in split.train_test_ids(split.info.folds[0]))
    strength, place = train.tensors
    centre, scale = place.mean(dim=0), place.std(dim=0)
    network = torch.nn.Sequential(torch.nn.Linear(strength.shape[1], 64), torch.nn.ReLU(), torch.nn.Linear(64, 2))
    optimiser = torch.optim.Adam(network.parameters(), lr=1e-2)
    for _ in range(100):
        for batch, target in DataLoader(train, batch_size=32, shuffle=True):
            optimiser.zero_grad()
            torch.nn.functional.mse_loss(network(batch), (target - centre) / scale).backward()
            optimiser.step()
    with torch.no_grad():
        error_m = (network(test.tensors[0]) * scale + centre - test.tensors[1]).norm(dim=1)
    print(f"{len(train)} fingerprints train, {len(test)} test: median error {error_m.median():.1f} m")


if __name__ == "__main__":
    main()
