"""Every notation of an address is the same address; names that are none stay, and masked ones are left out."""

from __future__ import annotations

import polars as pl
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vislam2tag.intake.addresses import is_masked, normal_address, normal_uuid, with_addresses

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
