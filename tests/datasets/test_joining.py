from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import polars as pl
import pytest
from polars.testing import assert_frame_equal

from tests.datasets.factory import SESSION_KEYS, bssid, small_dataset
from vislam2tag.common.errors import DatasetError
from vislam2tag.datasets.description import Related
from vislam2tag.datasets.joining import SAME_SESSIONS, SPLITS_LEFT_OUT, join_datasets
from vislam2tag.datasets.model import Dataset, Fold, Split, SplitInfo
from vislam2tag.datasets.privacy import Privacy, with_privacy
from vislam2tag.datasets.schema import ACCESS_POINTS, FINGERPRINTS, READINGS, SCHEMAS, SESSIONS

NAMES = sorted(session for _, _, session in SESSION_KEYS)


def part(*sessions: str) -> Dataset:
    """The walks of these sessions from the small data set."""
    dataset = small_dataset()
    own = pl.col("session").is_in(list(sessions))
    scans = dataset.fingerprints.filter(own).select("scan_id")
    tables = {
        FINGERPRINTS: dataset.fingerprints.filter(own),
        READINGS: dataset.readings.join(scans, on="scan_id", how="semi", maintain_order="left"),
        SESSIONS: dataset.tables[SESSIONS].filter(own),
        ACCESS_POINTS: dataset.access_points,
    }
    return replace(dataset, tables=tables)


def with_info(dataset: Dataset, **changes: Any) -> Dataset:
    return replace(dataset, info=dataset.info.model_copy(update=changes))


def with_floor(**changes: Any) -> Dataset:
    first, *others = small_dataset().info.floors
    return with_info(small_dataset(), floors=(first.model_copy(update=changes), *others))


def without_access_points(dataset: Dataset) -> dict[str, pl.LazyFrame]:
    return {name: table for name, table in dataset.tables.items() if name != ACCESS_POINTS}


def test_the_parts_of_a_set_make_the_set_again() -> None:
    whole = small_dataset()
    joined = join_datasets(part(NAMES[1], NAMES[2]), part(NAMES[0], NAMES[3]))[0]
    for name, table in without_access_points(whole).items():
        expected = table.collect()
        order = "session" if "session" in expected.columns else "scan_id"
        assert_frame_equal(joined.tables[name].collect(), expected.sort(order, maintain_order=True))
        assert joined.tables[name].collect_schema() == SCHEMAS[name]
    assert_frame_equal(joined.access_points, whole.access_points)


def test_a_walk_that_both_hold_is_taken_once_and_told() -> None:
    joined, news = join_datasets(part(*NAMES[:3]), part(*NAMES[2:]))
    assert joined.fingerprints.collect().height == small_dataset().fingerprints.collect().height
    (finding,) = joined.info.findings
    assert (finding.kind, finding.count) == (SAME_SESSIONS, 1)
    assert news.fingerprints.collect()["session"].unique().to_list() == [NAMES[3]]
    assert news.readings.collect().height < part(*NAMES[2:]).readings.collect().height


def test_joining_a_set_with_itself_changes_nothing() -> None:
    joined = join_datasets(small_dataset(), small_dataset())[0]
    for name, table in small_dataset().tables.items():
        assert_frame_equal(joined.tables[name], table)


def test_a_walk_of_one_name_with_other_rows_is_refused() -> None:
    later = small_dataset()
    louder = {**later.tables, READINGS: later.readings.with_columns(pl.col("rssi_dbm") + 1)}
    with pytest.raises(DatasetError, match=r"session floor_0.Galaxy.walk is in both data sets with different rows"):
        join_datasets(small_dataset(), replace(later, tables=louder))


