from __future__ import annotations

import polars as pl
import pytest
from polars.testing import assert_frame_equal

from tests.dataset.factory import small_dataset
from vislam2tag.dataset.schema import FINGERPRINTS, in_schema
from vislam2tag.dataset.transmitters.access_points import FAR_APART_M, STRONG_DBM, access_point_table

MAC = "00:11:22:33:44:55"
NO_NAMES = pl.DataFrame(schema={"bssid": pl.String, "technology": pl.String, "ssid": pl.String, "count": pl.Int64})


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
