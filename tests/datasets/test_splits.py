"""Splits of every kind: what is drawn, dealt and held out, and blocks with their guard rings."""

from __future__ import annotations

import datetime as dt
from dataclasses import replace

import numpy as np
import polars as pl
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.datasets.factory import DEVICES, FIRST_NS, SCANS, SESSION_KEYS, small_dataset
from vislam2tag.common.errors import UsageError
from vislam2tag.datasets import splits
from vislam2tag.datasets.model import Dataset, Split
from vislam2tag.datasets.schema import FINGERPRINTS, IMU_WINDOWS, MAGNETIC, empty_table, in_schema
from vislam2tag.datasets.settings import SplitKind, SplitSettings

SMALL = small_dataset()
SESSION = SESSION_KEYS[1][2]


def test_what_each_kind_is_split_by() -> None:
    imu = pl.DataFrame(
        {
            "window_id": ["w/imu/0"],
            "floor": [0],
            "x_start": [1.0],
            "x_end": [2.0],
            "y_start": [4.0],
            "y_end": [8.0],
            "device": ["Pixel"],
            "session": [SESSION],
            "start_ns": [7],
        }
    )
    magnetic = pl.DataFrame(
        {"window_id": ["w/magnetic/0"], "building": ["A"], "floor": [1], "x": [3.0], "start_ns": [4], "end_ns": [10]}
    )
    tables = {IMU_WINDOWS: in_schema(IMU_WINDOWS, imu).lazy(), MAGNETIC: in_schema(MAGNETIC, magnetic).lazy()}
    items = splits.split_items(replace(SMALL, tables={**SMALL.tables, **tables}))
    assert tuple(items.columns) == splits.COLUMNS
    rows = {row["id"]: row for row in items.iter_rows(named=True)}
    day = dt.date(2026, 3, 2)
    assert tuple(rows["w/imu/0"].values()) == ("w/imu/0", "imu", "", 0, 1.5, 6.0, "Pixel", SESSION, day, 7, True)
    assert tuple(rows["w/magnetic/0"].values())[1:] == ("magnetic", "A", 1, 3.0, None, None, None, None, 7, False)
    first = rows[f"{SESSION}/wifi/000000"]
    assert first["time_ns"] == FIRST_NS + 750_000_000
    assert (first["kind"], first["date"], first["labelled"]) == ("wifi", day, True)
    assert not rows[f"{SESSION}/wifi/000011"]["labelled"]


def test_wifi_leads_and_windows_come_last() -> None:
    kinds = pl.Series(["imu", "magnetic", "ble", "wifi", "uwb", "ble"])
    assert splits.kind_order(kinds) == ["wifi", "ble", "uwb", "magnetic", "imu"]


LABELLED = len(SESSION_KEYS) * (SCANS - 1)


def with_fingerprints(dataset: Dataset, keep: pl.Expr | None = None, **changes: pl.Expr) -> Dataset:
    table = dataset.fingerprints.filter(pl.lit(True) if keep is None else keep).with_columns(**changes)
    return replace(dataset, tables={**dataset.tables, FINGERPRINTS: in_schema(FINGERPRINTS, table.collect()).lazy()})


def with_windows(dataset: Dataset) -> Dataset:
    """Add an IMU window a second and a magnetic one every two seconds of each walk, and BLE beside each scan."""
    scans = dataset.fingerprints.collect()
    every = pl.concat(
        scans.with_columns(start_ns=pl.col("start_ns") + second * 1_000_000_000, second=pl.lit(second))
        for second in range(3)
    ).sort("session", "start_ns")
    number = pl.int_range(pl.len()).over("session").cast(pl.String).str.zfill(6)
    imu = every.filter(pl.col("x").is_not_null()).select(
        "building",
        "floor",
        "device",
        "session",
        "start_ns",
        window_id=pl.col("session") + "/imu/" + number,
        x_start="x",
        y_start="y",
        x_end="x",
        y_end="y",
    )
    magnetic = every.filter(second=1).select(
        *("building", "floor", "x", "y", "device", "session", "start_ns"),
        end_ns=pl.col("start_ns") + 2_000_000_000,
        window_id=pl.col("session") + "/magnetic/" + number,
    )
    ble = scans.with_columns(pl.col("scan_id").str.replace("/wifi/", "/ble/"), technology=pl.lit("ble"))
    tables = {
        **dataset.tables,
        FINGERPRINTS: pl.concat([scans, ble]).lazy(),
        IMU_WINDOWS: in_schema(IMU_WINDOWS, imu).lazy(),
        MAGNETIC: in_schema(MAGNETIC, magnetic).lazy(),
    }
    return replace(dataset, tables=tables)


