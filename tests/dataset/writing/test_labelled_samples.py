"""Labelled fingerprints in pieces, as matrices, and on the clock of the world."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import polars as pl
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.dataset.factory import SCANS, small_dataset
from vislam2tag.common.errors import DatasetError
from vislam2tag.common.findings import Finding
from vislam2tag.common.progress import silent
from vislam2tag.dataset.model import Dataset
from vislam2tag.dataset.writing.labelled_samples import (
    MatrixLosses,
    labelled_by_session,
    labelled_fingerprints,
    matrices,
    seconds_text,
    with_unix_time,
)


def test_sessions_in_pieces_and_progress(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("vislam2tag.dataset.writing.labelled_samples._CELLS_AT_ONCE", 30)
    dataset = small_dataset()
    steps: list[tuple[str, int]] = []
    rows, _ = labelled_fingerprints(dataset)
    transmitters = dataset.access_points.collect()["bssid"]
    pieces = [
        (each["scan_id"].to_list(), levels)
        for tables in labelled_by_session(dataset, rows, lambda session, total: steps.append((session, total)))
        for each, levels in matrices(tables, transmitters, 100.0)
    ]
    assert [total for _, total in steps] == [4] * 4
    assert max(len(ids) for ids, _ in pieces) == 3
    assert [scan for ids, _ in pieces for scan in ids] == rows.collect()["scan_id"].to_list()
    heard = sum(int((levels != 100.0).sum()) for _, levels in pieces)
    assert heard == dataset.readings.filter(pl.col("x").is_not_null()).collect().height


def test_several_readings_of_a_transmitter_become_their_mean() -> None:
    dataset = small_dataset()
    again = pl.concat([dataset.readings, dataset.readings.with_columns(pl.col("rssi_dbm") - 10)])
    doubled = replace(dataset, tables={**dataset.tables, "readings": again})
    rows, _ = labelled_fingerprints(doubled)
    transmitters = dataset.access_points.collect()["bssid"]
    once, twice = (np.concatenate(_matrices(each, rows, transmitters)) for each in (dataset, doubled))
    heard = once != 100.0
    assert twice[heard] == pytest.approx(once[heard] - 5, abs=1e-4)
    assert (twice[~heard] == 100.0).all()
    (finding,) = losses(doubled, rows, 100.0)
    assert (finding.kind, finding.count) == ("readings_averaged", int(heard.sum()))


def _matrices(dataset: Dataset, rows: pl.LazyFrame, transmitters: pl.Series) -> list[np.ndarray]:
    pieces = (matrices(tables, transmitters, 100.0) for tables in labelled_by_session(dataset, rows, silent))
    return [levels for piece in pieces for _, levels in piece]


def losses(dataset: Dataset, rows: pl.LazyFrame, not_heard: float) -> tuple[Finding, ...]:
    counted = MatrixLosses(not_heard)
    for tables in labelled_by_session(dataset, rows, silent):
        counted.add(tables.readings)
    return counted.findings


def test_levels_that_a_matrix_cannot_hold_are_counted() -> None:
    dataset = small_dataset(unlabelled=0)
    level = pl.when(pl.col("bssid").str.ends_with("00")).then(None).otherwise(pl.lit(-110.0, pl.Float32))
    odd = replace(dataset, tables={**dataset.tables, "readings": dataset.readings.with_columns(rssi_dbm=level)})
    kinds = {finding.kind: finding.count for finding in losses(odd, labelled_fingerprints(odd)[0], -110.0)}
    total = dataset.readings.collect().height
    assert kinds == {"unknown_levels_left_out": 4 * SCANS * 2, "levels_left_out": total - 4 * SCANS * 2}


def test_only_one_technology() -> None:
    dataset = small_dataset()
    with pytest.raises(DatasetError, match="no ble fingerprint of it has a position"):
        labelled_fingerprints(dataset, "ble")
    kind = pl.when(pl.col("device") == "Pixel").then(pl.lit("ble")).otherwise("technology").alias("technology")
    both = replace(dataset, tables={**dataset.tables, "fingerprints": dataset.fingerprints.with_columns(kind)})
    rows, findings = labelled_fingerprints(both, "wifi")
    assert rows.collect().height == 2 * (SCANS - 1)
    assert {finding.kind: finding.count for finding in findings} == {
        "unlabelled_left_out": 2,
        "technology_left_out": 2 * SCANS,
    }


def test_formats_that_cannot_say_how_sure_take_only_what_is() -> None:
    dataset = small_dataset(unlabelled=0)
    status = pl.when(pl.col("x") < 6).then(pl.lit("uncertain")).otherwise("status").alias("status")
    unsure = replace(dataset, tables={**dataset.tables, "fingerprints": dataset.fingerprints.with_columns(status)})
    assert labelled_fingerprints(unsure)[0].collect().height == 4 * SCANS
    rows, (finding,) = labelled_fingerprints(unsure, uncertain=False)
    assert rows.collect().height == 4 * (SCANS - 1)
    assert (finding.kind, finding.count) == ("uncertain_left_out", 4)


def on_clock(clock: str) -> Dataset:
    dataset = small_dataset()
    return replace(dataset, info=dataset.info.model_copy(update={"clock": clock}))


def test_times_of_day() -> None:
    boot = with_unix_time(on_clock("boot")).collect()["unix_ns"]
    assert (boot[0], boot[1]) == (1_772_323_200_000_000_000, 1_772_323_203_000_000_000)  # 2026-03-01, 3 s later
    assert with_unix_time(on_clock("unix")).collect()["unix_ns"][1] == 1_003_000_000_000
    assert with_unix_time(on_clock("none")).collect()["unix_ns"].null_count() == 4 * SCANS


@given(st.integers(0, 4_000_000_000_000_000_000))
def test_no_digit_of_a_time_is_lost(time_ns: int) -> None:
    text = pl.DataFrame({"t": [time_ns]}).select(seconds_text(pl.col("t"))).item()
    whole, _, rest = text.partition(".")
    assert int(whole) * 1_000_000_000 + int(rest.ljust(9, "0") or 0) == time_ns
    assert not rest.endswith("0")
