"""What the page is given to look at, by a studio that runs.

What lacks of a floor, as the map draws it; walks that phones hand over: tests/studio/test_from_plan_to_link.py.

What the studio refuses to work on.
"""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest
from PIL import Image

from tests.studio.running import Page
from vislam2tag.common.errors import UsageError
from vislam2tag.core.status import STATUS_LABELS, Status
from vislam2tag.settings import Settings
from vislam2tag.studio.layers.walkable import outlines
from vislam2tag.studio.outputs import Track, arrow, overview, track_of, window
from vislam2tag.studio.session_view import Series, series_columns, thinned
from vislam2tag.studio.workspace import Workspace


def test_the_survey_with_its_floors_and_landmarks(page: Page, faults: dict[str, Any]) -> None:
    survey = page.get("/api/survey")
    assert [floor["number"] for floor in survey["floors"]] == [1, 2]
    assert {(mark["floor"], mark["id"]) for mark in survey["landmarks"]} >= {(1, "11"), (2, "11")}
    mark = next(mark for mark in survey["landmarks"] if (mark["floor"], mark["id"]) == (1, faults["mis_surveyed"]))
    assert mark["surveyed"]
    assert mark["corrected"] is None
    assert mark["seen_in"] >= 3
    assert {status["label"]: status["code"] for status in survey["statuses"]} == {s.label: int(s) for s in Status}
    plan = page.client.get(survey["floors"][0]["plan"] + "&side=256")
    left, right, low, high = survey["floors"][0]["extent_m"]
    picture = Image.open(io.BytesIO(plan.content))
    assert max(picture.size) == 256
    assert abs(picture.width / picture.height - (right - left) / (high - low)) < 0.05


def test_every_session_is_listed_and_drawn(page: Page, faulty: Path) -> None:
    sessions = page.get("/api/sessions")["sessions"]
    assert [session["index"] for session in sessions] == list(range(12))
    assert all(session["labelled"] and not session["stale"] for session in sessions)
    overview = page.columns("/api/tracks")
    assert overview["session"].unique().sort().to_list() == list(range(12))
    assert overview.schema == {
        "session": pl.UInt16,
        "frame": pl.UInt32,
        "t": pl.Float32,
        "floor": pl.Int16,
        **dict.fromkeys(("x", "y", "z"), pl.Float32),
        "status": pl.UInt8,
        **dict.fromkeys(("sigma", "speed"), pl.Float32),
        "path": pl.UInt32,
    }
    positioned = {Status.OK.label, Status.UNCERTAIN.label}
    frames = sum(count for s in sessions for label, count in s["frames"].items() if label in positioned)
    assert len(overview) == frames  # few enough to be drawn whole
    table = pl.read_parquet(faulty / "labels" / "trajectory" / f"{sessions[3]['slug']}.parquet")
    own = overview.filter(session=3)
    assert np.allclose(own["x"], table["x"].drop_nulls(), atol=1e-4)
    assert page.client.get("/api/tracks", headers={"If-None-Match": page_etag(page)}).status_code == 304


def page_etag(page: Page) -> str:
    return page.client.get("/api/tracks").headers["etag"]


def test_a_corridor_at_full_resolution(page: Page) -> None:
    everything = page.columns("/api/tracks")
    box = {"left": 20.0, "right": 30.0, "low": 3.0, "high": 9.0}
    part = page.columns("/api/tracks/window", floor=1, **box)
    inside = everything.filter(pl.col("floor") == 1, pl.col("x").is_between(20, 30), pl.col("y").is_between(3, 9))
    assert 100 < len(part) == len(inside)
    assert part["cov_xx"].is_not_nan().all()
    few = page.columns("/api/tracks/window", floor=1, sessions="0,2", **box)
    assert set(few["session"].unique()) <= {0, 2}


def test_one_walk_with_its_charts(page: Page) -> None:
    session = page.get("/api/sessions")["sessions"][0]
    track = page.columns(f"/api/sessions/{session['id']}/track")
    assert len(track) == sum(session["frames"].values())
    assert track["t"][0] == 0.0
    assert abs(track["t"].to_numpy().max() - session["duration_s"]) < 0.05
    assert np.nanmax(track["speed"].to_numpy()) < 3.0
    series = page.columns(f"/api/sessions/{session['id']}/series", points=200)
    assert set(series["series"].unique()) >= {Series.SPEED, Series.SIGMA, Series.LANDMARKS, Series.ACCESS_POINTS}
    speed = series.filter(series=int(Series.SPEED))["v"]
    assert len(speed) <= 200
    assert speed.max() == track["speed"].drop_nans().max()
    detail = page.get(f"/api/sessions/{session['id']}")
    assert [visit["landmark"] for visit in detail["visits"] if visit["landmark"]]
    assert all(0 <= visit["t"] <= session["duration_s"] for visit in detail["visits"])
    scans = page.columns("/api/scans").filter(session=0)
    assert 0 < len(scans) <= session["scans"]
    assert (scans["access_points"].to_numpy() > 0).all()


def test_layers(page: Page) -> None:
    assert [layer["name"] for layer in page.get("/api/layers")["layers"]] == [
        *("conflicts", "contradictions", "gaps", "rooms", "walkable")
    ]
    (area,) = page.get("/api/layers/walkable", floor=1)["features"]
    assert area["shape"] == "area"
    assert len(area["coordinates"]) > 10
    arrows = page.get("/api/layers/contradictions", floor=1)["features"]
    assert {feature["landmarks"][0] for feature in arrows} >= {"2", "9"}
    assert page.client.get("/api/layers/none", params={"floor": 1}).status_code == 404


def test_places_beside_each_other_are_one_area_with_holes() -> None:
    around = [(x, y) for x in (1.0, 1.5, 2.0) for y in (2.0, 2.5, 3.0) if (x, y) != (1.5, 2.5)]
    found = sorted(outlines(np.array([*around, (4.0, 2.0)]), 0.5), key=len)
    assert [[sorted(ring) for ring in rings] for rings in found] == [
        [[(3.75, 1.75), (3.75, 2.25), (4.25, 1.75), (4.25, 2.25)]],
        [
            [(0.75, 1.75), (0.75, 3.25), (2.25, 1.75), (2.25, 3.25)],
            [(1.25, 2.25), (1.25, 2.75), (1.75, 2.25), (1.75, 2.75)],
        ],
    ]
    assert outlines(np.empty((0, 2)), 0.5) == []


def test_walks_mapped_together_are_refused_before_anything_is_looked_at(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="processes each walk separately"):
        Workspace(tmp_path / "survey", tmp_path / "labels", Settings(together=True))


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
