"""Leakage of a split: the distance in place and time from each test fingerprint to the training set.

See docs/reference/splits.md.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import polars as pl
from scipy.spatial import cKDTree

from vislam2tag.common.records import Record
from vislam2tag.datasets.model import Dataset, Fold, Split
from vislam2tag.datasets.splits import IMU, kind_order, split_items

NEAR_M, NEAR_S = 1.0, 5.0
"""Distance and time below which a test fingerprint almost has a twin in the training set."""
QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)
NEW_PLACE_M = 5.0
"""Above this median distance a split tests new places: about twice the error of Wi-Fi fingerprinting."""
ALL_FOLDS = "all"
"""Name of the combined test sets of several folds."""
_FLOOR = ("building", "floor")
_ELSE = {"device": "with another phone", "day": "on another day"}
_MOST = 0.5


class QuantileSummary(Record):
    """Quantiles of the distance or time from each test fingerprint to the nearest training one."""

    p05: float
    p25: float
    p50: float
    p75: float
    p95: float


class FoldLeakage(Record):
    """One fold, for one kind of fingerprint or window. Shares are of the test fingerprints."""

    fold: str
    of: str
    """``wifi``, ``ble``, ``magnetic`` or ``imu``; each is compared only with its own kind."""
    train: int
    """Size of the training set (mean over folds for the combined ones)."""
    test: int
    distance_m: QuantileSummary | None
    """Distance to the nearest on the same floor; None if no test floor is in the training set."""
    within_1_m: float
    new_floor: float
    """Share on floors that are not in the training set."""
    time_s: QuantileSummary | None
    """Time to the nearest of the same walk (of the same device if times are Unix times); None if there are none."""
    within_5_s: float
    same_walk: float
    """Share from walks that are also in the training set."""
    test_walks: int
    test_walks_training: int


class SplitLeakage(Record):
    """A split's leakage: each fold and, if there are several, all combined; ``verdict`` puts it into words."""

    name: str
    kind: str
    parameters: dict[str, float | int | str]
    verdict: str
    folds: tuple[FoldLeakage, ...]


def leakage(dataset: Dataset, splits: Mapping[str, Split]) -> tuple[SplitLeakage, ...]:
    """Measure the leakage of each split."""
    items = split_items(dataset)
    time_key = {"boot": "session", "unix": "device"}.get(dataset.info.clock)
    return tuple(_of_split(items, split, time_key) for split in splits.values())


def _of_split(items: pl.DataFrame, split: Split, time_key: str | None) -> SplitLeakage:
    grouped = items.join(split.groups.drop_nulls("group"), on="id", how="inner")
    folds: list[FoldLeakage] = []
    for kind in kind_order(grouped["kind"]):
        rows = grouped.filter(pl.col("kind") == kind)
        tested = [(fold.name, *_tested(rows, fold, time_key)) for fold in split.info.folds]
        tested = [part for part in tested if part[2].height]
        folds += [_figures(name, kind, train, test) for name, train, test in tested]
        if len(tested) > 1:
            mean_train = round(sum(train for _, train, _ in tested) / len(tested))
            folds.append(_figures(ALL_FOLDS, kind, mean_train, pl.concat(test for _, _, test in tested)))
    info = split.info
    verdict = _verdict(info.kind, _whole(folds))
    return SplitLeakage(name=info.name, kind=info.kind, parameters=info.parameters, verdict=verdict, folds=tuple(folds))


def _whole(folds: Sequence[FoldLeakage]) -> FoldLeakage | None:
    """Return all folds combined, of the leading kind; None if the test set is empty."""
    together = [fold for fold in folds if fold.of == folds[0].of and fold.fold == ALL_FOLDS]
    return next(iter(together or folds), None)


