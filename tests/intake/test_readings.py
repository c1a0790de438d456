"""Radio readings that enter: addresses and levels."""

from __future__ import annotations

import math

import polars as pl
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vislam2tag.intake.level_scales import SIGNAL_STRENGTH, in_range, strength_of
from vislam2tag.intake.readings import (
    KINDS,
    admitted,
    is_masked,
    level_findings,
    level_number,
    level_of,
    normal_address,
    normal_uuid,
    with_addresses,
    without_absurd_levels,
)


def test_bounds_belong_to_the_range_and_numbers_must_be_finite() -> None:
    values = pl.Series([-126.1, -126.0, -1.0, -0.9, float("nan"), float("inf"), None])
    kept = pl.select(SIGNAL_STRENGTH.contains(pl.lit(values))).to_series().to_list()
    assert kept == [False, True, True, False, False, False, None]


def test_a_finding_names_range_cause_and_cure() -> None:
    assert SIGNAL_STRENGTH.outside("wifi.csv", [], "they are not used") == []
    (finding,) = SIGNAL_STRENGTH.outside("wifi.csv", [3, 9], "they are not used")
    assert (finding.kind, finding.file, finding.count, finding.lines) == ("absurd_levels", "wifi.csv", 2, (3, 9))
    assert finding.message == (
        "signal strengths must be from -126 to -1 dBm; they are not used. Possible cause: 0, 127 and -127 often mean "
        "'no value' and 100 'not heard', or the file uses another unit. Remove such levels from the file, or write "
        "them in dBm."
    )


def rows(*levels: float | None) -> pl.DataFrame:
    return pl.DataFrame(
        {"row": range(1, len(levels) + 1), "rssi_dbm": levels}, schema_overrides={"rssi_dbm": pl.Float64}
    )


@pytest.mark.parametrize("level", [0.0, 1.0, 65.0, 100.0, 127.0, -127.0, -150.0, float("nan"), float("inf")])
def test_what_is_no_level_becomes_null(level: float) -> None:
    kept, (finding,) = without_absurd_levels(rows(-60.0, level, -126.0, -1.0), "wifi.csv")
    assert kept["rssi_dbm"].to_list() == [-60.0, None, -126.0, -1.0]
    assert (finding.kind, finding.count, finding.lines) == ("absurd_levels", 1, (2,))


def test_a_file_of_positive_levels_has_lost_its_sign() -> None:
    sign, rest = level_findings(rows(65.0, 70.0, None, -60.0, 81.0, 127.0, 66.0), "ble.csv", "left out")
    assert (sign.kind, sign.count, sign.lines) == ("lost_sign", 4, (1, 2, 5, 7))
    assert "65 instead of -65" in sign.message
    assert (rest.kind, rest.lines) == ("absurd_levels", (6,))


def test_levels_for_not_heard_are_no_lost_sign() -> None:
    assert [each.kind for each in level_findings(rows(100.0, 100.0, -60.0), "a", "left out")] == ["absurd_levels"]
    assert not level_findings(rows(-60.0, None), "a", "left out")


def test_ujiindoorloc_measures_zero() -> None:
    assert in_range(0.0, strength_of(["tampere", "uji"]))
    assert not in_range(0.0, strength_of(["tampere"]))


OCTETS = st.lists(st.integers(0, 255), min_size=6, max_size=6)
PLAIN = "02:1a:00:00:00:01"


@given(OCTETS)
def test_all_notations_of_an_address_agree(octets: list[int]) -> None:
    digits = "".join(f"{octet:02x}" for octet in octets)
    expected = ":".join(f"{octet:02x}" for octet in octets)
    for size in (2, 4, 6, 12):
        for separator in ":-.":
            text = separator.join(digits[i : i + size] for i in range(0, 12, size))
            for notation in (text, text.upper(), f" {text} "):
                assert normal_address(notation) == expected


@given(st.text() | st.uuids().map(str) | st.uuids().map(lambda uuid: uuid.hex) | OCTETS.map(lambda o: bytes(o).hex()))
def test_what_is_normal_stays(text: str) -> None:
    assert normal_address(normal_address(text)) == normal_address(text)
    assert normal_uuid(normal_uuid(text)) == normal_uuid(text)


@given(st.uuids())
def test_all_notations_of_a_uuid_agree(uuid: object) -> None:
    text = str(uuid)
    digits = text.replace("-", "")
    assert {normal_uuid(each) for each in (text, text.upper(), digits, digits.upper())} == {text}
    assert {normal_address(f"{each}-1-22") for each in (text.upper(), digits)} == {f"{text}-1-22"}
    assert normal_address(text.upper()) == text