def group_of(split: Split) -> dict[str, str | None]:
    return dict(split.groups.iter_rows())


@pytest.mark.parametrize("dataset", [SMALL, with_windows(SMALL)], ids=["wifi", "all kinds"])
def test_parts_are_disjoint_and_hold_every_label(dataset: Dataset) -> None:
    items = splits.split_items(dataset)
    labelled = set(items.filter("labelled")["id"])
    made = splits.standard_splits(dataset)
    assert list(made) == ["random", "device", "trajectory", "day", "block", "floor"]
    for split in made.values():
        assert split.groups["id"].to_list() == sorted(items["id"])
        for fold in split.info.folds:
            train, test = (set(part) for part in split.train_test_ids(fold))
            assert train
            assert test
            assert not train & test
            assert train | test == labelled


@pytest.mark.parametrize("kind", ["device", "trajectory", "day", "floor"])
def test_each_label_is_tested_once_where_all_folds_take_turns(kind: str) -> None:
    split = splits.standard_splits(SMALL)[kind]
    tested = [name for fold in split.info.folds for name in split.train_test_ids(fold)[1]]
    assert len(tested) == len(set(tested)) == LABELLED


def test_all_that_a_moment_holds_is_in_the_same_part_of_a_random_split() -> None:
    split = group_of(splits.standard_splits(with_windows(SMALL))["random"])
    for _, _, session in SESSION_KEYS:
        for scan in range(SCANS - 1):
            wifi = split[f"{session}/wifi/{scan:06d}"]
            assert split[f"{session}/ble/{scan:06d}"] == wifi
            # The middle of a scan is 0.75 s after its start: windows that start 0, 1 and 2 s after it are nearest.
            assert {split[f"{session}/imu/{3 * scan + second:06d}"] for second in range(3)} == {wifi}


def test_what_has_no_time_is_drawn_itself() -> None:
    dataset = with_fingerprints(with_windows(SMALL), start_ns=pl.lit(None))
    split = splits.make_split(dataset, SplitKind.RANDOM, SplitSettings())
    groups = split.groups.filter(pl.col("id").str.contains("/ble/"))["group"].drop_nulls()
    assert groups.len() == LABELLED
    assert (groups == "test").sum() == 4 * round(0.3 * (SCANS - 1))


def test_what_follows_none_with_a_time_is_drawn_itself() -> None:
    dataset = with_windows(SMALL)
    unknown = pl.when(pl.col("technology") == "ble").then("start_ns")
    split = group_of(splits.make_split(with_fingerprints(dataset, start_ns=unknown), SplitKind.RANDOM, SplitSettings()))
    assert sum(group is not None for group in split.values()) == splits.split_items(dataset)["labelled"].sum()


def test_a_walk_without_wifi_is_split_by_what_it_has() -> None:
    dataset = with_windows(SMALL)
    only = with_fingerprints(dataset, keep=pl.col("technology") == "ble")
    split = splits.make_split(only, SplitKind.RANDOM, SplitSettings())
    groups = split.groups.filter(pl.col("id").str.contains("/ble/"))["group"].drop_nulls()
    assert (groups == "test").sum() == 4 * round(0.3 * (SCANS - 1))


