"""Whether the model that ``train`` chooses is as good as the best single one, on scans that neither learned nor chose.

    python benchmarks/positioning_choice.py tampere --split official --by session random
    python benchmarks/positioning_choice.py wifine --by official random
    python benchmarks/positioning_choice.py uji-library --by month random
    python benchmarks/positioning_choice.py ujiindoorloc --by user random
    python benchmarks/positioning_choice.py site1-F1 --by session random

What is left out is as in ``positioning_change.py``, the first fold of it. At most ``--most`` scans, evenly spread, are
learned and asked. The choice is made by cross-validation in the part that is learned, then each candidate learns all
of it. Compared is what the choice compares: the mean error in the plane and 15 m for each wrong floor.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from positioning_change import masks_of

from vislam2tag.core.arrays import BoolArray
from vislam2tag.dataset.folder import open_dataset
from vislam2tag.positioning.metrics import FLOOR_PENALTY_M, plane_error_m
from vislam2tag.positioning.model_choice import CANDIDATES, tried_models
from vislam2tag.positioning.models.combined import mean_positions
from vislam2tag.positioning.registry import model_named
from vislam2tag.positioning.scans.learning_data import LearningData, learning_data
from vislam2tag.positioning.scans.places import Positions

NO_LIMIT_S = 1e9


def main() -> None:
    """Print a line for each way to split."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("dataset", type=Path)
    parser.add_argument("--split", help="look at the training part of this split alone")
    parser.add_argument("--by", nargs="+", default=("session", "random"))
    parser.add_argument("--folds", type=int, default=4)
    parser.add_argument("--most", type=int, default=1000)
    arguments = parser.parse_args()
    dataset = open_dataset(arguments.dataset)
    data = learning_data(dataset)
    if arguments.split:
        split = dataset.splits[arguments.split]
        data, _ = data.train_test(split, split.info.folds[0])
    print(f"| left out | {' | '.join(CANDIDATES)} | chosen | to the best single |\n| --- |" + " ---: |" * 6)
    for by in arguments.by:
        learn, held_out = next(masks_of(dataset, data, by, arguments.folds))
        print(
            f"| {by} | {compared(some(data, learn, arguments.most), some(data, held_out, arguments.most))}", flush=True
        )


def some(data: LearningData, mask: BoolArray, most: int) -> LearningData:
    """Take at most so many of a mask's scans, evenly spread."""
    rows = np.flatnonzero(mask)
    return data[rows[:: -(-len(rows) // most)]]


def compared(learned: LearningData, asked: LearningData) -> str:
    """Return a line: costs of the candidates, the choice, and its cost by the best's."""
    chosen = tried_models((learned.scans, learned.places), NO_LIMIT_S).chosen
    found = {name: model_named(name).fit(learned.scans, learned.places).predict(asked.scans) for name in CANDIDATES}
    cost_m = {name: cost(one, asked) for name, one in found.items()}
    own_m = cost(mean_positions([found[name] for name in chosen.models]), asked)
    ratio = own_m / min(cost_m.values()) - 1
    costs = " | ".join(f"{cost_m[name]:.2f} m" for name in CANDIDATES)
    return f"{costs} | {' and '.join(chosen.models)}: {own_m:.2f} m | {100 * ratio:+.1f} % |"


def cost(found: Positions, asked: LearningData) -> float:
    """Mean error in the plane, metres, and 15 m for each wrong floor, of the scans that are known."""
    known, places = found.known, asked.places.over(found.storeys)
    wrong = found.storey != places.storey
    return float((plane_error_m(found, places) + FLOOR_PENALTY_M * wrong)[known].mean())


if __name__ == "__main__":
    main()
