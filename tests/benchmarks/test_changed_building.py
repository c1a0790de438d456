"""The changed building: what is said to have changed has, and all else has not."""

from __future__ import annotations

import numpy as np
import polars as pl
from changed_building import Changes, two_surveys

from vislam2tag.datasets.schema import READINGS


def heard(readings: pl.LazyFrame) -> set[str]:
    return set(readings.select("bssid").unique().collect()["bssid"])


def test_changes_are_in_the_surveys() -> None:
    changes = Changes(removed=(0,), moved=(1,), added=(2,))
    surveys = two_surveys(0, changes, minutes=0.5, base_walks=1, later_walks=1)
    before, after = (heard(dataset.tables[READINGS]) for dataset in (surveys.base, surveys.later))
    (removed,), (moved,), (added,) = surveys.removed, surveys.moved, surveys.added
    assert removed not in after
    assert added not in before
    places = [
        dict(zip(waves.building.ap_bssid, waves.ap_position.tolist(), strict=True))
        for waves in (surveys.before, surveys.after)
    ]
    assert np.linalg.norm(np.subtract(places[0][moved], places[1][f"moved {moved}"])) > 15
    same = places[0].keys() & places[1].keys()
    assert len(same) == 28 - 3
    assert all(places[0][name] == places[1][name] for name in same)
    assert surveys.base.fingerprints.collect()["session"].n_unique() == 4
