"""How much quicker a GPU trains the paper's regression network than two cores do, and whether it errs alike.

    python benchmarks/gpu_training.py                      about two minutes with a GPU; says so where there is none
    python benchmarks/gpu_training.py --seeds 1 --epochs 2 --fingerprints 2000

Fingerprints are drawn on five storeys of 100 x 60 m with 30 access points each. Both train with the program's loop,
layers and early stopping, with the published batches of 32 and with those that a GPU gets by default. Needs PyTorch and
NumPy alone. Prints wall times, their ratio and the mean error on 2,000 further fingerprints: the mean over seeds, and
the least and greatest.
"""

from __future__ import annotations

import argparse
import time
from typing import NamedTuple

import numpy as np
import torch

from vislam2tag.positioning.networks.layers import dense, linear
from vislam2tag.positioning.networks.positioner import (
    PUBLISHED_BATCH,
    NetworkSettings,
    TrainingExamples,
    batch_for,
    train,
)

STOREYS, ACCESS_POINTS = 5, 30
SIZE_M = np.array([100.0, 60.0])
FAINTEST_DBM, NOT_HEARD_DBM = -92.0, -110.0
ASKED, HELD_OUT = 2000, 0.1
LEARNING_RATE = 1e-3
CORES = 2


class Drawn(NamedTuple):
    """Scans as inputs (n, a) from 0 to 1, and x, y and storey (n, 3), metres and floors."""

    inputs: torch.Tensor
    places: torch.Tensor


class Trained(NamedTuple):
    """One training: how long it took, and the mean error in the plane, metres."""

    seconds: float
    error_m: float


def main() -> None:
    """Print a line for each size of batches and each device."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--fingerprints", type=int, default=20_000)
    parser.add_argument("--epochs", type=int, default=20)
    parser.add_argument("--seeds", type=int, default=3)
    arguments = parser.parse_args()
    torch.set_num_threads(CORES)
    names = ["cpu"]
    if torch.cuda.is_available():
        names.append("cuda")
        print(f"GPU: {torch.cuda.get_device_name()}; PyTorch {torch.__version__}")
    else:
        print("no GPU here: only the two cores are measured")
    data = drawn(arguments.fingerprints + ASKED)
    print("| batch | device | training, mean of seeds | mean error | least to greatest | times quicker |")
    print("| ---: | --- | ---: | ---: | ---: | ---: |")
    large, faster = batch_for(round((1 - HELD_OUT) * arguments.fingerprints), torch.device("cuda"))
    for batch, rate in ((PUBLISHED_BATCH, LEARNING_RATE), (large, faster * LEARNING_RATE)):
        first_s = None
        for name in names:
            device = torch.device(name)
            trained(
                data, device, NetworkSettings(epochs=1, batch_size=batch, learning_rate=rate)
            )  # the first call sets a device up
            schedules = [
                NetworkSettings(epochs=arguments.epochs, batch_size=batch, learning_rate=rate, seed=seed)
                for seed in range(arguments.seeds)
            ]
            runs = [trained(data, device, schedule) for schedule in schedules]
            seconds, error_m = (np.array(part) for part in zip(*runs, strict=True))
            first_s = first_s or float(seconds.mean())
            print(
                f"| {batch} | {name if name == 'cuda' else f'{CORES} cores'} | {seconds.mean():.1f} s | "
                f"{error_m.mean():.2f} m | {error_m.min():.2f} to {error_m.max():.2f} m | "
                f"{first_s / seconds.mean():.1f} |",
                flush=True,
            )


def drawn(count: int) -> Drawn:
    """Draw fingerprints: exponent 3, 15 dB a storey, shadows and fading of 4 dB."""
    rng = np.random.default_rng(0)
    stands, stands_on = rng.uniform(0, 1, (STOREYS * ACCESS_POINTS, 2)) * SIZE_M, np.arange(STOREYS * ACCESS_POINTS)
    storey, xy = np.arange(count) % STOREYS, rng.uniform(0, 1, (count, 2)) * SIZE_M
    away_m = np.hypot(np.linalg.norm(xy[:, None] - stands, axis=2), 2.0)
    between = np.abs(storey[:, None] - stands_on // ACCESS_POINTS)
    level = -35 - 30 * np.log10(away_m) - 15.0 * between + rng.normal(0, 4, away_m.shape)
    heard = np.where(level > FAINTEST_DBM, level, NOT_HEARD_DBM)
    inputs = (heard - NOT_HEARD_DBM) / (heard.max() - NOT_HEARD_DBM)
    return Drawn(
        torch.from_numpy(inputs.astype(np.float32)),
        torch.from_numpy(np.column_stack([xy, storey]).astype(np.float32)),
    )


def trained(data: Drawn, device: torch.device, schedule: NetworkSettings) -> Trained:
    """Train a network of the published widths; asks it about the last fingerprints."""
    torch.manual_seed(schedule.seed)
    count = len(data.inputs) - ASKED
    inputs, places = data.inputs.to(device), data.places.to(device)
    mean, deviation = places[:count].mean(dim=0), places[:count].std(dim=0)
    network = torch.nn.Sequential(*dense(inputs.shape[1], (512,), 0.5), *dense(512, (512,), 0.25), linear(512, 3))
    network.to(device)
    order = torch.from_numpy(np.random.default_rng(schedule.seed).permutation(count)).to(device)
    held_out, learned = order.split([round(HELD_OUT * count), count - round(HELD_OUT * count)])

    def examples(chosen: torch.Tensor) -> TrainingExamples:
        own, targets = inputs[chosen], (places[chosen] - mean) / deviation
        return TrainingExamples(len(chosen), lambda rows: (network(own[rows]) - targets[rows]).square().mean(dim=1))

    begun = time.perf_counter()
    train(network, examples(learned), examples(held_out), schedule)
    seconds = time.perf_counter() - begun
    with torch.no_grad():
        found = network(inputs[count:]) * deviation + mean
    return Trained(seconds, float((found - places[count:])[:, :2].norm(dim=1).mean()))


if __name__ == "__main__":
    main()
