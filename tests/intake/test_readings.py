"""Readings come in with addresses of one notation and with levels that can be true."""

from __future__ import annotations

import polars as pl

from vislam2tag.intake.readings import KINDS, admitted


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
