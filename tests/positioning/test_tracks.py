"""Tracks from CSV and from process' tables: the same places at the scans' times; holes stay holes."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import polars as pl
import pytest

from vislam2tag.common.errors import DatasetError
from vislam2tag.positioning.radio_scans import RadioScans, scans_from_readings
from vislam2tag.positioning.tracks import Tracks

SECOND = 10**9


def scans_at(seconds: list[float], session: str = "walk") -> RadioScans:
    nothing = np.empty(0, dtype=np.int64)
    scans = scans_from_readings(nothing, nothing.astype(str), np.empty(0), len(seconds))
    time_ns = np.array([int(second * SECOND) for second in seconds])
    return replace(scans, session=np.full(len(seconds), session), time_ns=time_ns)


def test_csv_and_tables_say_the_same(tmp_path: Path) -> None:
    table = pl.DataFrame(
        {
            "time_ns": [SECOND * second for second in (3, 0, 1, 2, 9, 10)],
            "x": [3.0, 0.0, 1.0, None, 9.0, float("nan")],
            "y": [-3.0, 0.0, -1.0, None, 5.0, 1.0],
            "status": ["ok"] * 6,
        }
    )
    (tmp_path / "trajectory").mkdir()
    table.write_parquet(tmp_path / "trajectory" / "walk.parquet")
    table.with_columns(session=pl.lit("walk")).write_csv(tmp_path / "track.csv")
    for source in (tmp_path / "track.csv", tmp_path, tmp_path / "trajectory"):
        found = Tracks(source).at(scans_at([-1, 0.5, 2.5, 5, 9, 9.5]))
        lost = [np.nan, np.nan]
        expected = np.array([lost, [0.5, -0.5], [2.5, -2.5], lost, [9.0, 5.0], lost])
        np.testing.assert_array_equal(found, expected)
        assert np.isnan(Tracks(source).at(scans_at([1.0], "another walk"))).all()


def test_a_track_of_one_sighting_and_of_none(tmp_path: Path) -> None:
    (tmp_path / "track.csv").write_text("session,time_ns,x,y\none,5,1,2\nnone,5,,\n")
    tracks = Tracks(tmp_path / "track.csv")
    assert Tracks(tmp_path / "track.csv").at(scans_at([5e-9, 1], "one"))[0].tolist() == [1, 2]
    assert np.isnan(tracks.at(scans_at([5e-9], "none"))).all()


def test_what_is_no_track_is_told(tmp_path: Path) -> None:
    (tmp_path / "track.csv").write_text("session,time_ns,x\na,5,1\n")
    with pytest.raises(DatasetError, match=r"track\.csv: not a track .*; expected CSV with session, time_ns, x, y"):
        Tracks(tmp_path / "track.csv")
    (tmp_path / "text.csv").write_text("session,time_ns,x,y\na,soon,1,2\n")
    with pytest.raises(DatasetError, match=r"text\.csv: not a track"):
        Tracks(tmp_path / "text.csv")
    with pytest.raises(DatasetError, match=r"absent\.csv: not a track"):
        Tracks(tmp_path / "absent.csv")
    (tmp_path / "empty").mkdir()
    with pytest.raises(DatasetError, match="contains no trajectory"):
        Tracks(tmp_path / "empty")
    pl.DataFrame({"time_ns": [1]}).write_parquet(tmp_path / "empty" / "walk.parquet")
    with pytest.raises(DatasetError, match="cannot read the track of session walk"):
        Tracks(tmp_path / "empty").at(scans_at([1.0]))
    pl.DataFrame({"time_ns": ["then"], "x": [1.0], "y": [1.0]}).write_parquet(tmp_path / "empty" / "walk.parquet")
    with pytest.raises(DatasetError, match="cannot read the track of session walk"):
        Tracks(tmp_path / "empty").at(scans_at([1.0]))
    (tmp_path / "empty" / "walk.parquet").write_bytes(b"PAR1")
    with pytest.raises(DatasetError, match="cannot read the track of session walk"):
        Tracks(tmp_path / "empty").at(scans_at([1.0]))