@pytest.mark.parametrize("name", ["WAP001", "ap17", "992", "Corridor-3", "9f" * 16, "02:1a:00", "aa:bb-cc.dd:ee:ff"])
def test_other_names_stay(name: str) -> None:
    assert normal_address(name) == name


@pytest.mark.parametrize("name", ["", " ", "02:00:00:00:00:00", "0200.0000.0000", "FF-FF-FF-FF-FF-FF", "000000000000"])
def test_masked_addresses(name: str) -> None:
    assert is_masked(name)
    assert not is_masked("02:00:00:00:00:01")


def test_rows_without_an_address_are_left_out_and_counted() -> None:
    rows = pl.DataFrame(
        {"row": [2, 3, 4, 5, 6], "bssid": ["021A.0000.0001", "02:00:00:00:00:00", None, PLAIN, "FFFFFFFFFFFF"]}
    )
    kept, (finding,) = with_addresses(rows, "bssid", "WiFi.csv")
    assert kept.rows() == [(2, PLAIN), (5, PLAIN)]
    assert (finding.kind, finding.count, finding.lines) == ("masked_addresses", 3, (3, 4, 6))
    assert "location permission" in finding.message


def test_rows_that_are_known_otherwise_stay() -> None:
    rows = pl.DataFrame({"row": [1, 2], "address": ["02:00:00:00:00:00"] * 2, "uuid": ["u", None]})
    kept, (finding,) = with_addresses(rows, "address", "Ble.csv", pl.col("uuid").is_not_null())
    assert (kept["row"].to_list(), finding.count) == ([1], 1)


@pytest.mark.parametrize("text", ["-60", "-60.0", "-60,0", "-60dBm", "-60 DBM", " -60 dB ", "\u221260", "\u221260 dBm"])
def test_a_level_may_have_its_unit_and_any_minus(text: str) -> None:
    assert level_of(text) == -60
    assert pl.select(level_number(pl.lit(text))).item() == -60


@pytest.mark.parametrize("text", ["", "dBm", "loud", "-60 mV", "-6 0"])
def test_what_is_not_a_number_is_no_level(text: str) -> None:
    assert math.isnan(level_of(text))
    assert pl.select(level_number(pl.lit(text))).item() is None


def named(bssid: list[str], ssid: list[str]) -> pl.DataFrame:
    table = pl.DataFrame({"bssid": bssid, "ssid": ssid}, {"bssid": pl.String, "ssid": pl.String})
    return table.with_columns(rssi_dbm=pl.lit(-60.0)).with_row_index("row", offset=1)


def test_exchanged_columns_are_read_the_other_way_round() -> None:
    names = [f"02-1A-00-00-00-{number:02X}" for number in range(9)]
    kept, findings = admitted(named(["net"] * 8 + [""], names), "bssid", "wifi.csv")
    assert kept["bssid"].to_list() == [f"02:1a:00:00:00:{number:02x}" for number in range(9)]
    assert kept["ssid"].to_list() == ["net"] * 8 + [""]
    assert [(each.kind, each.count) for each in findings] == [("exchanged_columns", 9)]


@pytest.mark.parametrize(
    ("bssid", "ssid"),
    [
        ([PLAIN] * 9, ["021A00000001"] * 9),  # networks that are called like their access points
        (["WAP001"] * 9, ["021A00000001"] * 5 + ["net"] * 4),
        (["WAP001"] * 9, [""] * 9),
        ([], []),
    ],
)
def test_columns_that_may_be_right_stay(bssid: list[str], ssid: list[str]) -> None:
    kept, findings = admitted(named(bssid, ssid), "bssid", "wifi.csv")
    assert (kept["ssid"].to_list(), findings) == (ssid, [])


def test_addresses_and_levels_are_brought_to_the_rules() -> None:
    table = pl.DataFrame(
        {
            "row": [1, 2, 3],
            "bssid": ["02-1A-00-00-00-01", "02:00:00:00:00:00", "021a00000001"],
            "rssi_dbm": [-60.0, 65.0, 127.0],
        }
    )
    kept, findings = admitted(table, "bssid", "wifi.csv")
    assert kept.rows() == [(1, "02:1a:00:00:00:01", -60.0), (3, "02:1a:00:00:00:01", None)]
    assert {each.kind: each.lines for each in findings} == {"masked_addresses": (2,), "absurd_levels": (3,)}
    assert {each.kind for each in findings} <= KINDS
