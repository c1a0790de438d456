"""What a format does not hold is named with its count, and stands in the documentation."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace
from pathlib import Path

import polars as pl
import pytest

from tests.dataset.factory import small_dataset
from tests.dataset.formats.round_trip import with_split
from vislam2tag.dataset.format_registry import export_formats
from vislam2tag.dataset.schema import SCHEMAS
from vislam2tag.dataset.writing.left_out import (
    DERIVED,
    MANIFEST,
    ONE_SPLIT,
    PLANS,
    SET,
    SPLITS,
    left_out,
    left_out_of_dataset,
)
from vislam2tag.labeling.schemas import SCHEMAS as LABELLED

OF_SET = (MANIFEST, SPLITS, ONE_SPLIT, PLANS)
Schemas = Mapping[str, Mapping[str, object]]
DOCS = Path(__file__).parents[3] / "docs" / "reference" / "exporting.md"
OF_DATASET = {name: each for name, each in export_formats().items() if each.source == "dataset"}
OF_LABELS = {name: each for name, each in export_formats().items() if each.source == "labels"}


def test_columns_without_a_value_are_not_missed() -> None:
    table = pl.LazyFrame({"x": [1.0, None], "user": ["", None], "sigma": [None, None], "z": [None, 2.0]})
    (finding,) = left_out({"fingerprints": table}, {"fingerprints": frozenset({"x"})})
    assert (finding.count, finding.message) == (1, "columns left out of fingerprints: z")
    assert left_out({"fingerprints": table}, {"fingerprints": frozenset({"x", "z"})}) == ()


def test_a_table_without_a_place() -> None:
    (finding,) = left_out({"magnetic": pl.LazyFrame({"x": [1.0, None]})}, {})
    assert (finding.file, finding.count) == ("magnetic", 2)
    assert left_out({"magnetic": pl.LazyFrame({"x": []})}, {}) == ()


def test_what_follows_from_the_rest_is_not_missed() -> None:
    table = pl.LazyFrame({"bssid": ["a"], "strongest_dbm": [-40.0], "ssid": ["b"]})
    (finding,) = left_out({"access_points": table}, {"access_points": frozenset({"bssid"})})
    assert finding.message == "columns left out of access_points: ssid"


def test_the_whole_set() -> None:
    dataset = with_split(small_dataset())
    dataset = replace(dataset, files={"plans/0.png": Path("0.png")})
    holds = {name: frozenset(schema) for name, schema in SCHEMAS.items()}
    messages = [finding.message for finding in left_out_of_dataset(dataset, holds)]
    assert messages == ["left out of the manifest: title", "splits are left out", "plans of the floors are left out"]
    one = {**holds, SET: frozenset({"one split", "manifest", "plans"})}
    assert left_out_of_dataset(dataset, one) == ()
    two = replace(dataset, splits={**dataset.splits, "other": dataset.splits["by_walk"]})
    assert [finding.message for finding in left_out_of_dataset(two, one)] == ["all splits but one are left out"]


@pytest.mark.parametrize(("formats", "schemas"), [(OF_DATASET, SCHEMAS), (OF_LABELS, LABELLED)])
def test_formats_hold_only_what_there_is(
    formats: Mapping[str, object], schemas: Mapping[str, Mapping[str, object]]
) -> None:
    for name in formats:
        for table, columns in export_formats()[name].holds.items():
            assert set(columns) <= set(OF_SET if table == SET else schemas[table]), (name, table)


def test_the_documentation_says_the_same() -> None:
    text = DOCS.read_text(encoding="utf-8")
    for table in (held_table(OF_DATASET, SCHEMAS, (SET, *SCHEMAS)), held_table(OF_LABELS, LABELLED, tuple(LABELLED))):
        assert table in text, f"docs/reference/exporting.md should hold:\n\n{table}"


def held_table(
    formats: Mapping[str, object], schemas: Mapping[str, Mapping[str, object]], tables: tuple[str, ...]
) -> str:
    """The table of formats by fields, as Markdown; columns that no format or every format holds share a row."""
    lines = [f"| | {' | '.join(formats)} |", f"| --- |{' :-: |' * len(formats)}"]
    for table in tables:
        columns = OF_SET if table == SET else schemas[table]
        rows: dict[str, list[str]] = {}
        for column in columns:
            if column not in DERIVED.get(table, frozenset()):
                held = " | ".join("x" if column in _held(name, table) else "" for name in formats)
                rows.setdefault(held, []).append(column)
        lines.append(f"| **{table}** |{' |' * len(formats)}")
        lines += [f"| {', '.join(f'`{column}`' for column in columns)} | {held} |" for held, columns in rows.items()]
    return "\n".join(lines) + "\n"


def _held(name: str, table: str) -> Collection[str]:
    return export_formats()[name].holds.get(table, ())
