"""A snapshot of the program's tables shows a difference, and where it is."""

from __future__ import annotations

import json
from pathlib import Path

import polars as pl
import pytest
import snapshot

TABLE = pl.DataFrame({"x": [1.0, 2.0, None], "status": ["ok", "ok", "gap"]})


def digest(folder: Path, table: pl.DataFrame, *, private: bool = False) -> snapshot.Digest:
    (folder / "wifi").mkdir(parents=True)
    table[:2].write_parquet(folder / "wifi" / "walk-1.parquet")
    table[2:].write_parquet(folder / "wifi" / "walk-2.parquet")
    return snapshot.Writer(folder, private=private).outputs("wifi")


def test_the_same_tables_have_the_same_digest(tmp_path: Path) -> None:
    before, after = digest(tmp_path / "a", TABLE), digest(tmp_path / "b", TABLE)
    assert list(snapshot.differences(before, after)) == []
    assert before["wifi/*.parquet"]["rows"] == 3
    assert before["wifi/*.parquet"]["columns"]["x"] | {"hash": ""} == {
        "type": "Float64",
        "nulls": 1,
        "hash": "",
        "sum": 3.0,
        "min": 1.0,
        "max": 2.0,
    }


def test_a_changed_number_is_named_by_table_file_and_column(tmp_path: Path) -> None:
    changed = TABLE.with_columns(x=pl.Series([1.0, 2.5, None]))
    before, after = digest(tmp_path / "a", TABLE), digest(tmp_path / "b", changed)
    column, file = snapshot.differences(before, after)
    assert column == "wifi/*.parquet > columns > x: max 2.0 -> 2.5, sum 3.0 -> 3.5"
    assert file.startswith("wifi/*.parquet > files > wifi/walk-1.parquet: ")


def test_a_difference_beyond_nine_digits_is_found(tmp_path: Path) -> None:
    changed = TABLE.with_columns(x=pl.Series([1.0, 2.0 + 1e-15, None]))
    before, after = digest(tmp_path / "a", TABLE), digest(tmp_path / "b", changed)
    column, _ = snapshot.differences(before, after)
    assert column == "wifi/*.parquet > columns > x: another content or order, the same max, min, nulls, sum, type"


def test_gone_and_new_tables_and_columns_are_named() -> None:
    before = {"labels": {"wifi": {"rows": 1}}, "exit code": 0}
    after = {"labels": {"ble": {"rows": 1}}, "exit code": 1}
    assert list(snapshot.differences(before, after)) == [
        "exit code: 0 -> 1",
        "labels > ble: is new",
        "labels > wifi: is gone",
    ]


def test_times_paths_and_versions_do_not_count(tmp_path: Path) -> None:
    writer = snapshot.Writer(tmp_path, private=False)
    one = {"version": "0.2.0", "took_s": 1.5, "out": f"{tmp_path}/out", "sessions": [{"rows": 3}, {"rows": 4}]}
    assert writer.json([one]) == {"out": "WORK/out", "sessions[].rows": [3, 4]}
    assert writer.text("mapped in 3.2 s") == writer.text("mapped in 14 s")


def test_private_runs_show_no_names(tmp_path: Path) -> None:
    writer = snapshot.Writer(tmp_path, private=True)
    made = json.dumps(
        writer.json([{"ssid": "Cafe-7", "by_device": {"Phone 3": 4}, "note": "no access point is heard"}])
    )
    assert "Cafe" not in made
    assert "Phone" not in made
    assert "no access point is heard" in made
    assert "walk-1" not in json.dumps(digest(tmp_path / "a", TABLE, private=True))


@pytest.mark.parametrize(("changed", "code"), [(1, 0), (2, 1)])
def test_comparing_two_files_says_by_its_exit_code_whether_they_differ(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], changed: int, code: int
) -> None:
    a, b = tmp_path / "a.json", tmp_path / "b.json"
    a.write_text(snapshot.as_text({"rows": 1}))
    b.write_text(snapshot.as_text({"rows": changed}))
    monkeypatch.setattr("sys.argv", ["snapshot.py", "--compare", str(a), str(b)])
    assert snapshot.main() == code
    assert capsys.readouterr().out == ("rows: 1 -> 2\n" if code else "no difference\n")


def test_the_file_is_sorted_and_reads_back() -> None:
    value = {"b": {"hash": "1", "max": 2.0}, "a": ["long " * 30, 1]}
    assert json.loads(snapshot.as_text(value)) == value
    assert snapshot.as_text(value).index('"a"') < snapshot.as_text(value).index('"b"')
