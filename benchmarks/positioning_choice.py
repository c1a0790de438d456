"""Whether the model that ``train`` chooses is as good as the best single one, on scans that neither learned nor chose.

    python benchmarks/positioning_choice.py tampere --split official --by session device random --kept choice.jsonl
    python benchmarks/positioning_choice.py uji-library --by month last-month random --models weighted-knn local-kriging

What is left out is as in ``positioning_change.py``, the first fold of it (``--seed`` deals others). At most ``--most``
scans, evenly spread, are learned, and half as many asked. The choice is made by cross-validation in the part that is
learned, then each candidate learns all of it. Compared is what the choice compares: the mean error in the plane and
15 m for each wrong floor. What ``--kept`` holds of the same scans and candidates is not measured again, so that a
campaign can be stopped and go on.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

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


class Row(NamedTuple):
    """One way to split a data set."""

    dataset: str
    by: str
    most: int
    seed: int
    """Of the folds."""
    cost_m: dict[str, float]
    """Of each candidate."""
    chosen: str
    chosen_m: float

    def line(self) -> str:
        """A row of the table."""
        ratio = self.chosen_m / min(self.cost_m.values()) - 1
        costs = " | ".join(f"{self.cost_m[name]:.2f} m" if name in self.cost_m else "" for name in CANDIDATES)
        return f"| {self.dataset} | {self.by} | {costs} | {self.chosen}: {self.chosen_m:.2f} m | {100 * ratio:+.1f} % |"


def main() -> None:
    """Print a line for each way to split."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("dataset", type=Path)
    parser.add_argument("--split", help="look at the training part of this split alone")
    parser.add_argument("--by", nargs="+", default=("session", "random"))
    parser.add_argument("--folds", type=int, default=4)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--most", type=int, default=2000)
    parser.add_argument("--models", nargs="+", default=CANDIDATES)
    parser.add_argument("--kept", type=Path, help="JSON lines of what was measured; further ones are added")
    arguments = parser.parse_args()
    lines = arguments.kept.read_text().splitlines() if arguments.kept and arguments.kept.is_file() else []
    kept = [Row(**json.loads(line)) for line in lines]
    dataset = open_dataset(arguments.dataset)
    data = learning_data(dataset)
    if arguments.split:
        split = dataset.splits[arguments.split]
        data, _ = data.train_test(split, split.info.folds[0])
    print(f"| set | left out | {' | '.join(CANDIDATES)} | chosen | to the best single |\n| --- | --- |" + " ---: |" * 6)
    for by in arguments.by:
        wanted = (arguments.dataset.name, by, arguments.most, arguments.seed)
        row = next((one for one in kept if one[:4] == wanted and {*one.cost_m} == {*arguments.models}), None)
        if row is None:
            learn, held_out = next(masks_of(dataset, data, by, arguments.folds, arguments.seed))
            learned, asked = some(data, learn, arguments.most), some(data, held_out, arguments.most // 2)
            row = Row(*wanted, *compared(learned, asked, arguments.models))
            if arguments.kept:
                with arguments.kept.open("a") as stream:
                    stream.write(json.dumps(row._asdict()) + "\n")
        print(row.line(), flush=True)


def some(data: LearningData, mask: BoolArray, most: int) -> LearningData:
    """Take at most so many of a mask's scans, evenly spread."""
    rows = np.flatnonzero(mask)
    return data[rows[:: -(-len(rows) // most)]]


def compared(learned: LearningData, asked: LearningData, models: Sequence[str]) -> tuple[dict[str, float], str, float]:
    """Return the costs of the candidates, metres, the choice, and its cost."""
    chosen = tried_models((learned.scans, learned.places), NO_LIMIT_S, candidates=models).chosen
    found = {name: model_named(name).fit(learned.scans, learned.places).predict(asked.scans) for name in models}
    own_m = cost(mean_positions([found[name] for name in chosen.models]), asked)
    return {name: cost(one, asked) for name, one in found.items()}, " and ".join(chosen.models), own_m


def cost(found: Positions, asked: LearningData) -> float:
    """Mean error in the plane, metres, and 15 m for each wrong floor, of the scans that are known."""
    known, places = found.known, asked.places.over(found.storeys)
    wrong = found.storey != places.storey
    return float((plane_error_m(found, places) + FLOOR_PENALTY_M * wrong)[known].mean())


if __name__ == "__main__":
    main()
