from __future__ import annotations

from itertools import product
from pathlib import Path

import polars as pl
import pytest

from tests.sessions.raw import clean_files, count_lines, frame_ns, kinds, read_files, to_bytes
from vislam2tag.intake.readings import admitted
from vislam2tag.sessions.tables.ble_table import ble_findings, mark_repeated_ble, parse_ble
from vislam2tag.sessions.tables.raw_table import RawTable

UUID = "32ff6e37-9a5b-457c-a5f3-bf91dfa4426e"
SENDER = "c2:ca:b5:46:df:bb"


def parse(*lines: str) -> RawTable:
    return parse_ble(to_bytes(list(lines)), "ble.csv")


def test_columns_units_and_types() -> None:
    table = parse(f"41001830793000; {SENDER}; desk 3; -73; {UUID.upper()}; 1; 65535")
    assert table.rows.row(0, named=True) == {
        "row": 1,
        "time_ns": 41_001_830_793_000,
        "address": SENDER,
        "name": "desk 3",
        "uuid": UUID,
        "major": 1,
        "minor": 65535,
        "rssi_dbm": -73.0,
    }
    assert table.rows.schema["rssi_dbm"] == pl.Float32
    assert table.rows.schema["major"] == pl.Int32
    assert not table.findings


def test_a_name_may_be_anything() -> None:
    names = ["", " ", "a;b", ";", "x; -70", "5; aa; y; -60", "Bücher 📚", "\ufffd", "A, B"]
    for name, identity, separator in product(names, ["", f"; {UUID}; 3; 4", "; ; ; "], ["; ", ";"]):
        line = f"7; {SENDER}; NAME; -60{identity}".replace("; ", separator).replace("NAME", name)
        for newline in ("\n", "\r\n"):
            table = parse_ble(f"{line}{newline}".encode(), "ble.csv")
            minor = 4 if UUID in identity else None
            assert table.rows.select("name", "rssi_dbm", "minor").rows() == [(name, -60.0, minor)], line
            assert not table.findings


@pytest.mark.parametrize(
    "line",
    [
        "",
        "7",
        f"7; {SENDER}; name",
        f"-7; {SENDER}; name; -60",
        f"7.5; {SENDER}; name; -60",
        f"7; {SENDER}; name; loud",
        f"7; {SENDER}; name; -60; {UUID}; 3; ",
        f"7; {SENDER}; name; -60; {UUID}; 3; 65536",
        f"{2**63}; {SENDER}; name; -60",
    ],
)
def test_other_lines_are_counted_and_left_out(line: str) -> None:
    table = parse(f"1; {SENDER}; a; -50", line, f"2; {SENDER}; a; -51")
    assert table.rows["row"].to_list() == [1, 3]
    assert [(finding.kind, finding.lines) for finding in table.findings] == [("malformed_lines", (2,))]
    assert table.lines == 3


def test_levels_that_no_controller_reports_become_null() -> None:
    table = parse(*(f"{n}; {SENDER}; a; {level}" for n, level in enumerate(("127", "-128", "NaN", "20", "-60,5"))))
    rows, findings = admitted(table.rows, "address", "ble.csv")
    assert rows["rssi_dbm"].to_list() == [None, None, None, None, -60.5]
    assert [(finding.kind, finding.lines) for finding in findings] == [("absurd_levels", (1, 2, 3, 4))]


def test_undecodable_names_and_cut_lines() -> None:
    data = f"1; {SENDER}; ".encode() + b"\xff; -50\n" + f"2; {SENDER}; a; -5".encode()[:-4]
    table = parse_ble(data, "ble.csv")
    assert table.rows["name"].to_list() == ["\ufffd"]
    assert {finding.kind for finding in table.findings} == {"undecodable_text", "partial_last_line"}
    assert table.lines == count_lines(data)


def test_an_advertisement_counts_once() -> None:
    rows = mark_repeated_ble(
        parse(
            f"1; {SENDER}; a; -50",
            f"1; {SENDER}; a; -52",
            f"2; {SENDER}; a; -50",
            f"1; {SENDER}; a; -50; {UUID}; 1; 1",
            "1; aa; a; -50",
        ).rows
    )
    assert rows["repeated"].to_list() == [False, True, False, False, False]
    assert [(finding.kind, finding.lines) for finding in ble_findings(rows, "ble.csv")] == [("repeated_rows", (2,))]
    assert ble_findings(rows.filter(~pl.col("repeated")), "ble.csv") == []


@pytest.mark.parametrize("name", ["ble.csv", "Ble.csv"])
def test_a_session_has_the_table_only_where_it_was_logged(tmp_path: Path, name: str) -> None:
    lines = [f"{frame_ns(frame)}; {SENDER}; a; -50" for frame in range(5)]
    logged = read_files(tmp_path / "LG" / "with", clean_files() | {name: lines})
    assert len(logged.tables["ble"]) == 5
    assert [(record.name, record.role, record.rows) for record in logged.files if record.role == "ble"] == [
        (name, "ble", 5)
    ]
    assert "ble" not in read_files(tmp_path / "LG" / "without", clean_files()).tables


def test_problems_of_the_file_are_told(tmp_path: Path) -> None:
    other_clock = read_files(tmp_path / "LG" / "a", clean_files() | {"ble.csv": [f"5; {SENDER}; a; -50"]})
    assert kinds(other_clock)["clock_mismatch", "ble.csv"] == 1
    empty = read_files(tmp_path / "LG" / "b", clean_files() | {"ble.csv": []})
    assert kinds(empty)["empty_file", "ble.csv"] == 1
    assert empty.tables["ble"].height == 0
