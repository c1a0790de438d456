from __future__ import annotations

import json
from pathlib import Path

import polars as pl
import pytest

from tests.datasets.labelled_rows import wifi
from vislam2tag.common.errors import DatasetError
from vislam2tag.datasets.labelled import is_labelled, open_labelled
from vislam2tag.labeling.results import SessionResult
from vislam2tag.labeling.tables import SCHEMAS

RUN: dict[str, object] = {
    "program": "vislam2tag",
    "survey": "campus",
    "floors": [{"number": 1, "name": "One", "elevation_m": None, "width_m": 60.0, "height_m": 30.0}],
    "settings": {"labels": {"max_sigma_m": "inf"}},
    "versions": {"vislam2tag": "9"},
}


def write_out(folder: Path, run: dict[str, object] | None = None) -> Path:
    (folder / "sessions").mkdir(parents=True)
    (folder / "run.json").write_text(json.dumps(RUN if run is None else run))
    (folder / "summary.json").write_text("{}")
    for slug in ("floor_1.LG.b", "floor_1.LG.a"):
        result = SessionResult(
            slug=slug, fingerprint="f", floor=1, device="LG", session="a", format="published", strategy="", version="9"
        )
        (folder / f"sessions/{slug}.json").write_text(result.model_dump_json())
        (folder / "wifi").mkdir(exist_ok=True)
        wifi({"x": 1.0}).write_parquet(folder / f"wifi/{slug}.parquet")
    return folder


def the_error(folder: Path) -> str:
    with pytest.raises(DatasetError) as caught:
        open_labelled(folder)
    assert str(folder) in str(caught.value)
    return str(caught.value)


def test_what_is_there(tmp_path: Path) -> None:
    out = open_labelled(write_out(tmp_path / "out"))
    assert (out.survey, out.version, out.max_sigma_m) == ("campus", "9", float("inf"))
    assert [floor.number for floor in out.floors] == [1]
    assert [session.slug for session in out.sessions] == ["floor_1.LG.a", "floor_1.LG.b"]
    session = out.sessions[0]
    assert session.result().device == "LG"
    assert session.has("wifi")
    assert not session.has("ble")
    assert session.table("wifi", ("bssid", "x")).rows() == [("a", 1.0)]
    assert session.table("wifi", SCHEMAS["wifi"], pl.col("bssid") == "b").height == 0
    assert session.unknown_columns("wifi") == []


def test_what_a_killed_command_had_moved_aside_is_moved_back(tmp_path: Path) -> None:
    for name, opened in (("a", is_labelled), ("b", open_labelled)):
        out = write_out(tmp_path / name)
        work = tmp_path / f".{name}.vislam2tag"
        work.mkdir()
        out.rename(work / "old")
        assert opened(out)
        assert not work.exists()


def test_folders_that_are_no_output_of_process(tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    assert not is_labelled(tmp_path / "empty")
    assert "not an output folder of `vislam2tag process`" in the_error(tmp_path / "empty")
    assert "not an output folder of `vislam2tag process`" in the_error(tmp_path / "missing")
    assert "vislam2tag process" in the_error(write_out(tmp_path / "check", RUN | {"program": "vislam2tag check"}))
    earlier = {key: value for key, value in RUN.items() if key != "floors"}
    assert "'floors'" in the_error(write_out(tmp_path / "earlier", earlier))
    broken = write_out(tmp_path / "broken")
    (broken / "run.json").write_text("{")
    assert "damaged" in the_error(broken)


def test_a_run_that_has_not_ended_and_one_without_sessions(tmp_path: Path) -> None:
    out = write_out(tmp_path / "out")
    for path in (out / "sessions").iterdir():
        path.unlink()
    assert "no session" in the_error(out)
    (out / "summary.json").unlink()
    assert "has not finished" in the_error(out)


def test_damaged_results_and_tables(tmp_path: Path) -> None:
    session = open_labelled(write_out(tmp_path / "out")).sessions[0]
    table = tmp_path / "out/wifi/floor_1.LG.a.parquet"
    wifi({"x": 1.0}).with_columns(mood=pl.lit("fine"), scan=pl.lit("seven")).drop("ssid").write_parquet(table)
    assert session.unknown_columns("wifi") == ["mood"]
    for column in ("ssid", "scan"):
        with pytest.raises(DatasetError, match=f"column {column} is missing or not"):
            session.table("wifi", (column,))
    table.write_bytes(b"PAR1")
    with pytest.raises(DatasetError, match="cannot be read"):
        session.table("wifi", ("x",))
    with pytest.raises(DatasetError, match="cannot be read"):
        session.table("sensors", ("x",))
    (tmp_path / "out/sessions/floor_1.LG.a.json").write_text("{}")
    with pytest.raises(DatasetError, match="cannot be read"):
        session.result()
