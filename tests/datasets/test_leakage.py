from __future__ import annotations

from dataclasses import replace

import numpy as np
import polars as pl
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.datasets.factory import SCANS, SESSION_KEYS, small_dataset
from tests.datasets.test_splits import with_fingerprints, with_windows
from vislam2tag.datasets.leakage import ALL_FOLDS, FoldLeakage, SplitLeakage, leakage
from vislam2tag.datasets.model import Dataset, Fold, Split, SplitInfo
from vislam2tag.datasets.schema import MAGNETIC
from vislam2tag.datasets.settings import SplitKind, SplitSettings
from vislam2tag.datasets.splits import make_split, standard_splits

SMALL = small_dataset()
LABELLED = len(SESSION_KEYS) * (SCANS - 1)


def found_of(dataset: Dataset, split: Split) -> SplitLeakage:
    (found,) = leakage(dataset, {split.info.name: split})
    return found


def by_hand(dataset: Dataset, groups: list[str | None]) -> Split:
    """A split with these groups, of the fingerprints in order; ``test`` tests."""
    ids = dataset.fingerprints.collect()["scan_id"]
    info = SplitInfo(name="mine", kind="official", folds=(Fold(name="f", test=("test",)),))
    return Split(info, pl.DataFrame({"id": ids, "group": pl.Series(groups, dtype=pl.String)}))


GROUPS = st.lists(st.sampled_from(["test", "train", None]), min_size=48, max_size=48)


@given(GROUPS, st.booleans())
@settings(max_examples=25)
def test_against_brute_force(groups: list[str | None], unix: bool) -> None:
    dataset = replace(SMALL, info=SMALL.info.model_copy(update={"clock": "unix" if unix else "boot"}))
    rows = dataset.fingerprints.collect().with_columns(group=pl.Series(groups, dtype=pl.String))
    train, test = (rows.filter(group=part).to_dicts() for part in ("train", "test"))
    distances, waits = [], []
    for row in test:
        there = [other for other in train if other["floor"] == row["floor"] is not None]
        near = [np.hypot(row["x"] - other["x"], row["y"] - other["y"]) for other in there]
        distances += [min(near)] if near else []
        key = "device" if unix else "session"
        wait = [abs(row["start_ns"] - other["start_ns"]) / 1e9 for other in train if other[key] == row[key]]
        waits += [min(wait)] if wait else []
    found = found_of(dataset, by_hand(dataset, groups)).folds
    if not test:
        assert found == ()
        return
    (fold,) = found
    assert (fold.train, fold.test) == (len(train), len(test))
    assert fold.new_floor == round(1 - len(distances) / len(test), 4)
    assert fold.within_1_m == round(sum(d <= 1 for d in distances) / len(test), 4)
    assert fold.within_5_s == round(sum(w <= 5 for w in waits) / len(test), 4)
    for values, spread in ((distances, fold.distance_m), (waits, fold.time_s)):
        assert (spread is None) == (not values)
        if spread is not None:
            quantiles = np.quantile(values, (0.05, 0.25, 0.5, 0.75, 0.95))
            assert np.allclose([spread.p05, spread.p25, spread.p50, spread.p75, spread.p95], quantiles, atol=6e-4)
    walks, training = ({row["session"] for row in part} for part in (test, train))
    assert (fold.test_walks, fold.test_walks_training) == (len(walks), len(walks & training))
    assert fold.same_walk == round(sum(row["session"] in training for row in test) / len(test), 4)


def whole(found: SplitLeakage) -> FoldLeakage:
    return next((fold for fold in found.folds if fold.fold == ALL_FOLDS), found.folds[0])


def test_what_each_kind_of_split_measures() -> None:
    found = {split.name: split for split in leakage(SMALL, standard_splits(SMALL))}
    assert found["random"].verdict == (
        "half of the test fingerprints are within 3.0 m of a training one, 100 % are from walks that are also in the "
        "training set: measures interpolation along walks, not generalisation"
    )
    assert found["device"].verdict.endswith("measures the same places with another phone")
    assert found["day"].verdict.endswith("measures the same places on another day")
    assert found["trajectory"].verdict.endswith("measures the same places on another walk")
    assert found["floor"].verdict.endswith("measures new floors")
    assert whole(found["floor"]).new_floor == 1
    blocks = make_split(SMALL, SplitKind.BLOCK, SplitSettings(block_m=20, guard_m=6))
    assert found_of(SMALL, blocks).verdict.endswith("measures new places")


def test_a_guard_keeps_its_distance() -> None:
    for guard_m in (3.0, 5.0):
        split = make_split(SMALL, SplitKind.BLOCK, SplitSettings(block_m=9, guard_m=guard_m))
        (fold,) = found_of(SMALL, split).folds
        assert fold.distance_m is not None
        assert fold.distance_m.p05 >= guard_m


def test_folds_are_also_counted_together() -> None:
    found = found_of(SMALL, standard_splits(SMALL)["trajectory"])
    assert [fold.fold for fold in found.folds] == ["test_1", "test_2", "test_3", "test_4", ALL_FOLDS]
    assert whole(found).test == sum(fold.test for fold in found.folds[:-1]) == LABELLED
    assert whole(found).train == LABELLED * 3 // 4


def test_like_is_compared_with_like() -> None:
    dataset = with_windows(SMALL)
    found = found_of(dataset, standard_splits(dataset)["random"])
    assert [fold.of for fold in found.folds] == ["wifi", "ble", "magnetic", "imu"]
    assert [fold.test for fold in found.folds][:2] == [12, 12]
    none = with_fingerprints(dataset, keep=pl.lit(False))
    only = replace(none, tables={name: table for name, table in none.tables.items() if name != MAGNETIC})
    assert "half of the test windows are within" in found_of(only, standard_splits(only)["device"]).verdict


@pytest.mark.parametrize("clock", ["none", "boot"])
def test_without_times_there_is_no_wait(clock: str) -> None:
    dataset = replace(SMALL, info=SMALL.info.model_copy(update={"clock": clock}))
    (fold,) = found_of(dataset, standard_splits(dataset)["random"]).folds
    assert (fold.time_s is None) == (clock == "none")
