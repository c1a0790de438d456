"""How models do on walks, phones, users and months that they did not learn from, and on scans drawn at random.

    python benchmarks/positioning_change.py tampere --split official --by session device random
    python benchmarks/positioning_change.py ujiindoorloc --folds 4 --by user session random
    python benchmarks/positioning_change.py uji-library --by month random

Data sets are folders that ``vislam2tag import`` made; of ``--split`` the training part alone is looked at. ``month``
learns from the first calendar month and is asked about the others. Prints errors, right floors and how many errors
the stated circles hold: of all scans, and of the fifths with the smallest and the largest circles.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from vislam2tag.core.arrays import AnyArray, BoolArray
from vislam2tag.dataset.folder import open_dataset
from vislam2tag.dataset.model import Dataset
from vislam2tag.positioning.metrics import plane_error_m
from vislam2tag.positioning.registry import model_named
from vislam2tag.positioning.scans.held_out import folds
from vislam2tag.positioning.scans.learning_data import LearningData, learning_data

MODELS = ("weighted-knn", "local-kriging")
MOST_ASKED = 1500
_DRAWN = 10


def main() -> None:
    """Print a line for each way to split and each model."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("dataset", type=Path)
    parser.add_argument("--split", help="look at the training part of this split alone")
    parser.add_argument("--by", nargs="+", default=("session", "random"))
    parser.add_argument("--folds", type=int, default=5)
    parser.add_argument("--models", nargs="+", default=MODELS)
    arguments = parser.parse_args()
    dataset = open_dataset(arguments.dataset)
    data = learning_data(dataset)
    if arguments.split:
        split = dataset.splits[arguments.split]
        data, _ = data.train_test(split, split.info.folds[0])
    print("| left out | model | mean | median | 95th | right floor | in 68 % | in 95 % | fifths of 68 % |")
    print("| --- | --- |" + " ---: |" * 7)
    for by in arguments.by:
        masks = list(_masks(dataset, data, by, arguments.folds))
        for name in arguments.models:
            _tell(by, name, data, masks)


def _masks(dataset: Dataset, data: LearningData, by: str, count: int) -> Iterator[tuple[BoolArray, BoolArray]]:
    """What trains and what is held out."""
    if by == "month":
        month = data.scans.time_ns.astype("datetime64[ns]").astype("datetime64[M]")
        yield month == month.min(), month > month.min()
        return
    if by == "random":
        yield next(folds(np.arange(len(data)), _DRAWN, 0))
        return
    yield from folds(_groups(dataset, data, by), count, 0)


def _groups(dataset: Dataset, data: LearningData, by: str) -> AnyArray:
    """(n,) names of what is left out together."""
    named = dict(dataset.fingerprints.select("scan_id", by).collect().rows())
    return np.array([named[one] or "" for one in data.ids.tolist()])


def _tell(by: str, name: str, data: LearningData, masks: list[tuple[BoolArray, BoolArray]]) -> None:
    error_m, right, radius_68_m, radius_95_m = [], [], [], []
    for learn, held_out in masks:
        rows = np.flatnonzero(held_out)[:: max(1, int(held_out.sum()) // MOST_ASKED)]
        learned, asked = data[learn], data[rows]
        found = model_named(name).fit(learned.scans, learned.places).predict(asked.scans)
        known = found.known
        error_m.append(plane_error_m(found, asked.places)[known])
        right.append((found.storey == asked.places.storey)[known])
        radius_68_m.append(found.radius_68_m[known])
        radius_95_m.append(found.radius_95_m[known])
    error, small, large = (np.concatenate(one) for one in (error_m, radius_68_m, radius_95_m))
    inside = error <= small
    fifths = np.array_split(inside[np.argsort(small)], 5)
    print(
        f"| {by} | `{name}` | {error.mean():.2f} m | {np.median(error):.2f} m | {np.quantile(error, 0.95):.2f} m | "
        f"{100 * np.concatenate(right).mean():.1f} % | {inside.mean():.2f} | {np.mean(error <= large):.2f} | "
        f"{fifths[0].mean():.2f} to {fifths[-1].mean():.2f} |",
        flush=True,
    )


if __name__ == "__main__":
    main()
