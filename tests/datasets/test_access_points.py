from __future__ import annotations

from dataclasses import replace

import numpy as np
import polars as pl
import pytest
from polars.testing import assert_frame_equal

from tests.datasets.factory import small_dataset
from vislam2tag.datasets.access_points import (
    FAR_APART_M,
    LEAST_SCANS,
    NO_NAMES,
    STRONG_DBM,
    access_point_table,
    merged_radios,
    pair_differences,
    radios,
)
from vislam2tag.datasets.model import Dataset
from vislam2tag.datasets.schema import ACCESS_POINTS, FINGERPRINTS, SCHEMAS, in_schema

SCANS = 40


def readings(
    *transmitters: tuple[str, int],
    fading_db: float = 1.5,
    step_db: float = 8.0,
    mhz: float | None = 2437.0,
    scans: int = SCANS,
    delay_ns: int = 0,
    first: int = 0,
) -> pl.DataFrame:
    """Hear (address, place) in each scan: addresses of one place share what changes along the walk."""
    rng = np.random.default_rng(len(transmitters) + first)
    places = {place for _, place in transmitters}
    mean = {place: -60 + rng.normal(0, step_db, scans) for place in places}
    return pl.concat(
        pl.DataFrame(
            {
                "scan_id": [f"walk/wifi/{first + scan:06d}" for scan in range(scans)],
                "bssid": bssid,
                "rssi_dbm": (mean[place] + rng.normal(0, fading_db, scans)).astype(np.float32),
                "frequency_mhz": mhz,
                "time_ns": np.arange(scans) * 4_000_000_000 + number * delay_ns,
            },
            schema_overrides={"frequency_mhz": pl.Float32},
        )
        for number, (bssid, place) in enumerate(transmitters)
    )


def grouped(table: pl.DataFrame) -> dict[str, str | None]:
    return dict(radios(table["bssid"].unique().sort(), pair_differences(table)).iter_rows())


def together(table: pl.DataFrame) -> bool:
    return len(set(grouped(table).values())) == 1


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ("04:40:a9:a1:95:40", "04:40:a9:a1:95:42"),
        ("04:40:a9:a1:95:4f", "04:40:a9:a1:95:50"),
        ("cc:2d:e0:2a:cc:fb", "ce:2d:e0:2a:cc:fb"),
        ("e6:cb:ac:32:da:f5", "ee:cb:ac:32:da:f5"),
    ],
)
def test_addresses_counted_on_and_equally_loud_are_one_radio(one: str, other: str) -> None:
    assert grouped(readings((one, 0), (other, 0))) == {one: one, other: one}


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ("04:40:a9:a1:95:40", "04:40:a9:a1:95:60"),
        ("04:40:a9:a1:95:40", "04:40:a9:a1:96:40"),
        ("04:40:a9:a1:95:40", "08:40:a9:a1:95:40"),
        ("cc:2d:e0:2a:cc:fb", "ce:2d:e0:2a:cc:fc"),
    ],
)
def test_other_addresses_are_not_however_loud(one: str, other: str) -> None:
    assert not together(readings((one, 0), (other, 0)))


def test_neighbouring_addresses_at_two_places_are_two_radios() -> None:
    assert not together(readings(("04:40:a9:a1:95:40", 0), ("04:40:a9:a1:95:41", 1)))


def test_a_radio_has_one_channel() -> None:
    low = readings(("04:40:a9:a1:95:40", 0), mhz=2437.0)
    high = low.with_columns(bssid=pl.lit("04:40:a9:a1:95:41"), frequency_mhz=pl.lit(5180.0, pl.Float32))
    assert not together(pl.concat([low, high]))


def test_channels_that_nobody_wrote_down_do_not_hinder() -> None:
    assert together(readings(("04:40:a9:a1:95:40", 0), ("04:40:a9:a1:95:41", 0), mhz=None))


def test_readings_of_different_moments_say_nothing() -> None:
    assert not together(readings(("04:40:a9:a1:95:40", 0), ("04:40:a9:a1:95:41", 0), delay_ns=1_000_000_000))


def test_data_without_times_is_compared_by_scan() -> None:
    table = readings(("04:40:a9:a1:95:40", 0), ("04:40:a9:a1:95:41", 0))
    assert together(table.with_columns(time_ns=pl.lit(None, pl.Int64)))


