"""A row of the benchmark of the chosen model: its cost by the best single one's, and what is kept is taken back."""

from __future__ import annotations

import json

import numpy as np
from positioning_choice import Row, compared

from tests.positioning.radio_world import radio_world
from vislam2tag.positioning.scans.learning_data import LearningData


def world(seed: int) -> LearningData:
    scans, places = radio_world(seed=seed, walks=4)
    return LearningData(np.arange(len(scans)).astype(str), scans, places)


def test_a_row_tells_how_far_the_choice_is_from_the_best_single_model() -> None:
    row = Row("mall", "random", 2000, 0, {"weighted-knn": 4.0, "local-kriging": 5.0}, "local-kriging", 5.0)
    assert row.line() == "| mall | random | 4.00 m | 5.00 m |  |  | local-kriging: 5.00 m | +25.0 % |"
    assert Row(**json.loads(json.dumps(row._asdict()))) == row


def test_the_choice_is_one_of_the_candidates_or_two() -> None:
    cost_m, chosen, chosen_m = compared(world(1), world(2), ["knn", "weighted-knn"])
    assert set(chosen.split(" and ")) <= set(cost_m) == {"knn", "weighted-knn"}
    if chosen in cost_m:
        assert chosen_m == cost_m[chosen]
