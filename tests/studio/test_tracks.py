from __future__ import annotations

import numpy as np
import polars as pl
import pytest

from vislam2tag.core.status import STATUS_LABELS, Status
from vislam2tag.studio.outputs import Track, arrow, overview, track_of, window
from vislam2tag.studio.series import Series, series_columns, thinned

SECOND_NS = 1_000_000_000
FRAMES = 100


def made_track(**changed: list[object]) -> Track:
    """A walk along x at one metre a second, ten frames a second, the camera looking along y."""
    half = 0.5**0.5
    columns: dict[str, object] = {
        "time_ns": [5 * SECOND_NS + frame * SECOND_NS // 10 for frame in range(FRAMES)],
        "floor": [1] * FRAMES,
        "x": [frame / 10 for frame in range(FRAMES)],
        **{name: [1.0] * FRAMES for name in ("y", "z", "sigma", "cov_xx", "cov_xy", "cov_yy")},
        "qx": [half] * FRAMES,
        "qy": [0.0] * FRAMES,
        "qz": [0.0] * FRAMES,
        "qw": [half] * FRAMES,
        "status": ["ok"] * FRAMES,
    }
    return track_of(pl.DataFrame({**columns, **changed}), 5 * SECOND_NS)


def test_times_speed_and_heading() -> None:
    columns = made_track().columns
    assert columns["t"][[0, -1]] == pytest.approx([0.0, 9.9])
    assert columns["speed"] == pytest.approx(np.ones(FRAMES), abs=1e-3)
    assert columns["heading"] == pytest.approx(np.full(FRAMES, np.pi / 2), abs=1e-3)
    assert set(columns["path"]) == {0}


def test_paths_break_at_floors_gaps_and_lost_frames_but_not_at_frames_recorded_twice() -> None:
    status = ["ok"] * FRAMES
    status[20:25] = ["tracking_lost"] * 5
    status[50] = "duplicate"
    time_ns = [frame * SECOND_NS // 10 + (frame >= 80) * 2 * SECOND_NS for frame in range(FRAMES)]
    floor = [1 if frame < 60 else 2 for frame in range(FRAMES)]
    track = made_track(status=list(status), time_ns=list(time_ns), floor=list(floor))
    path = track.columns["path"]
    assert [int(path[at]) for at in (0, 19, 25, 59, 60, 79, 80, 99)] == [0, 0, 1, 1, 2, 2, 3, 3]
    assert STATUS_LABELS[int(track.columns["status"][50])] == Status.DUPLICATE.label
    assert np.isnan(track.columns["speed"][22])


def test_a_thinned_track_keeps_both_ends_of_each_path() -> None:
    status = ["ok"] * FRAMES
    status[41:43] = ["break"] * 2
    thin = made_track(status=list(status)).thinned(30)
    assert {0, 40, 43, 99} <= set(thin.columns["frame"].tolist())
    assert len(thin) < 10
    assert len(made_track(status=["no_mapping"] * FRAMES).thinned(30)) == 0


def test_a_window_holds_the_frames_in_it_and_numbers_paths_on() -> None:
    found, stride = window([(3, made_track()), (7, made_track())], 1, (2.0, 4.0, 0.0, 2.0))
    rows = pl.read_ipc_stream(found)
    assert stride == 1
    assert rows.group_by("session", maintain_order=True).len().rows() == [(3, 21), (7, 21)]
    assert rows["path"].unique().sort().to_list() == [0, 1]
    assert len(pl.read_ipc_stream(window([(0, made_track())], 2, (2.0, 4.0, 0.0, 2.0))[0])) == 0
    assert len(pl.read_ipc_stream(arrow([], ("t",)))) == 0
    assert len(pl.DataFrame(dict(overview([(0, made_track())], FRAMES)[0]))) == FRAMES


def test_a_path_that_leaves_a_window_ends_there() -> None:
    away = made_track(x=[abs(frame - 50) / 10 for frame in range(FRAMES)])
    there = pl.read_ipc_stream(window([(0, away)], 1, (3.0, 9.0, 0.0, 2.0))[0])
    assert there.group_by("path", maintain_order=True).len().rows() == [(0, 21), (1, 20)]
    few, stride = window([(0, away)], 1, (3.0, 9.0, 0.0, 2.0), most=10)
    assert (stride, len(pl.read_ipc_stream(few))) == (5, 9)


def test_thinned_charts_keep_extremes() -> None:
    t = np.linspace(0, 100, 10_001)
    v = np.sin(t)
    v[1234], v[8765] = 9.0, -7.0
    kept_t, kept_v = thinned((t, v), 100)
    assert len(kept_t) <= 100
    assert (kept_v.max(), kept_v.min()) == (9.0, -7.0)
    assert (np.diff(kept_t) > 0).all()
    v[:5000] = np.nan
    assert np.isfinite(thinned((t, v), 100)[1]).all()


def test_charts_of_a_span_as_arrow() -> None:
    points = (np.arange(10.0), np.arange(10.0))
    rows = pl.DataFrame(dict(series_columns({Series.SIGMA: points, Series.SPEED: points}, 100, (2.0, 5.0))))
    assert rows.schema == {"series": pl.UInt8, "t": pl.Float32, "v": pl.Float32}
    assert rows["series"].to_list() == [0] * 4 + [3] * 4
    assert rows["t"].to_list() == [2.0, 3.0, 4.0, 5.0] * 2
    assert len(pl.DataFrame(dict(series_columns({}, 100, (0.0, 1.0))))) == 0
