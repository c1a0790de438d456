"""Which kernel tells storeys best, with and without the scans whose storey all others contradict.

    vislam2tag import ../shared/data/tampere/tampere-2017-08-21.tar.xz --format tampere --out tampere
    python benchmarks/storey_kernels.py tampere --split official
    python benchmarks/storey_kernels.py tampere --everything     what all fingerprints tell of each left out

Ridge regression onto storeys on what trains in a split, never on its test part: ten folds of scans, and six of phones,
three draws each. Prints the share on the right floor.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
from positioning_settings import training_part

from vislam2tag.core.arrays import BoolArray, FloatArray
from vislam2tag.dataset.folder import open_dataset
from vislam2tag.positioning.cell_density.kernel_regression import (
    KernelNormalEquations,
    KernelRegression,
)
from vislam2tag.positioning.cell_density.mislabelled_storeys import mislabelled
from vislam2tag.positioning.cell_density.scan_kernels import (
    DirectionKernel,
    ScanKernel,
    StoreyKernel,
    directions,
    levels,
)
from vislam2tag.positioning.scans.held_out import folds
from vislam2tag.positioning.scans.learning_data import LearningData, learning_data
from vislam2tag.positioning.scans.representation import augmented

DRAWS = range(3)
Around = Callable[[FloatArray], ScanKernel]
Folds = Callable[[int], Iterator[tuple[BoolArray, BoolArray]]]


def by_direction(level: FloatArray) -> ScanKernel:
    """Make the kernel that looks at directions of powed levels alone."""
    return DirectionKernel(directions(level), 1.0)


CHOICES: dict[str, tuple[Around, int, float, bool]] = {
    "directions": (by_direction, 0, 0.1, False),
    "directions, four augmented copies": (by_direction, 4, 1.0, False),
    "directions, contradicted scans left out": (by_direction, 0, 0.1, True),
    "directions and steps": (StoreyKernel.around, 0, 0.1, False),
    "directions and steps, contradicted scans left out": (StoreyKernel.around, 0, 0.1, True),
    "the same, four augmented copies": (StoreyKernel.around, 4, 0.3, True),
}
"""Kernel, copies, ridge, and whether contradicted scans are left out."""


def learned(data: LearningData, around: Around, copies: int, ridge: float) -> KernelRegression[ScanKernel]:
    """Regress onto storeys."""
    rng, level = np.random.default_rng(0), levels(data.scans)
    one_hot = np.eye(len(data.places.storeys))[data.places.storey]
    equations = KernelNormalEquations.empty(around(level), one_hot.mean(axis=0), len(level))
    equations.add((augmented(level, rng) if copy else level, one_hot) for copy in range(copies + 1))
    return equations.solved([ridge])[0]


def right_share(data: LearningData, choice: tuple[Around, int, float, bool], dealt: Folds) -> float:
    """Return the share of left-out scans on the right floor, over all draws."""
    around, copies, ridge, doubting = choice
    right = []
    for draw in DRAWS:
        for learn, left in dealt(draw):
            part, asked = data[learn], data[left]
            if doubting:
                part = part[~mislabelled(part.scans, part.places.storey, np.arange(len(part)))]
            function = learned(part, around, copies, ridge)
            right.append(function(levels(asked.scans)).argmax(axis=1) == asked.places.storey)
    return float(np.concatenate(right).mean())


def everything(folder: Path) -> None:
    """Print what all fingerprints of a data set tell of each that is left out."""
    data = learning_data(open_dataset(folder))
    data = data[data.scans.heard > 0]
    one_hot = np.eye(len(data.places.storeys))[data.places.storey]
    level = levels(data.scans)
    like = StoreyKernel.around(level).among_centres()
    inverse = np.linalg.inv(like + 0.1 * np.eye(len(level)))
    told = one_hot - inverse @ (one_hot - one_hot.mean(axis=0)) / np.diag(inverse)[:, None]
    right = told.argmax(axis=1) == data.places.storey
    doubted = mislabelled(data.scans, data.places.storey, np.arange(len(data)))
    print(f"{len(data)} fingerprints: {100 * right.mean():.1f} % on the right floor by all others")
    print(f"contradicted by all others: {100 * doubted.mean():.1f} %")


def main() -> None:
    """Print a line for each choice as it comes."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("dataset", type=Path)
    parser.add_argument("--split", default="official")
    parser.add_argument("--everything", action="store_true")
    arguments = parser.parse_args()
    if arguments.everything:
        everything(arguments.dataset)
        return
    data = training_part(arguments.dataset, arguments.split)
    phone = np.unique(data.scans.device, return_inverse=True)[1]
    for name, choice in CHOICES.items():
        scans = right_share(data, choice, lambda draw: folds(np.arange(len(data)), 10, draw))
        phones = right_share(data, choice, lambda draw: folds(phone, 6, draw))
        print(f"{name}: {100 * scans:.1f} % (scans left out), {100 * phones:.1f} % (phones)", flush=True)


if __name__ == "__main__":
    main()