@pytest.mark.parametrize(
    ("later", "message"),
    [
        (with_floor(width_m=61.0), "floor 0: width_m is 60 in the base and 61 in the later survey"),
        (with_floor(elevation_m=1.0), "floor 0: elevation_m is 0 in the base and 1"),
        (with_info(small_dataset(), clock="unix"), "clock is boot in small and unix in small: the times have"),
        (with_info(small_dataset(), frame="UTM"), "frame is .* the positions have different frames"),
        (with_privacy(small_dataset(), Privacy(hash_key=b"0" * 16)), "hash both with one key, or neither"),
        (
            with_info(
                small_dataset(),
                groupings=(small_dataset().info.groupings[0].model_copy(update={"by": "window", "window_s": 1.0}),),
            ),
            "wifi: the later survey groups readings differently .by window.",
        ),
    ],
)
def test_sets_that_disagree_are_refused(later: Dataset, message: str) -> None:
    with pytest.raises(DatasetError, match=message):
        join_datasets(small_dataset(), later)


def test_what_one_does_not_know_of_a_floor_is_no_disagreement() -> None:
    joined = join_datasets(with_floor(width_m=None), small_dataset())[0]
    assert joined.info.floors[0].width_m is None


def test_new_floors_and_their_plans_come_along(tmp_path: Path) -> None:
    plan = tmp_path / "plan.png"
    plan.write_bytes(b"later")
    floors = (small_dataset().info.floors[1].model_copy(update={"number": 7, "plan": "plans/floor_7.png"}),)
    later = replace(with_info(part(NAMES[0]), floors=floors), files={"plans/floor_7.png": plan})
    joined = join_datasets(part(*NAMES[1:]), later)[0]
    assert [floor.number for floor in joined.info.floors] == [0, 1, 7]
    assert joined.files == {"plans/floor_7.png": plan}


def test_hashed_sets_join_and_keep_what_only_addresses_tell() -> None:
    privacy = Privacy(hash_key=b"sixteen bytes or more")
    sets = [with_privacy(part(*names), privacy) for names in (NAMES[:2], NAMES[2:])]
    joined = join_datasets(*sets)[0].access_points
    assert_frame_equal(joined, with_privacy(small_dataset(), privacy).access_points)


def test_one_survey_that_saw_a_network_opt_out_is_enough() -> None:
    later = part(*NAMES[2:])
    points = later.access_points.with_columns(nomap=pl.col("bssid") == bssid(0, 0))
    joined = join_datasets(part(*NAMES[:2]), replace(later, tables={**later.tables, ACCESS_POINTS: points}))[0]
    assert joined.access_points.filter(pl.col("nomap")).collect()["bssid"].to_list() == [bssid(0, 0)]


def with_splits(dataset: Dataset, **kinds: str) -> Dataset:
    """A data set with splits of these names and kinds."""
    groups = pl.DataFrame({"id": ["a"], "group": ["test"]})
    folds = (Fold(name="test", test=("test",)),)
    splits = {name: Split(SplitInfo(name=name, kind=kind, folds=folds), groups) for name, kind in kinds.items()}
    return replace(dataset, splits=splits)


def test_splits_are_left_to_be_made_again_but_those_from_outside() -> None:
    base = with_splits(part(NAMES[0]), official="official", block="block", half="random")
    joined = join_datasets(base, with_splits(part(NAMES[1]), block="block", other="official"))[0]
    assert set(joined.splits) == {"official"}
    groups = joined.splits["official"].groups
    assert groups.filter(pl.col("group").is_not_null())["id"].to_list() == ["a"]
    assert groups.height == 1 + part(NAMES[1]).fingerprints.collect().height
    (finding,) = joined.info.findings
    assert (finding.kind, finding.count) == (SPLITS_LEFT_OUT, 2)
    assert "walks: half, other;" in finding.message


def test_the_joined_set_is_a_new_version() -> None:
    base = with_info(part(NAMES[0]), doi="10.5281/zenodo.1", version="1.0", licence="CC-BY-4.0")
    info = join_datasets(base, part(NAMES[1]))[0].info
    assert (info.doi, info.version, info.licence) == (None, None, "CC-BY-4.0")
    assert info.related == (Related(identifier="10.5281/zenodo.1", relation="IsNewVersionOf"),)