def test_few_scans_prove_nothing() -> None:
    pair = ("04:40:a9:a1:95:40", 0), ("04:40:a9:a1:95:41", 0)
    assert not together(readings(*pair, scans=LEAST_SCANS - 1))
    assert together(readings(*pair, scans=LEAST_SCANS))


def test_a_radio_is_named_by_its_least_address_over_links_of_pairs() -> None:
    names = ["04:40:a9:a1:95:40", "04:40:a9:a1:95:4a", "04:40:a9:a1:95:54"]
    assert grouped(readings(*((name, 0) for name in names))) == dict.fromkeys(names, names[0])


def test_an_identifier_that_is_no_address_has_no_known_radio() -> None:
    assert grouped(readings(("WAP001", 0))) == {"WAP001": None}


def test_generated_radios_are_found_again() -> None:
    """Sixty radios of one delivery with three networks each, addresses 4 apart so that all radios are neighbours."""
    transmitters = [
        (f"04:40:a9:a1:{radio // 60:02x}:{4 * (radio % 60) + net:02x}", radio)
        for radio in range(60)
        for net in range(3)
    ]
    table = readings(*transmitters, fading_db=2.0)
    found = grouped(table)
    truth = dict(transmitters)
    assert sum(1 for bssid in found if found[bssid] == min(b for b in truth if truth[b] == truth[bssid])) == len(truth)


MAC = "00:11:22:33:44:55"


def scans(*rows: tuple[str, float | None, int | None], technology: str = "wifi") -> pl.LazyFrame:
    """Fingerprints of (session, x, floor); every session's scans are numbered."""
    sessions = [session for session, _, _ in rows]
    return in_schema(
        FINGERPRINTS,
        pl.DataFrame(
            {
                "scan_id": [f"{session}/wifi/{number:06d}" for number, session in enumerate(sessions)],
                "technology": technology,
                "building": "",
                "session": sessions,
                "x": [x for _, x, _ in rows],
                "y": 0.0,
                "floor": [floor for _, _, floor in rows],
            },
            schema_overrides={"x": pl.Float64, "floor": pl.Int32},
        ),
    ).lazy()


def heard(fingerprints: pl.LazyFrame, bssid: str = MAC, rssi_dbm: float = -60.0, mhz: float = 2412.0) -> pl.LazyFrame:
    """Hear one access point once in each fingerprint."""
    return fingerprints.select(
        "scan_id",
        bssid=pl.lit(bssid),
        rssi_dbm=pl.lit(rssi_dbm, pl.Float32),
        frequency_mhz=pl.lit(mhz, pl.Float32),
        time_ns=pl.lit(0, pl.Int64),
        floor="floor",
        x="x",
        y="y",
        sigma=pl.lit(0.1),
    )


def named(*rows: tuple[str, int], bssid: str = MAC) -> pl.DataFrame:
    return pl.DataFrame(
        [{"bssid": bssid, "technology": "wifi", "ssid": ssid, "count": count} for ssid, count in rows],
        schema=NO_NAMES.schema,
    )


def only_row(table: pl.DataFrame) -> dict[str, object]:
    (row,) = table.rows(named=True)
    return row


def test_what_the_small_data_set_says_of_its_access_points() -> None:
    dataset = small_dataset()
    names = dataset.access_points.select("bssid", "technology", "ssid", count="readings").collect()
    found = access_point_table(dataset.fingerprints, dataset.readings, names)
    assert_frame_equal(found.drop("radio"), dataset.access_points.collect().drop("radio"))


def test_no_readings_make_no_rows() -> None:
    dataset = small_dataset()
    assert access_point_table(dataset.fingerprints.head(0), dataset.readings.head(0), NO_NAMES).is_empty()
    assert access_point_table(dataset.fingerprints, dataset.readings.head(0), NO_NAMES).is_empty()


def test_two_readings_in_a_window_are_one_fingerprint() -> None:
    fingerprints = scans(("a", 0.0, 0))
    readings = pl.concat([heard(fingerprints), heard(fingerprints, rssi_dbm=-50.0)])
    row = only_row(access_point_table(fingerprints, readings, NO_NAMES))
    assert (row["readings"], row["fingerprints"], row["sessions"], row["strongest_dbm"]) == (2, 1, 1, -50.0)