def test_trajectories_are_whole_and_each_floor_is_spread_over_the_folds() -> None:
    split = splits.make_split(SMALL, SplitKind.TRAJECTORY, SplitSettings(folds=2))
    assert [fold.name for fold in split.info.folds] == ["test_1", "test_2"]
    for fold in split.info.folds:
        assert sorted(name.split(".")[0] for name in fold.test) == ["floor_0", "floor_1"]


def test_a_guard_of_many_blocks_is_refused_before_it_looks_at_each() -> None:
    with pytest.raises(UsageError, match="is wider than 20 blocks of 9 m; choose larger"):
        splits.make_split(SMALL, SplitKind.BLOCK, SplitSettings(block_m=9.0, guard_m=1e6))


def test_blocks_and_their_guard() -> None:
    plain, guarded = (
        splits.make_split(SMALL, SplitKind.BLOCK, SplitSettings(block_m=9.0, guard_m=guard_m, seed=2))
        for guard_m in (0, 3.5)
    )
    assert plain.info.folds == guarded.info.folds
    old, new = group_of(plain), group_of(guarded)
    lost = [name for name in old if old[name] != new[name]]
    tests = set(plain.info.folds[0].test)
    assert lost
    assert all(new[name] is None and old[name] not in tests for name in lost)


@pytest.mark.parametrize("kind", list(SplitKind))
def test_the_order_of_rows_does_not_matter(kind: SplitKind) -> None:
    table = SMALL.fingerprints.collect().reverse().lazy()
    turned = replace(SMALL, tables={**SMALL.tables, FINGERPRINTS: table})
    first, second = (splits.make_split(dataset, kind, SplitSettings()) for dataset in (SMALL, turned))
    assert first.info == second.info
    assert first.groups.equals(second.groups)


@given(st.sets(st.integers(0, LABELLED - 1), max_size=6), st.integers(0, 3))
@settings(max_examples=15)
def test_further_fingerprints_move_no_walk_and_at_most_one_other_each(added: set[int], seed: int) -> None:
    known = SMALL.fingerprints.filter(pl.col("x").is_not_null()).collect()
    names = known["scan_id"].gather(sorted(added))
    fewer = with_fingerprints(SMALL, keep=~pl.col("scan_id").is_in(names.implode()))
    for kind in (SplitKind.RANDOM, SplitKind.TRAJECTORY, SplitKind.DEVICE, SplitKind.FLOOR):
        old, new = (group_of(splits.make_split(dataset, kind, SplitSettings(seed=seed))) for dataset in (fewer, SMALL))
        moved = sum(old[name] != new[name] for name in old)
        assert moved <= (len(added) if kind is SplitKind.RANDOM else 0)


def test_a_new_phone_changes_no_draw_of_the_others() -> None:
    one = with_fingerprints(SMALL, keep=pl.col("device") == DEVICES[0])
    few, all_ = (group_of(splits.make_split(dataset, SplitKind.RANDOM, SplitSettings())) for dataset in (one, SMALL))
    assert few.items() <= all_.items()


def test_kinds_that_cannot_be_made_are_told() -> None:
    one = with_fingerprints(SMALL, keep=(pl.col("device") == DEVICES[0]) & (pl.col("floor") == 0), date=pl.lit(None))
    assert set(splits.standard_splits(one)) == {"random", "block"}
    told = {finding.message.split(":")[0]: finding for finding in splits.split_findings(one)}
    assert set(told) == {"split by device", "split by trajectory", "split by day", "split by floor"}
    assert {finding.kind for finding in told.values()} == {"no_split"}
    assert "there is no day" in told["split by day"].message
    with pytest.raises(UsageError, match="--by device: there is only one device"):
        splits.make_split(one, SplitKind.DEVICE, SplitSettings())
    assert splits.standard_splits(with_fingerprints(SMALL, keep=pl.lit(False))) == {}


