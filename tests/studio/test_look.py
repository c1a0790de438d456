"""What the page is given to look at, by a studio that runs."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
from PIL import Image

from tests.studio.running import Page
from vislam2tag.core.status import Status
from vislam2tag.studio.series import Series


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
        *("conflicts", "contradictions", "gaps", "walkable")
    ]
    (area,) = page.get("/api/layers/walkable", floor=1)["features"]
    assert area["shape"] == "area"
    assert len(area["coordinates"]) > 10
    arrows = page.get("/api/layers/contradictions", floor=1)["features"]
    assert {feature["landmarks"][0] for feature in arrows} >= {"2", "9"}
    assert page.client.get("/api/layers/none", params={"floor": 1}).status_code == 404