def test_readings_are_counted_over_sessions_and_floors() -> None:
    fingerprints = scans(("a", 0.0, 2), ("b", 0.0, 1), ("b", None, None))
    row = only_row(access_point_table(fingerprints, heard(fingerprints), NO_NAMES))
    assert (row["readings"], row["sessions"], row["floors"]) == (3, 2, [1, 2])


def test_the_median_frequency_is_one_that_was_heard() -> None:
    fingerprints = scans(*(("a", 0.0, 0) for _ in range(4)))
    readings = pl.concat([heard(fingerprints.head(1), mhz=2412.0), heard(fingerprints.tail(3), mhz=2437.0)])
    assert only_row(access_point_table(fingerprints, readings, NO_NAMES))["frequency_mhz"] == 2437.0


def test_an_unknown_frequency_stays_unknown() -> None:
    fingerprints = scans(("a", 0.0, 0))
    readings = heard(fingerprints).with_columns(frequency_mhz=pl.lit(None, pl.Float32))
    assert only_row(access_point_table(fingerprints, readings, NO_NAMES))["frequency_mhz"] is None


def test_the_most_frequent_name_counts_and_an_empty_one_never() -> None:
    fingerprints = scans(("a", 0.0, 0))
    names = named(("", 90), ("library", 3), ("eduroam", 5), ("library", 3))
    assert only_row(access_point_table(fingerprints, heard(fingerprints), names))["ssid"] == "library"


@pytest.mark.parametrize(("ssid", "nomap"), [("home_nomap", True), ("home_NOMAP", True), ("home_nomap2", False)])
def test_nomap_is_a_suffix(ssid: str, nomap: bool) -> None:
    fingerprints = scans(("a", 0.0, 0))
    assert only_row(access_point_table(fingerprints, heard(fingerprints), named((ssid, 1))))["nomap"] is nomap


def test_one_name_with_the_suffix_among_others_is_enough() -> None:
    fingerprints = scans(("a", 0.0, 0))
    names = named(("home", 9), ("home_nomap", 1))
    assert only_row(access_point_table(fingerprints, heard(fingerprints), names))["nomap"] is True


@pytest.mark.parametrize(("bssid", "local"), [("02:00:00:00:00:01", True), ("04:40:a9:a1:95:40", False)])
def test_the_local_bit_is_that_of_the_first_octet(bssid: str, local: bool) -> None:
    fingerprints = scans(("a", 0.0, 0))
    assert only_row(access_point_table(fingerprints, heard(fingerprints, bssid), NO_NAMES))["randomised"] is local


def test_of_an_identifier_that_is_no_address_nothing_is_said() -> None:
    fingerprints = scans(("a", 0.0, 0))
    row = only_row(
        access_point_table(fingerprints, heard(fingerprints, "WAP001"), named(("x_nomap", 1), bssid="WAP001"))
    )
    assert [row[flag] for flag in ("randomised", "mobile", "nomap")] == [None, None, None]


def test_a_beacons_address_says_nothing_of_how_it_was_given() -> None:
    fingerprints = scans(("a", 0.0, 0), technology="ble")
    assert only_row(access_point_table(fingerprints, heard(fingerprints), NO_NAMES))["randomised"] is None


def strong_at(*places: tuple[float, int]) -> pl.DataFrame:
    """Hear the access point strongly, four times at each (x, floor)."""
    fingerprints = scans(*(("a", x, floor) for x, floor in places for _ in range(4)))
    return access_point_table(fingerprints, heard(fingerprints, rssi_dbm=STRONG_DBM), NO_NAMES)


@pytest.mark.parametrize(
    ("places", "mobile"),
    [
        ([(0.0, 0), (FAR_APART_M + 10, 0)], True),
        ([(0.0, 0), (FAR_APART_M - 10, 0)], False),
        ([(0.0, 0), (FAR_APART_M + 10, 1)], False),
        ([(0.0, 0), (0.0, 3)], True),
        ([(0.0, 0), (0.0, 2)], False),
    ],
)
def test_what_is_strong_at_places_too_far_apart_moves(places: list[tuple[float, int]], mobile: bool) -> None:
    assert only_row(strong_at(*places))["mobile"] is mobile