def _tested(rows: pl.DataFrame, fold: Fold, time_key: str | None) -> tuple[int, pl.DataFrame]:
    """Return the size of the training set, and the test set: ``distance_m``, ``wait_s`` (null: none), ``trains``."""
    tests = pl.col("group").is_in(fold.test)
    train = rows.filter(~tests)
    floors = [_with_distance(train, part) for part in rows.filter(tests).partition_by(_FLOOR)]
    test = pl.concat(floors) if floors else _with_distance(train, rows.clear())
    walks = train["session"].unique().drop_nulls().implode()
    test = test.with_columns(trains=pl.col("session").is_in(walks).fill_null(False))
    return train.height, _with_wait(train, test, time_key).select("session", "distance_m", "wait_s", "trains")


def _with_distance(train: pl.DataFrame, test: pl.DataFrame) -> pl.DataFrame:
    """Add ``distance_m``, from each of ``test``, all on one floor, to the nearest of ``train`` there; null if none."""
    there = train.join(test.select(_FLOOR).unique(), on=_FLOOR, how="semi").select("x", "y").drop_nulls()
    place = test.select("x", "y").cast(pl.Float64).fill_null(float("nan")).to_numpy()
    distance = np.full(len(place), np.nan)
    known = np.isfinite(place).all(axis=1)
    if there.height and known.any():
        distance[known] = cKDTree(there.to_numpy()).query(place[known])[0]
    return test.with_columns(pl.Series("distance_m", distance, nan_to_null=True))


def _with_wait(train: pl.DataFrame, test: pl.DataFrame, time_key: str | None) -> pl.DataFrame:
    """Add ``wait_s``, the time to the nearest of ``train`` with the same key."""
    if time_key is None:
        return test.with_columns(wait_s=pl.lit(None, pl.Float64))
    near = train.select(time_key, "time_ns", near_ns="time_ns").drop_nulls().sort("time_ns")
    found = test.sort("time_ns").join_asof(near, on="time_ns", by=time_key, strategy="nearest", check_sortedness=False)
    return found.with_columns(wait_s=(pl.col("time_ns") - pl.col("near_ns")).abs() / 1e9)


def _figures(fold: str, kind: str, train: int, test: pl.DataFrame) -> FoldLeakage:
    walks = test.select("session", "trains").drop_nulls("session").unique()
    return FoldLeakage(
        fold=fold,
        of=kind,
        train=train,
        test=test.height,
        distance_m=_spread(test["distance_m"]),
        within_1_m=_share(test["distance_m"] <= NEAR_M),
        new_floor=_share(test["distance_m"].is_null()),
        time_s=_spread(test["wait_s"]),
        within_5_s=_share(test["wait_s"] <= NEAR_S),
        same_walk=_share(test["trains"]),
        test_walks=walks["session"].n_unique(),
        test_walks_training=walks.filter("trains")["session"].n_unique(),
    )


def _share(mask: pl.Series) -> float:
    return round(int(mask.sum()) / len(mask), 4)


def _spread(values: pl.Series) -> QuantileSummary | None:
    known = values.drop_nulls().to_numpy()
    if len(known) == 0:
        return None
    p05, p25, p50, p75, p95 = (round(float(value), 3) for value in np.quantile(known, QUANTILES))
    return QuantileSummary(p05=p05, p25=p25, p50=p50, p75=p75, p95=p95)


def _verdict(kind: str, whole: FoldLeakage | None) -> str:
    """Describe in a sentence what a split of this kind measures."""
    if whole is None:
        return "the test set is empty"
    what = "windows" if whole.of == IMU else "fingerprints"
    if whole.distance_m is None:
        return f"no floor of the test {what} is in the training set: measures new floors"
    where = f"half of the test {what} are within {whole.distance_m.p50:.1f} m of a training one"
    walks = f"{100 * whole.same_walk:.0f} % are from walks that are also in the training set"
    if whole.distance_m.p50 > NEW_PLACE_M:
        measures = "new places"
    elif whole.same_walk > _MOST:
        measures = "interpolation along walks, not generalisation"
    else:
        measures = f"the same places {_ELSE.get(kind, 'on another walk')}"
    return f"{where}, {walks}: measures {measures}"
