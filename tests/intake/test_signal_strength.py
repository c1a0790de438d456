"""Levels that no receiver reports are no levels; a file of positive ones has lost the sign."""

from __future__ import annotations

import polars as pl
import pytest

from vislam2tag.intake.signal_strength import in_range, level_findings, strength_of, without_absurd_levels


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
    assert "65 for -65" in sign.message
    assert (rest.kind, rest.lines) == ("absurd_levels", (6,))


def test_levels_for_not_heard_are_no_lost_sign() -> None:
    assert [each.kind for each in level_findings(rows(100.0, 100.0, -60.0), "a", "left out")] == ["absurd_levels"]
    assert not level_findings(rows(-60.0, None), "a", "left out")


def test_ujiindoorloc_measures_zero() -> None:
    assert in_range(0.0, strength_of(["tampere", "uji"]))
    assert not in_range(0.0, strength_of(["tampere"]))