def test_one_odd_label_moves_nothing() -> None:
    fingerprints = scans(*(("a", x, 0) for x in (0.0, 0.0, 0.0, 0.0, 200.0)))
    readings = heard(fingerprints, rssi_dbm=STRONG_DBM)
    assert only_row(access_point_table(fingerprints, readings, NO_NAMES))["mobile"] is False


@pytest.mark.parametrize(
    ("ssid", "mobile"),
    [
        ("AndroidAP_1234", True),
        ("Anna's iPhone", True),
        ("HUAWEI Mate 30 Pro 5G", True),
        ("vivo Y97", True),
        ("DIRECT-274F8B1E", True),
        ("DIRECT-61-HP M281 LaserJet", False),
        ("HUAWEI-2FF4", False),
        ("eduroam", False),
    ],
)
def test_names_of_phones_and_of_what_stands(ssid: str, mobile: bool) -> None:
    fingerprints = scans(("a", 0.0, 0))
    assert only_row(access_point_table(fingerprints, heard(fingerprints), named((ssid, 1))))["mobile"] is mobile


def test_without_position_or_name_nobody_knows_whether_it_moves() -> None:
    fingerprints = scans(("a", None, None))
    assert only_row(access_point_table(fingerprints, heard(fingerprints), NO_NAMES))["mobile"] is None


def test_the_order_of_rows_makes_no_difference() -> None:
    dataset = small_dataset()
    assert_frame_equal(
        access_point_table(dataset.fingerprints, dataset.readings, NO_NAMES),
        access_point_table(dataset.fingerprints.reverse(), dataset.readings.reverse(), NO_NAMES),
    )


LEAD = "00:11:22:33:00:00"
TWIN = "00:11:22:33:00:01"


def with_twins() -> Dataset:
    """The small data set, in which two addresses are one radio and one of them opted out."""
    dataset = small_dataset()
    points = dataset.access_points.with_columns(
        radio=pl.when(pl.col("bssid") == TWIN).then(pl.lit(LEAD)).otherwise(pl.col("radio")),
        nomap=pl.col("bssid") == TWIN,
    )
    return replace(dataset, tables={**dataset.tables, ACCESS_POINTS: points})


def test_a_scan_has_one_reading_of_a_radio() -> None:
    before, after = with_twins(), merged_radios(with_twins())
    twins = before.readings.filter(pl.col("bssid").is_in([LEAD, TWIN])).collect()
    both = after.readings.filter(pl.col("bssid") == LEAD).collect()
    assert both.height == twins["scan_id"].n_unique()
    assert TWIN not in after.readings.collect()["bssid"]
    scan = both.row(0, named=True)
    heard = twins.filter(pl.col("scan_id") == scan["scan_id"])
    assert heard.height == 2
    assert scan["rssi_dbm"] == pytest.approx(heard["rssi_dbm"].mean())


def test_all_else_stays() -> None:
    before, after = with_twins(), merged_radios(with_twins())
    others = ~pl.col("bssid").is_in([LEAD, TWIN])
    assert_frame_equal(before.readings.filter(others), after.readings.filter(others))
    assert after.readings.collect_schema() == SCHEMAS["readings"]
    columns = pl.exclude("readings", "labelled")
    assert_frame_equal(before.fingerprints.select(columns), after.fingerprints.select(columns))


def test_counts_follow() -> None:
    after = merged_radios(with_twins())
    counts = after.readings.group_by("scan_id").agg(readings=pl.len().cast(pl.Int32))
    told = after.fingerprints.filter(pl.col("readings") > 0).select("scan_id", "readings")
    assert_frame_equal(told, counts, check_row_order=False)


def test_a_radio_is_one_access_point_with_what_was_known_of_its_networks() -> None:
    before = with_twins().access_points.collect()
    after = merged_radios(with_twins()).access_points.collect()
    assert after["bssid"].to_list() == [bssid for bssid in before["bssid"] if bssid != TWIN]
    lead = after.row(by_predicate=pl.col("bssid") == LEAD, named=True)
    assert (lead["nomap"], lead["mobile"], lead["ssid"]) == (True, False, "eduroam")
    assert not after.filter(pl.col("bssid") != LEAD)["nomap"].any()


def test_without_twins_nothing_changes() -> None:
    dataset = small_dataset()
    for name, table in merged_radios(dataset).tables.items():
        assert_frame_equal(table, dataset.tables[name])
