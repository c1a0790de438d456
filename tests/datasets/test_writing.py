"""What a format does not hold is named with its count, and stands in the documentation.

Training and test parts by split and fold.

Labelled fingerprints in pieces, as matrices, and on the clock of the world.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.datasets.factory import SCANS, small_dataset
from tests.datasets.formats.round_trip import with_split
from vislam2tag.common.errors import DatasetError, UsageError
from vislam2tag.common.findings import Finding
from vislam2tag.common.progress import silent
from vislam2tag.datasets import writing
from vislam2tag.datasets.format_registry import ExportContext, export_formats
from vislam2tag.datasets.model import Dataset
from vislam2tag.datasets.schema import SCHEMAS
from vislam2tag.labeling.tables import SCHEMAS as LABELLED

OF_SET = (writing.MANIFEST, writing.SPLITS, writing.ONE_SPLIT, writing.PLANS)
Schemas = Mapping[str, Mapping[str, object]]
DOCS = Path(__file__).parents[2] / "docs" / "reference" / "exporting.md"
OF_DATASET = {name: each for name, each in export_formats().items() if each.source == "dataset"}
OF_LABELS = {name: each for name, each in export_formats().items() if each.source == "labels"}


def test_columns_without_a_value_are_not_missed() -> None:
    table = pl.LazyFrame({"x": [1.0, None], "user": ["", None], "sigma": [None, None], "z": [None, 2.0]})
    (finding,) = writing.left_out({"fingerprints": table}, {"fingerprints": frozenset({"x"})})
    assert (finding.count, finding.message) == (1, "columns of fingerprints are skipped: z")
    assert writing.left_out({"fingerprints": table}, {"fingerprints": frozenset({"x", "z"})}) == ()


def test_a_table_without_a_place() -> None:
    (finding,) = writing.left_out({"magnetic": pl.LazyFrame({"x": [1.0, None]})}, {})
    assert (finding.file, finding.count) == ("magnetic", 2)
    assert writing.left_out({"magnetic": pl.LazyFrame({"x": []})}, {}) == ()


def test_what_follows_from_the_rest_is_not_missed() -> None:
    table = pl.LazyFrame({"bssid": ["a"], "strongest_dbm": [-40.0], "ssid": ["b"]})
    (finding,) = writing.left_out({"access_points": table}, {"access_points": frozenset({"bssid"})})
    assert finding.message == "columns of access_points are skipped: ssid"


def test_the_whole_set() -> None:
    dataset = with_split(small_dataset())
    dataset = replace(dataset, files={"plans/0.png": Path("0.png")})
    holds = {name: frozenset(schema) for name, schema in SCHEMAS.items()}
    messages = [finding.message for finding in writing.left_out_of_dataset(dataset, holds)]
    assert messages == ["skipped fields of the manifest: title", "splits are skipped", "floor plans are skipped"]
    one = {**holds, writing.SET: frozenset({"one split", "manifest", "plans"})}
    assert writing.left_out_of_dataset(dataset, one) == ()
    two = replace(dataset, splits={**dataset.splits, "other": dataset.splits["by_walk"]})
    assert [finding.message for finding in writing.left_out_of_dataset(two, one)] == ["all splits but one are skipped"]


@pytest.mark.parametrize(("formats", "schemas"), [(OF_DATASET, SCHEMAS), (OF_LABELS, LABELLED)])
def test_formats_hold_only_what_there_is(
    formats: Mapping[str, object], schemas: Mapping[str, Mapping[str, object]]
) -> None:
    for name in formats:
        for table, columns in export_formats()[name].holds.items():
            assert set(columns) <= set(OF_SET if table == writing.SET else schemas[table]), (name, table)


def test_the_documentation_says_the_same() -> None:
    text = DOCS.read_text(encoding="utf-8")
    for table in (
        held_table(OF_DATASET, SCHEMAS, (writing.SET, *SCHEMAS)),
        held_table(OF_LABELS, LABELLED, tuple(LABELLED)),
    ):
        assert table in text, f"docs/reference/exporting.md should hold:\n\n{table}"


def held_table(
    formats: Mapping[str, object], schemas: Mapping[str, Mapping[str, object]], tables: tuple[str, ...]
) -> str:
    """The table of columns and the formats that have them, as Markdown; columns of the same formats share a row."""
    lines = ["| table | columns | formats |", "| --- | --- | --- |"]
    for table in tables:
        columns = [
            column
            for column in (OF_SET if table == writing.SET else schemas[table])
            if column not in writing.DERIVED.get(table, frozenset())
        ]
        rows: dict[str, list[str]] = {}
        for column in columns:
            having = [name for name in formats if column in _held(name, table)]
            rows.setdefault("all" if len(having) == len(formats) else ", ".join(having) or "none", []).append(column)
        for at, (shared, named) in enumerate(rows.items()):
            listed = "all" if len(rows) == 1 else ", ".join(f"`{column}`" for column in named)
            lines.append(f"| {table if at == 0 else ''} | {listed} | {shared} |")
    return "\n".join(lines) + "\n"


def _held(name: str, table: str) -> Collection[str]:
    return export_formats()[name].holds.get(table, ())


def counts(parts: pl.DataFrame) -> dict[str, int]:
    return dict(parts.group_by("part").len().rows())


def test_the_official_split_counts_where_none_is_chosen() -> None:
    parts, findings = writing.train_test_assignment(with_split(small_dataset(), kind="official"), ExportContext())
    assert counts(parts) == {"train": 3 * (SCANS - 1), "test": SCANS - 1}
    assert findings == ()


def test_no_choice_among_others_is_told() -> None:
    parts, findings = writing.train_test_assignment(with_split(small_dataset()), ExportContext())
    assert counts(parts) == {"train": 4 * SCANS}
    assert findings[0].message.endswith("everything is training data; available splits: by_walk")


@pytest.mark.parametrize(
    ("split", "fold", "said"),
    [
        ("nope", None, "--split nope: the data set has no such split; its splits: by_walk"),
        ("by_walk", "nope", "--fold nope: split by_walk has no such fold; its folds: floor_0.Galaxy.walk/x"),
        (None, "nope", "--fold nope: name the split of this fold with --split"),
    ],
)
def test_what_is_not_there(split: str | None, fold: str | None, said: str) -> None:
    with pytest.raises(UsageError, match=said):
        writing.train_test_assignment(with_split(small_dataset()), ExportContext(split=split, fold=fold))


def test_a_set_without_splits() -> None:
    with pytest.raises(UsageError, match="no such split; its splits: none"):
        writing.train_test_assignment(small_dataset(), ExportContext(split="random"))


def test_sessions_in_pieces_and_progress(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("vislam2tag.datasets.writing._CELLS_AT_ONCE", 30)
    dataset = small_dataset()
    steps: list[tuple[str, int]] = []
    rows, _ = writing.labelled_fingerprints(dataset)
    transmitters = dataset.access_points.collect()["bssid"]
    pieces = [
        (each["scan_id"].to_list(), levels)
        for tables in writing.labelled_by_session(dataset, rows, lambda session, total: steps.append((session, total)))
        for each, levels in writing.matrices(tables, transmitters, 100.0)
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
    rows, _ = writing.labelled_fingerprints(doubled)
    transmitters = dataset.access_points.collect()["bssid"]
    once, twice = (np.concatenate(_matrices(each, rows, transmitters)) for each in (dataset, doubled))
    heard = once != 100.0
    assert twice[heard] == pytest.approx(once[heard] - 5, abs=1e-4)
    assert (twice[~heard] == 100.0).all()
    (finding,) = losses(doubled, rows, 100.0)
    assert (finding.kind, finding.count) == ("readings_averaged", int(heard.sum()))


def _matrices(dataset: Dataset, rows: pl.LazyFrame, transmitters: pl.Series) -> list[np.ndarray]:
    pieces = (
        writing.matrices(tables, transmitters, 100.0) for tables in writing.labelled_by_session(dataset, rows, silent)
    )
    return [levels for piece in pieces for _, levels in piece]


def losses(dataset: Dataset, rows: pl.LazyFrame, not_heard: float) -> tuple[Finding, ...]:
    sessions = writing.labelled_by_session(dataset, rows, silent)
    lost = np.sum([writing.matrix_losses(tables.readings, not_heard) for tables in sessions], axis=0)
    return writing.matrix_loss_findings(lost, not_heard)


def test_levels_that_a_matrix_cannot_hold_are_counted() -> None:
    dataset = small_dataset(unlabelled=0)
    level = pl.when(pl.col("bssid").str.ends_with("00")).then(None).otherwise(pl.lit(-110.0, pl.Float32))
    odd = replace(dataset, tables={**dataset.tables, "readings": dataset.readings.with_columns(rssi_dbm=level)})
    kinds = {finding.kind: finding.count for finding in losses(odd, writing.labelled_fingerprints(odd)[0], -110.0)}
    total = dataset.readings.collect().height
    assert kinds == {"unknown_levels_left_out": 4 * SCANS * 2, "levels_left_out": total - 4 * SCANS * 2}


def test_only_one_technology() -> None:
    dataset = small_dataset()
    with pytest.raises(DatasetError, match="no ble fingerprint has a position"):
        writing.labelled_fingerprints(dataset, "ble")
    kind = pl.when(pl.col("device") == "Pixel").then(pl.lit("ble")).otherwise("technology").alias("technology")
    both = replace(dataset, tables={**dataset.tables, "fingerprints": dataset.fingerprints.with_columns(kind)})
    rows, findings = writing.labelled_fingerprints(both, "wifi")
    assert rows.collect().height == 2 * (SCANS - 1)
    assert {finding.kind: finding.count for finding in findings} == {
        "unlabelled_left_out": 2,
        "technology_left_out": 2 * SCANS,
    }


def test_formats_that_cannot_say_how_sure_take_only_what_is() -> None:
    dataset = small_dataset(unlabelled=0)
    status = pl.when(pl.col("x") < 6).then(pl.lit("uncertain")).otherwise("status").alias("status")
    unsure = replace(dataset, tables={**dataset.tables, "fingerprints": dataset.fingerprints.with_columns(status)})
    assert writing.labelled_fingerprints(unsure)[0].collect().height == 4 * SCANS
    rows, (finding,) = writing.labelled_fingerprints(unsure, uncertain=False)
    assert rows.collect().height == 4 * (SCANS - 1)
    assert (finding.kind, finding.count) == ("uncertain_left_out", 4)


def on_clock(clock: str) -> Dataset:
    dataset = small_dataset()
    return replace(dataset, info=dataset.info.model_copy(update={"clock": clock}))


def test_times_of_day() -> None:
    boot = writing.with_unix_time(on_clock("boot")).collect()["unix_ns"]
    assert (boot[0], boot[1]) == (1_772_323_200_000_000_000, 1_772_323_203_000_000_000)  # 2026-03-01, 3 s later
    assert writing.with_unix_time(on_clock("unix")).collect()["unix_ns"][1] == 1_003_000_000_000
    assert writing.with_unix_time(on_clock("none")).collect()["unix_ns"].null_count() == 4 * SCANS


@given(st.integers(0, 4_000_000_000_000_000_000))
def test_no_digit_of_a_time_is_lost(time_ns: int) -> None:
    text = pl.DataFrame({"t": [time_ns]}).select(writing.seconds_text(pl.col("t"))).item()
    whole, _, rest = text.partition(".")
    assert int(whole) * 1_000_000_000 + int(rest.ljust(9, "0") or 0) == time_ns
    assert not rest.endswith("0")
