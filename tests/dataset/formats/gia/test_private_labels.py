"""Privacy of labels that become no data set, and of the raw files beside them."""

from __future__ import annotations

import shutil
from pathlib import Path

import polars as pl
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vislam2tag.dataset.fingerprinting.labelled import LabelledSession, open_labelled
from vislam2tag.dataset.formats.gia.private_labels import PrivateLabels, hidden_wifi_file
from vislam2tag.dataset.transmitters.privacy import Privacy, hashed
from vislam2tag.sessions.tables.wifi_table import parse_wifi

KEY = b"0123456789abcdef"


@pytest.fixture
def opted_out(labels: Path, tmp_path: Path) -> tuple[str, tuple[LabelledSession, ...]]:
    """Labels where one reading of one access point names a network that opted out."""
    shutil.copytree(labels, tmp_path / "labels")
    file = min((tmp_path / "labels" / "wifi").iterdir())
    table = pl.read_parquet(file)
    named = pl.when(pl.int_range(pl.len()) == 3).then(pl.lit("home_nomap")).otherwise("ssid")
    table.with_columns(ssid=named).write_parquet(file)
    return str(table["bssid"][3]), open_labelled(tmp_path / "labels").sessions


def test_a_network_that_opted_out_goes_by_whatever_name(opted_out: tuple[str, tuple[LabelledSession, ...]]) -> None:
    bssid, sessions = opted_out
    private = PrivateLabels.of(sessions, Privacy())
    everywhere = pl.concat([session.table("wifi", ("bssid", "ssid")) for session in sessions])
    count = int((everywhere["bssid"] == bssid).sum())
    assert private.unwanted == {bssid}
    assert count > 1
    assert [(finding.kind, finding.count) for finding in private.findings] == [("nomap_left_out", count)]
    assert bssid not in private.hidden(everywhere)["bssid"]
    asked_for = PrivateLabels.of(sessions, Privacy(include_nomap=True))
    assert not asked_for.hides
    assert asked_for.hidden(everywhere).equals(everywhere)


def test_addresses_and_names_are_hidden() -> None:
    private = PrivateLabels(Privacy(hash_key=KEY, keep_ssids=False), frozenset({"x"}), 1)
    rows = private.hidden(pl.DataFrame({"bssid": ["a", "x", "b"], "ssid": ["n", "m", ""], "row": [1, 2, 3]}))
    assert rows.rows() == [(hashed("a", KEY), "", 1), (hashed("b", KEY), "", 3)]


def test_a_raw_file_keeps_what_is_not_hidden() -> None:
    data = b"0; 11; WLAN; a; b; c; 00:01; -40\n0;12;WLAN;;00:02;-41,5\ngarbage\n1; 13; WLAN; n\xff; 00:03; -42"
    rows = parse_wifi(data, "wifi.csv").rows.select("row", "bssid", "ssid")
    assert hidden_wifi_file(data, rows).split(b"\n") == [
        b"0; 11; WLAN; a; b; c; 00:01; -40",
        b"0;12;WLAN;;00:02;-41,5",
        b"1; 13; WLAN; n\xff; 00:03; -42",
        b"",
    ]
    private = rows.filter(pl.col("row") != 2).with_columns(bssid=pl.lit("hash"), ssid=pl.lit(""))
    assert hidden_wifi_file(data, private) == b"0; 11; WLAN; ; hash; -40\n1; 13; WLAN; ; hash; -42\n"


@given(ssid=st.text(st.characters(exclude_characters="\n\r", codec="utf-8"), max_size=12))
def test_what_is_rewritten_reads_back(ssid: str) -> None:
    data = f"5; 77; WLAN; {ssid}; 00:01; -40\n".encode()
    rows = parse_wifi(data, "wifi.csv").rows
    changed = rows.with_columns(bssid=pl.lit("hash"))
    back = parse_wifi(hidden_wifi_file(data, changed.select("row", "bssid", "ssid")), "wifi.csv").rows
    assert back.equals(changed)
