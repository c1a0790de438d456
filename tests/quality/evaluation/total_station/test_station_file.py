from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from vislam2tag.common.errors import SurveyError
from vislam2tag.quality.evaluation.total_station.station_file import read_shots, read_station_track


def test_reads_the_stations_file(tmp_path: Path) -> None:
    path = tmp_path / "tachy.csv"
    path.write_text("time;X;Y\n2022-01-14 16:01:04.250;1.5;-2\n2022-01-14 16:01:04.350;1.6;-2\n")
    track = read_station_track(path)
    assert np.diff(track.time_ns).tolist() == [100_000_000]
    assert track.time_ns[0] == np.datetime64("2022-01-14T16:01:04.250", "ns").astype(np.int64)
    np.testing.assert_array_equal(track.position[0], [1.5, -2])
    assert track.left_out == 0


def test_rows_that_cannot_be_used_are_counted(tmp_path: Path) -> None:
    path = tmp_path / "tachy.csv"
    rows = [("04.2", "1;1"), ("04.2", "1;1"), ("04.1", "0;0"), ("04.3", ";2"), ("04.3", "2;2"), ("04.4", "NaN;2")]
    path.write_text("X;Y;time\n" + "".join(f"{xy};2022-01-14 16:01:{second}\n" for second, xy in rows))
    track = read_station_track(path)
    np.testing.assert_array_equal(track.position, [[1, 1], [2, 2]])
    assert track.left_out == 4


@pytest.mark.parametrize(
    "content", ["", "time,X,Y\n1,2,3\n", "time;X;Y\nnoon;1;2\n", "time;X;Y\n2022-01-14 16:01:04;1;2\n"]
)
def test_another_file_is_refused(tmp_path: Path, content: str) -> None:
    path = tmp_path / "tachy.csv"
    path.write_text(content)
    with pytest.raises(SurveyError, match=r"tachy\.csv: expected"):
        read_station_track(path)


def test_a_missing_file_is_said(tmp_path: Path) -> None:
    with pytest.raises(SurveyError, match=r"none\.csv: expected columns"):
        read_shots(tmp_path / "none.csv")
