from __future__ import annotations

import polars as pl

from vislam2tag.sessions.repeated_scans import repeated_scans


def scans(*levels: list[float]) -> pl.DataFrame:
    """One scan for each list of levels, of access points a, b, ..., 4 s apart; rows out of order."""
    rows = [
        {"scan": number, "time_ns": number * 4_000_000_000 + i, "bssid": "abcdefgh"[i], "rssi_dbm": level}
        for number, of in enumerate(levels)
        for i, level in enumerate(of)
    ]
    return pl.DataFrame(rows).with_columns(repeated=False).reverse()


def test_scans_with_the_levels_of_the_scan_before() -> None:
    one, other = [-50.0, -60.0, -70.0, -80.0], [-50.0, -60.0, -70.0, -81.0]
    assert repeated_scans(scans(one, one, other, one, one, one)) == [1, 4, 5]


def test_a_few_access_points_may_be_alike_by_chance() -> None:
    assert repeated_scans(scans([-50.0, -60.0], [-50.0, -60.0])) == []
