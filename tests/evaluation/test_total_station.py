from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.evaluation.maps import straight_walk
from vislam2tag.core.similarity import Similarity2
from vislam2tag.core.tracks import Landmarks
from vislam2tag.errors import SurveyError
from vislam2tag.evaluation.total_station import (
    StationTrack,
    clock_offset,
    read_station_track,
    station_errors,
    station_frame,
)

BCS_T_STATION = Similarity2(np.exp(0.7j), 3 - 2j)
CLOCK_NS = 1_642_000_000_000_000_000


def landmarks() -> Landmarks:
    ids = ("9", "10", "9", "10")
    unknown = np.full(4, np.nan)
    position = np.array([[0.0, 0.0], [8.0, 0.0], [50.0, 5.0], [60.0, 5.0]])
    return Landmarks(ids, np.array([4, 4, 1, 1]), position, np.zeros((4, 2, 2)), unknown, unknown, unknown)


def seen_by_station(seconds: np.ndarray[tuple[int], np.dtype[np.float64]], delay_s: float = 0.0) -> StationTrack:
    time_ns = CLOCK_NS + ((1.0 + seconds + delay_s) * 1e9).astype(np.int64)
    plane = np.column_stack((seconds, 0.8 * np.sin(seconds)))
    return StationTrack(time_ns, BCS_T_STATION.inverse @ plane)


def test_reads_the_stations_file(tmp_path: Path) -> None:
    path = tmp_path / "tachy.csv"
    path.write_text("time;X;Y\n2022-01-14 16:01:04.250;1.5;-2\n2022-01-14 16:01:04.350;1.6;-2\n")
    track = read_station_track(path)
    assert np.diff(track.time_ns).tolist() == [100_000_000]
    assert track.time_ns[0] == np.datetime64("2022-01-14T16:01:04.250", "ns").astype(np.int64)
    np.testing.assert_array_equal(track.position[0], [1.5, -2])


@pytest.mark.parametrize("content", ["", "time,X,Y\n1,2,3\n", "time;X;Y\nnoon;1;2\n"])
def test_another_file_is_refused(tmp_path: Path, content: str) -> None:
    path = tmp_path / "tachy.csv"
    path.write_text(content)
    with pytest.raises(SurveyError, match=r"tachy\.csv: expected"):
        read_station_track(path)


def test_frame_from_the_shots_of_landmarks_10_and_9() -> None:
    shots = BCS_T_STATION.inverse @ np.array([[1.0, 1.0], [8.0, 0.0], [0.0, 0.0]])
    frame = station_frame(StationTrack(np.arange(3), shots), landmarks(), 4)
    assert frame.a == pytest.approx(BCS_T_STATION.a)
    assert frame.b == pytest.approx(BCS_T_STATION.b)


def test_frame_needs_landmarks_and_shots() -> None:
    with pytest.raises(SurveyError, match="landmarks 10 and 9"):
        station_frame(StationTrack(np.arange(3), np.zeros((3, 2))), landmarks(), 2)
    with pytest.raises(SurveyError, match="landmarks 10 and 9"):
        station_frame(StationTrack(np.arange(1), np.zeros((1, 2))), landmarks(), 4)


def test_errors_with_the_right_clock() -> None:
    walk = straight_walk(shift=(0.0, 0.3))
    seconds = np.arange(1.0, 9.0, 0.5)
    track = StationTrack(
        CLOCK_NS + ((1 + seconds) * 1e9).astype(np.int64),
        BCS_T_STATION.inverse @ np.column_stack((seconds, 0 * seconds)),
    )
    np.testing.assert_allclose(station_errors(walk, track, BCS_T_STATION, CLOCK_NS), 0.3, atol=1e-6)
    assert np.isnan(station_errors(walk, track, BCS_T_STATION, CLOCK_NS + 10**12)).all()


def test_clock_offset_is_found_for_all_walks_of_a_device() -> None:
    seconds = np.arange(0.5, 9.5, 0.1)
    walks = [(straight_walk(), seen_by_station(seconds, 4.23)), (straight_walk(), seen_by_station(seconds[20:], 4.23))]
    found = clock_offset(walks, BCS_T_STATION)
    assert (found - CLOCK_NS) / 1e9 == pytest.approx(4.23, abs=0.02)
