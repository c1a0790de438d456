"""The filler of a table is found where it is clear, asked for where it is not, and never found in measured levels."""

from __future__ import annotations

import numpy as np
import polars as pl
import pytest

from vislam2tag.intake.fillers import Judgement, filler_of, question, without_filler
from vislam2tag.intake.level_scales import SIGNAL_STRENGTH, strength_of


def table(levels: np.ndarray, stated: float = 100.0) -> tuple[pl.DataFrame, int, int]:
    """Cells with a level, the number of access points, and that of cells with the stated level."""
    rows, columns = np.nonzero(levels != stated)
    heard = pl.DataFrame(
        {"row": rows, "bssid": [f"WAP{column}" for column in columns], "rssi_dbm": levels[rows, columns]}
    )
    return heard, levels.shape[1], int((levels == stated).sum())


def fingerprints(filler: float, heard: float, weakest: int = -97, seed: int = 0) -> np.ndarray:
    """40 rows of 12 access points, so large a share of them heard."""
    rng = np.random.default_rng(seed)
    levels = np.clip(rng.normal(-75, 10, (40, 12)).round(), weakest, -40)
    return np.where(rng.random((40, 12)) < heard, levels, filler)


@pytest.mark.parametrize("filler", [-98, -100, -105, -110, -120, -150, -200, 0, 1, -1])
def test_fillers_are_found(filler: float) -> None:
    found = filler_of(*table(fingerprints(filler, 0.2)), SIGNAL_STRENGTH)
    assert (found.judgement, found.level) == (Judgement.FOUND, filler)


def test_zero_is_found_where_it_may_be_measured_too() -> None:
    found = filler_of(*table(fingerprints(0, 0.2)), strength_of(["uji"]))
    assert (found.judgement, found.level) == (Judgement.FOUND, 0)


@pytest.mark.parametrize("filler", [-126, -1])
def test_a_filler_far_from_all_levels_is_found_in_few_cells_too(filler: float) -> None:
    found = filler_of(*table(fingerprints(filler, 0.8)), SIGNAL_STRENGTH)
    assert (found.judgement, found.level) == (Judgement.FOUND, filler)


def test_a_small_peak_at_the_edge_stays_a_question() -> None:
    found = filler_of(*table(fingerprints(-98, 0.75)), SIGNAL_STRENGTH)
    assert (found.judgement, found.level) == (Judgement.ASK, -98)
    assert "--not-heard -98" in question(found, 100)


@pytest.mark.parametrize("seed", range(20))
def test_measured_levels_are_no_filler(seed: int) -> None:
    for heard in (1.0, 0.2):
        found = filler_of(*table(fingerprints(100, heard, seed=seed)), SIGNAL_STRENGTH)
        assert found.judgement is Judgement.NONE


def test_levels_of_a_lost_sign_are_no_filler() -> None:
    assert filler_of(*table(-fingerprints(-100, 0.2)), SIGNAL_STRENGTH).judgement is Judgement.NONE


def scans(levels: list[list[float | None]]) -> pl.DataFrame:
    """Rows of scans; None: the address is not listed."""
    cells = [(i, f"ap{k}", level) for i, row in enumerate(levels) for k, level in enumerate(row) if level is not None]
    rows = pl.DataFrame(cells, ["scan", "bssid", "rssi_dbm"], orient="row")
    return rows.with_row_index("row", 1)


def measured_scans(missing: float | None) -> pl.DataFrame:
    """40 scans of 5 access points, of which a quarter is not heard."""
    rng = np.random.default_rng(4)
    drawn = rng.integers(-94, -50, (40, 5)).astype(float)
    gone = rng.random((40, 5)) < 0.25
    return scans(
        [[missing if off else level for level, off in zip(*row, strict=True)] for row in zip(drawn, gone, strict=True)]
    )


def test_levels_of_what_a_scan_did_not_hear_are_skipped() -> None:
    rows = measured_scans(-100.0)
    kept, (finding,) = without_filler(rows, "bssid", "wifi.csv")
    assert kept.height == measured_scans(None).height == rows.height - finding.count
    assert finding.kind == "unstated_filler"
    assert "-100 is the most frequent level" in finding.message


@pytest.mark.parametrize("level", [None, -60.0], ids=["not listed", "a middle level"])
def test_levels_of_scans_that_may_be_measured_are_kept(level: float | None) -> None:
    rows = measured_scans(level)
    assert without_filler(rows, "bssid", "wifi.csv")[0].equals(rows)
