"""Errors of models on walks, phones, users and months that they did not learn from, and on scans drawn at random.

    python benchmarks/positioning_change.py tampere --split official --by session device random
    python benchmarks/positioning_change.py ujiindoorloc --folds 4 --by user session random
    python benchmarks/positioning_change.py wifine --by official random
    python benchmarks/positioning_change.py uji-library --by month last-month random

Data sets are folders of ``vislam2tag import``; with ``--split`` only the training set is used. ``month`` learns from
the first calendar month and tests the others; ``last-month`` tests the last month and learns from those before.
``official`` is the split of that name. ``random`` leaves out tenths, until 1,500 scans were tested. ``--seed`` deals
other folds.

Prints errors, right floors and the coverage of the stated circles, for all scans and for the fifths with the smallest
and the largest circles. The scatter is half a 95 % interval of the bootstrap over walks. An asterisk marks values out
of bounds (60 to 76, 90 to 98.5, fifths 50 to 86 %), two asterisks mark intervals that are entirely out of bounds.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from itertools import islice
from pathlib import Path

import numpy as np

from vislam2tag.common.error_statistics import mean_interval
from vislam2tag.core.arrays import AnyArray, BoolArray
from vislam2tag.datasets.folder import open_dataset
from vislam2tag.datasets.model import Dataset
from vislam2tag.positioning.learning_data import LearningData, learning_data
from vislam2tag.positioning.model_scores import plane_error_m
from vislam2tag.positioning.places import folds
from vislam2tag.positioning.registry import model_named

MODELS = ("weighted-knn", "local-kriging")
MOST_ASKED = 1500
BOUNDS = ((0.6, 0.76), (0.9, 0.985), (0.5, 0.86), (0.5, 0.86))
"""Of the shares in 68 %, in 95 %, and in 68 % of the smallest and largest fifth."""
_DRAWN = 10


def main() -> None:
    """Print a line for each way to split and each model."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("dataset", type=Path)
    parser.add_argument("--split", help="look at the training part of this split alone")
    parser.add_argument("--by", nargs="+", default=("session", "random"))
    parser.add_argument("--folds", type=int, default=5)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--models", nargs="+", default=MODELS)
    arguments = parser.parse_args()
    dataset = open_dataset(arguments.dataset)
    data = learning_data(dataset)
    if arguments.split:
        split = dataset.splits[arguments.split]
        data, _ = data.train_test(split, split.info.folds[0])
    print("| left out | model | mean | median | 95th | right floor | in 68 % | in 95 % | smallest | largest |")
    print("| --- | --- |" + " ---: |" * 8)
    for by in arguments.by:
        masks = list(masks_of(dataset, data, by, arguments.folds, arguments.seed))
        for name in arguments.models:
            _tell(by, name, data, masks)


def masks_of(
    dataset: Dataset, data: LearningData, by: str, count: int, seed: int = 0
) -> Iterator[tuple[BoolArray, BoolArray]]:
    """What trains and what is held out."""
    if by in ("month", "last-month"):
        month = data.scans.time_ns.astype("datetime64[ns]").astype("datetime64[M]")
        held_out = month > month.min() if by == "month" else month == month.max()
        yield ~held_out, held_out
    elif by == "official":
        split = dataset.splits[by]
        train, test = (np.isin(data.ids, part.ids) for part in data.train_test(split, split.info.folds[0]))
        yield train, test
    elif by == "random":
        asked = max(1, len(data) // _DRAWN)
        yield from islice(folds(np.arange(len(data)), _DRAWN, seed), -(-MOST_ASKED // asked))
    else:
        yield from folds(_groups(dataset, data, by), count, seed)


def _groups(dataset: Dataset, data: LearningData, by: str) -> AnyArray:
    """(n,) names of what is left out together."""
    named = dict(dataset.fingerprints.select("scan_id", by).collect().rows())
    return np.array([named[one] or "" for one in data.ids.tolist()])


def _tell(by: str, name: str, data: LearningData, masks: list[tuple[BoolArray, BoolArray]]) -> None:
    walk_of = np.where(data.scans.session == "", data.ids, data.scans.session)
    error_m, right, radius_68_m, radius_95_m, walk = [], [], [], [], []
    for learn, held_out in masks:
        rows = np.flatnonzero(held_out)[:: max(1, int(held_out.sum()) // MOST_ASKED)]
        learned, asked = data[learn], data[rows]
        found = model_named(name).fit(learned.scans, learned.places).predict(asked.scans)
        known = found.known
        error_m.append(plane_error_m(found, asked.places)[known])
        right.append((found.storey == asked.places.storey)[known])
        radius_68_m.append(found.radius_68_m[known])
        radius_95_m.append(found.radius_95_m[known])
        walk.append(walk_of[rows][known])
    error, small, large = (np.concatenate(one) for one in (error_m, radius_68_m, radius_95_m))
    inside, order, walks = error <= small, np.argsort(small), np.concatenate(walk)
    parts = np.array_split(order, 5)
    held = [(inside, walks), (error <= large, walks), *((inside[part], walks[part]) for part in (parts[0], parts[-1]))]
    told = [told_share(*one, bounds) for one, bounds in zip(held, BOUNDS, strict=True)]
    print(
        f"| {by} | `{name}` | {error.mean():.2f} m | {np.median(error):.2f} m | {np.quantile(error, 0.95):.2f} m | "
        f"{100 * np.concatenate(right).mean():.1f} % | {' | '.join(told)} |",
        flush=True,
    )


def told_share(inside: BoolArray, walk: AnyArray, bounds: tuple[float, float]) -> str:
    """Print a share of scans (n,) of walks (n,), its half interval, and by asterisks whether it is out of bounds."""
    share, scatter = inside.mean(), mean_interval(inside.astype(np.float64), walk)
    low, high = scatter or (share, share)
    half = f" ± {(high - low) / 2:.2f}" if scatter else ""
    surely = scatter is not None and (high < bounds[0] or low > bounds[1])
    return f"{share:.2f}{half}{'' if bounds[0] <= share <= bounds[1] else ' **' if surely else ' *'}"


if __name__ == "__main__":
    main()
