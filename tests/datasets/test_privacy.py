from __future__ import annotations

import hashlib
import re
from dataclasses import replace
from pathlib import Path

import polars as pl
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from polars.testing import assert_frame_equal

from tests.datasets.factory import bssid, small_dataset
from vislam2tag.common.errors import UsageError
from vislam2tag.datasets.model import Dataset
from vislam2tag.datasets.privacy import NOMAP_LEFT_OUT, Privacy, hashed, key_name, read_key, with_privacy
from vislam2tag.datasets.schema import ACCESS_POINTS, READINGS, SCHEMAS

KEY = b"sixteen bytes or more"
ALL = [bssid(floor, index) for floor in (0, 1) for index in range(5)]


def with_nomap(*unwanted: str) -> Dataset:
    """The small data set, in which these networks opted out; all of a floor are one radio."""
    dataset = small_dataset()
    points = dataset.access_points.with_columns(
        nomap=pl.col("bssid").is_in(list(unwanted)), radio=pl.col("bssid").str.head(15) + "00"
    )
    return replace(dataset, tables={**dataset.tables, ACCESS_POINTS: points})


def texts(table: pl.LazyFrame) -> set[str]:
    """All words of a table."""
    columns = table.select(pl.col(pl.String)).collect()
    return {word for name in columns.columns for word in columns[name].drop_nulls()}


def assert_same_tables(one: Dataset, other: Dataset) -> None:
    for name, table in one.tables.items():
        assert_frame_equal(table, other.tables[name])


def test_nothing_to_hide_changes_nothing() -> None:
    dataset = small_dataset()
    shown = with_privacy(dataset, Privacy())
    assert_same_tables(dataset, shown)
    assert shown.info == dataset.info


@settings(max_examples=15)
@given(st.sets(st.sampled_from(ALL)))
def test_no_reading_of_a_network_that_opted_out_stays(unwanted: set[str]) -> None:
    before = with_nomap(*unwanted)
    after = with_privacy(before, Privacy())
    for table in after.tables.values():
        assert not texts(table) & unwanted
    kept = ~pl.col("bssid").is_in(list(unwanted))
    assert_frame_equal(after.readings, before.readings.filter(kept))
    assert_frame_equal(after.access_points.drop("radio"), before.access_points.filter(kept).drop("radio"))


def test_fingerprints_count_what_is_left_and_keep_their_place() -> None:
    before, after = with_nomap(*ALL[:5]), with_privacy(with_nomap(*ALL[:5]), Privacy())
    told = after.fingerprints.select("scan_id", "readings", "labelled", "labelled_share").collect()
    left = after.readings.group_by("scan_id").agg(
        readings=pl.len().cast(pl.Int32),
        labelled=pl.col("x").count().cast(pl.Int32),
        labelled_share=pl.col("x").count() / pl.len(),
    )
    assert_frame_equal(told, left.collect(), check_row_order=False)
    others = pl.exclude("readings", "labelled", "labelled_share")
    assert_frame_equal(before.fingerprints.select(others), after.fingerprints.select(others))


def test_a_fingerprint_with_nothing_left_stays() -> None:
    after = with_privacy(with_nomap(*ALL), Privacy()).fingerprints.collect()
    assert after.height == small_dataset().fingerprints.collect().height
    assert after["readings"].sum() == after["labelled"].sum() == after["labelled_share"].sum() == 0


def test_what_is_left_out_is_counted() -> None:
    (finding,) = with_privacy(with_nomap(ALL[0]), Privacy()).info.findings
    heard = small_dataset().readings.filter(pl.col("bssid") == ALL[0]).collect().height
    assert (finding.kind, finding.count) == (NOMAP_LEFT_OUT, heard)


def test_a_radio_is_never_named_by_a_network_that_opted_out() -> None:
    after = with_privacy(with_nomap(ALL[0]), Privacy()).access_points.collect()
    assert after["radio"].unique().sort().to_list() == [ALL[1], ALL[5]]