def test_labels_without_a_date_are_counted() -> None:
    of_floor = pl.lit(dt.date(2026, 1, 2)) + pl.duration(days="floor")
    dataset = with_fingerprints(SMALL, date=pl.when(pl.col("session") != SESSION_KEYS[0][2]).then(of_floor))
    (finding,) = splits.split_findings(dataset)
    assert (finding.kind, finding.count) == ("not_in_split", SCANS - 1)
    assert "split by day" in finding.message
    assert splits.standard_splits(dataset)["day"].groups["group"].null_count() == (SCANS - 1) + len(SESSION_KEYS)


def test_uncertain_fingerprints_are_in_neither_part() -> None:
    first = pl.col("scan_id") == SMALL.fingerprints.collect()["scan_id"][0]
    dataset = with_fingerprints(SMALL, status=pl.when(first).then(pl.lit("uncertain")).otherwise("status"))
    for split in splits.standard_splits(dataset).values():
        assert split.groups["group"].null_count() == len(SESSION_KEYS) + 1


@st.composite
def any_dataset(draw: st.DrawFn) -> Dataset:
    """Fingerprints of two buildings, in which anything but the id may be unknown."""
    rows = draw(
        st.lists(
            st.fixed_dictionaries(
                {
                    "technology": st.sampled_from(["wifi", "ble"]),
                    "building": st.sampled_from(["", "A", "B"]),
                    "floor": st.sampled_from([-1, 0, 1, None]),
                    "x": st.one_of(st.none(), st.floats(-30, 30)),
                    "y": st.floats(-30, 30),
                    "device": st.sampled_from(["p", "q", None]),
                    "session": st.sampled_from(["s", "t", "u", None]),
                    "date": st.sampled_from([dt.date(2026, 1, 1), dt.date(2026, 1, 2), None]),
                    "start_ns": st.one_of(st.none(), st.integers(0, 10**12)),
                    "status": st.sampled_from(["ok", "uncertain"]),
                }
            ),
            max_size=40,
        )
    )
    table = pl.DataFrame(
        [{"scan_id": f"{number:03d}", **row} for number, row in enumerate(rows)], infer_schema_length=None
    )
    tables = {
        **SMALL.tables,
        FINGERPRINTS: in_schema(FINGERPRINTS, table if rows else empty_table(FINGERPRINTS)).lazy(),
    }
    return replace(SMALL, tables=tables)


@given(any_dataset(), st.integers(0, 3), st.sampled_from((0.2, 0.3, 0.6)))
@settings(max_examples=60)
def test_whatever_is_unknown_parts_are_disjoint_and_whole(dataset: Dataset, seed: int, share: float) -> None:
    rows = dataset.fingerprints.collect()
    sure = rows.filter(pl.col("status") == "ok", pl.all_horizontal(pl.col("x", "floor").is_not_null()))
    keys = {SplitKind.DEVICE: "device", SplitKind.TRAJECTORY: "session", SplitKind.DAY: "date"}
    for kind in SplitKind:
        try:
            split = splits.make_split(dataset, kind, SplitSettings(seed=seed, share=share, guard_m=0))
        except UsageError:
            continue
        expected = set(sure.drop_nulls(keys[kind])["scan_id"] if kind in keys else sure["scan_id"])
        for fold in split.info.folds:
            train, test = split.train_test_ids(fold)
            assert set(train) | set(test) == expected
            assert len(train) + len(test) == len(expected)
    drawn_alone = sure.filter(pl.col("technology") == "wifi")
    if sure["technology"].n_unique() == 1 and drawn_alone.height:
        try:
            groups = group_of(splits.make_split(dataset, SplitKind.RANDOM, SplitSettings(seed=seed, share=share)))
        except UsageError:
            return
        for _, stratum in drawn_alone.group_by("building", "floor", "device"):
            tested = sum(groups[name] == "test" for name in stratum["scan_id"])
            assert tested == int(share * stratum.height + 0.5)


METRES = st.floats(-40, 40, allow_nan=False)


