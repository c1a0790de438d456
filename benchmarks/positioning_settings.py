"""How models' parameters were chosen: cross-validation over walks, on what trains in a split, never on its test part.

    python benchmarks/positioning_settings.py fingerprints --split official weighted-knn:k=3 weighted-knn:k=5,exponent=2

Prints for each choice the mean error in the plane and the share on the right floor over all folds.
"""

from __future__ import annotations

import argparse
import re
from pathlib import Path

import numpy as np

from vislam2tag.cli.options import parameters_of
from vislam2tag.dataset.folder import open_dataset
from vislam2tag.positioning.metrics import plane_error_m
from vislam2tag.positioning.registry import model_named
from vislam2tag.positioning.scans.held_out import folds, walk_numbers
from vislam2tag.positioning.scans.learning_data import LearningData, learning_data

FOLDS = 5
SEED = 1


def training_part(folder: Path, split_name: str) -> LearningData:
    """Read what trains in the first fold of a split, of it what hears anything."""
    dataset = open_dataset(folder)
    split = dataset.splits[split_name]
    learned, _ = learning_data(dataset).train_test(split, split.info.folds[0])
    return learned[learned.scans.heard > 0]


def cross_validated(data: LearningData, choice: str) -> tuple[float, float]:
    """Return the mean error in metres and the share on the right floor of scans whose walk was left out."""
    name, _, texts = choice.partition(":")
    parameters = parameters_of(re.split(r",(?=\w+=)", texts) if texts else ())
    error_m, right = np.full(len(data), np.nan), np.zeros(len(data), dtype=np.bool_)
    for learned, left_out in folds(walk_numbers(data.scans, data.places), FOLDS, SEED):
        asked = data[left_out]
        model = model_named(name, **parameters)
        model.fit(data[learned].scans, data[learned].places, validation=(asked.scans, asked.places))
        found = model.predict(asked.scans)
        error_m[left_out], right[left_out] = plane_error_m(found, asked.places), found.storey == asked.places.storey
    return float(np.nanmean(error_m)), float(right.mean())


def main() -> None:
    """Print a line for each choice as it comes."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("dataset", type=Path)
    parser.add_argument("--split", required=True)
    parser.add_argument("choices", nargs="+", metavar="MODEL[:PARAMETER=VALUE,...]")
    arguments = parser.parse_args()
    data = training_part(arguments.dataset, arguments.split)
    print(f"{len(data)} fingerprints train; {FOLDS} folds over walks")
    for choice in arguments.choices:
        error_m, share = cross_validated(data, choice)
        print(f"{choice}: {error_m:.2f} m, {100 * share:.1f} % on the right floor", flush=True)


if __name__ == "__main__":
    main()