def test_who_asks_for_them_gets_them() -> None:
    before = with_nomap(*ALL)
    assert_same_tables(before, with_privacy(before, Privacy(include_nomap=True)))


def test_ssids_are_dropped_on_request() -> None:
    after = with_privacy(small_dataset(), Privacy(keep_ssids=False))
    assert "eduroam" in texts(small_dataset().access_points)
    assert "eduroam" not in texts(after.access_points)


def test_hashes_replace_every_identifier_and_change_nothing_else() -> None:
    before, after = with_nomap(), with_privacy(with_nomap(), Privacy(hash_key=KEY))
    assert not any(texts(table) & set(ALL) for table in after.tables.values())
    codes = {bssid: hashed(bssid, KEY) for bssid in ALL}
    assert_frame_equal(after.readings, before.readings.with_columns(pl.col("bssid").replace_strict(codes)))
    expected = before.access_points.with_columns(pl.col("bssid", "radio").replace_strict(codes)).sort("bssid")
    assert_frame_equal(after.access_points, expected)
    for name in after.tables:
        assert after.tables[name].collect_schema() == SCHEMAS[name]


def test_an_identifier_of_no_known_radio_stays_without() -> None:
    dataset = small_dataset()
    points = dataset.access_points.with_columns(radio=pl.lit(None, pl.String))
    unknown = replace(dataset, tables={**dataset.tables, ACCESS_POINTS: points})
    for privacy in (Privacy(), Privacy(hash_key=KEY)):
        assert with_privacy(unknown, privacy).access_points.collect()["radio"].null_count() == len(ALL)


@given(st.text(max_size=40), st.binary(min_size=16, max_size=64))
def test_one_key_gives_one_hash_and_another_key_another(identifier: str, key: bytes) -> None:
    code = hashed(identifier, key)
    assert code == hashed(identifier, key)
    assert re.fullmatch("[0-9a-f]{32}", code)
    assert code != hashed(identifier, key + b"x")
    assert key_name(key) == key_name(key) != key_name(key + b"x")


def test_the_hash_is_the_standards() -> None:
    """HMAC-SHA256 by the standard library's other implementation; upper case is the same address."""
    block = KEY.ljust(64, b"\0")
    inner = hashlib.sha256(bytes(x ^ 0x36 for x in block) + b"00:aa").digest()
    expected = hashlib.sha256(bytes(x ^ 0x5C for x in block) + inner).hexdigest()
    assert hashed("00:AA", KEY) == hashed("00:aa", KEY) == expected[:32]


def test_a_hashed_set_names_its_key_and_is_not_hashed_twice() -> None:
    once = with_privacy(small_dataset(), Privacy(hash_key=KEY))
    assert once.info.bssid_key == key_name(KEY)
    with pytest.raises(UsageError, match="already hashed"):
        with_privacy(once, Privacy(hash_key=KEY))


def test_all_stays_lazy_but_the_access_points() -> None:
    dataset = small_dataset()

    def unread(_: pl.DataFrame) -> pl.DataFrame:
        raise AssertionError("readings were read")

    readings = dataset.readings.map_batches(unread, schema=dict(SCHEMAS[READINGS]))
    lazy = replace(dataset, tables={**dataset.tables, READINGS: readings})
    with_privacy(lazy, Privacy(hash_key=KEY))


def test_a_key_is_read_without_the_line_end(tmp_path: Path) -> None:
    (tmp_path / "key").write_bytes(KEY + b"\n")
    assert read_key(tmp_path / "key") == KEY


@pytest.mark.parametrize("content", [b"", b"\n\n", b"short", b"fifteen bytes..\n"])
def test_a_short_key_is_refused(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "key").write_bytes(content)
    with pytest.raises(
        UsageError, match=rf"key: the key has {len(content.strip())} bytes, but at least 16 are needed; make one"
    ):
        read_key(tmp_path / "key")


def test_a_missing_key_is_told(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=r"nowhere: the key cannot be read \(No such file"):
        read_key(tmp_path / "nowhere")
