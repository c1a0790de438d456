"""Columns by name and content, and ``columns.toml``."""

from __future__ import annotations

from pathlib import Path

import polars as pl
import pytest

from vislam2tag.common.errors import UsageError
from vislam2tag.intake.columns import (
    ColumnNames,
    columns_toml,
    find_columns,
    is_known,
    missing_column,
    plain_name,
    read_columns_file,
    shown,
)

A, B = "02:1a:00:00:00:01", "02:1a:00:00:00:02"


def names_of(columns: list[str], *roles: str) -> dict[str, str]:
    return {role: column.name for role, column in find_columns(columns, roles).items()}


@pytest.mark.parametrize(
    ("name", "role"),
    [
        ("ECoord", "x"),
        ("pos_x", "x"),
        ("Northing", "y"),
        ("LONGITUDE", "longitude"),
        ("lat", "latitude"),
        ("Floor-ID", "floor"),
        ("BUILDINGID", "building"),
        ("BSSID", "address"),
        ("RSSI [dBm]", "level"),
        ("Time (s)", "time"),
        ("Phone Model", "device"),
        ("Freq. (MHz)", "frequency"),
        ("Gebäude", "building"),
    ],
)
def test_usual_names(name: str, role: str) -> None:
    assert names_of(["foo", name, "bar"], role) == {role: name}
    assert is_known(name)


def test_the_first_known_name_counts_and_a_column_has_one_role() -> None:
    assert names_of(["pos_x", "x", "y"], "x", "y") == {"x": "x", "y": "y"}
    assert names_of(["time", "timestamp"], "time") == {"time": "time"}
    assert names_of(["foo"], "x") == {}


def test_units_in_names() -> None:
    found = find_columns(["x_ft", "time_ms"], ("x", "time"))
    assert found["x"].metres == pytest.approx(0.3048)
    assert found["time"].unit == "ms"


def test_given_names_count_first_and_empty_ones_mean_no_column() -> None:
    found = find_columns(["x", "y", "foo"], ("x", "y"), {"x": "foo", "y": ""})
    assert {role: column.name for role, column in found.items()} == {"x": "foo"}


def test_a_given_name_that_does_not_exist() -> None:
    with pytest.raises(UsageError, match=r'x = "foobar": there is no such column \(the closest name is foo\); found'):
        find_columns(["x", "foo"], ("x",), {"x": "foobar"})


def test_addresses_are_recognised_by_content() -> None:
    sample = pl.DataFrame({"who": [A, B], "value": ["1", "2"]})
    found = find_columns(sample.columns, ("address",), sample=sample)
    assert (found["address"].name, found["address"].why) == ("who", "its addresses")
    both = sample.with_columns(other="who")
    assert not find_columns(both.columns, ("address",), sample=both)
    assert not find_columns(sample.columns, ("address",), {"address": ""}, sample)


def test_messages_name_found_and_expected_columns() -> None:
    said = missing_column(["a", "b"], ["x", "level"])
    assert said.startswith("found the columns a, b; expected for x one of x, ")
    assert said.endswith('name the column in columns.toml: x = "NAME", level = "NAME"')
    assert shown([f"c{number}" for number in range(20)]).endswith("c11, ... (20 columns)")


def test_plain_names() -> None:
    assert plain_name("Länge (m)") == "längem"


def test_columns_file_is_read_as_written(tmp_path: Path) -> None:
    names = ColumnNames(
        x='my "x"',
        y="",
        access_points=("AP1", "Büro"),
        not_heard=-128.0,
        levels=((0.0, -100.0), (100.0, -50.0)),
        cell="location",
        cell_m=2.5,
        origin=(49.5, 11.0),
        zone="Europe/Berlin",
    )
    path = tmp_path / "columns.toml"
    path.write_text(columns_toml(names), encoding="utf-8")
    assert read_columns_file(path) == names
    assert names.named == {"x": 'my "x"', "y": "", "cell": "location"}


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (None, "no such file"),
        ("x = 3\n", r"columns\.toml"),
        ('xx = "a"\n', "xx"),
        ("cell_m = -1.0\n", "cell_m"),
        ('x = "a', r"columns\.toml"),
    ],
)
def test_wrong_columns_files(tmp_path: Path, text: str | None, said: str) -> None:
    path = tmp_path / "columns.toml"
    if text is not None:
        path.write_text(text)
    with pytest.raises(UsageError, match=said):
        read_columns_file(path)


def test_length_units() -> None:
    assert ColumnNames().metres is None
    assert ColumnNames(length_unit="cm").metres == pytest.approx(0.01)
    with pytest.raises(UsageError, match="length_unit = 'parsec' is unknown"):
        _ = ColumnNames(length_unit="parsec").metres