def items_of(points: list[tuple[int, float, float]]) -> pl.DataFrame:
    return pl.DataFrame(
        points, schema={"floor": pl.Int32, "x": pl.Float64, "y": pl.Float64}, orient="row"
    ).with_columns(building=pl.lit(""))


@given(st.lists(st.tuples(st.integers(0, 1), METRES, METRES), max_size=30), st.floats(1, 15))
def test_each_point_lies_in_its_block(points: list[tuple[int, float, float]], side_m: float) -> None:
    found = splits.block_of(items_of(points), side_m)
    for axis, index in (("x", "column"), ("y", "line")):
        low = found[index] * side_m
        assert (found[axis] >= low - 1e-9).all()
        assert (found[axis] <= low + side_m + 1e-9).all()


@pytest.mark.parametrize(
    ("side_m", "guard_m"), [(2.0, 0.5), (2.0, 9.0), (5.0, 0.0), (5.0, 3.0), (10.0, 3.0), (10.0, 15.0)]
)
def test_the_ring_against_brute_force(side_m: float, guard_m: float) -> None:
    places = np.random.default_rng(3).uniform(-25, 25, (120, 2)).round(1)
    items = splits.block_of(items_of([(index % 2, x, y) for index, (x, y) in enumerate(places.tolist())]), side_m)
    blocks = items.head(12).select("building", "floor", "column", "line").unique()
    found = splits.near_blocks(items, blocks, side_m, guard_m)
    expected = []
    for row in items.iter_rows(named=True):
        distances = [
            np.hypot(
                max(block["column"] * side_m - row["x"], 0, row["x"] - (block["column"] + 1) * side_m),
                max(block["line"] * side_m - row["y"], 0, row["y"] - (block["line"] + 1) * side_m),
            )
            for block in blocks.filter(floor=row["floor"]).iter_rows(named=True)
        ]
        expected.append(any(distance < guard_m for distance in distances))
    assert found.to_list() == expected
    assert (guard_m == 0) == (sum(expected) == 0)


NAMES = st.lists(st.text("abcdef/0123", min_size=1, max_size=6), unique=True, max_size=40)


def table_of(names: list[str]) -> pl.DataFrame:
    stratum = [len(name) % 3 for name in names]
    return pl.DataFrame({"id": names, "stratum": stratum}, schema={"id": pl.String, "stratum": pl.Int64})


def test_the_order_is_sha_256_of_seed_and_name() -> None:
    known = "681ebd31f1942012739312a095442ff5c473d0896902e122a989b3b7f9fadc9f"  # printf 7/a | sha256sum
    assert splits.draw_order(pl.Series(["a"]), 7)[0] == known


@given(NAMES, st.sampled_from((0.1, 0.3, 0.5, 0.77)), st.integers(0, 5))
def test_shares_are_exact_in_each_stratum(names: list[str], share: float, seed: int) -> None:
    table = table_of(names)
    found = table.with_columns(splits.stratified_sample(table, "id", ("stratum",), share, seed))
    for _, rows in found.group_by("stratum"):
        assert rows["drawn"].sum() == int(share * rows.height + 0.5)


@given(NAMES, st.integers(1, 6), st.integers(0, 5))
def test_hands_are_as_equal_as_can_be_over_all_and_in_each_stratum(names: list[str], hands: int, seed: int) -> None:
    table = table_of(names)
    found = table.with_columns(hand=splits.stratified_folds(table, "id", ("stratum",), hands, seed))
    for rows in (found, *(rows for _, rows in found.group_by("stratum"))):
        counts = [rows.filter(pl.col("hand") == hand).height for hand in range(hands)]
        assert sum(counts) == rows.height
        assert max(counts) - min(counts) <= 1


def test_another_seed_draws_others() -> None:
    table = table_of([f"scan {index:03d}" for index in range(60)])
    first, second = (splits.stratified_sample(table, "id", ("stratum",), 0.3, seed) for seed in (0, 1))
    assert first.sum() == second.sum()
    assert (first != second).any()
