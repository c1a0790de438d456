"""A hundred sessions with three million frames: nothing is missing, and no answer is larger than a browser bears."""

from __future__ import annotations

from collections.abc import Iterator

import polars as pl
import pytest

from tests.studio.running import Page, running_studio
from tests.studio.scale_survey import FRAMES, SESSIONS, write_scale_survey
from vislam2tag.studio.outputs import OVERVIEW_POINTS, WINDOW_POINTS

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def large(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Page]:
    folder = tmp_path_factory.mktemp("large")
    write_scale_survey(folder)
    with running_studio(folder / "survey", "--labels", str(folder / "labels"), "--jobs", "1") as page:
        assert page.enter().status_code == 204
        yield page


def test_the_overview_has_every_session_in_few_bytes(large: Page) -> None:
    sessions = large.get("/api/sessions")["sessions"]
    assert len(sessions) == SESSIONS
    assert sum(sum(session["frames"].values()) for session in sessions) == SESSIONS * FRAMES
    answer = large.client.get("/api/tracks")
    overview = pl.read_ipc_stream(answer.content)
    assert overview["session"].unique().sort().to_list() == list(range(SESSIONS))
    assert 0.9 * OVERVIEW_POINTS < len(overview) < 1.1 * OVERVIEW_POINTS
    assert len(answer.content) < 5_000_000
    ends = overview.group_by("session").agg(pl.col("t").max())["t"].to_numpy()
    assert (ends > 0.99 * sessions[0]["duration_s"]).all()


def test_a_corridor_comes_whole_and_a_floor_in_bounds(large: Page) -> None:
    sessions = large.get("/api/sessions")["sessions"]
    left, right, low, high = sessions[0]["bounds"]["0"]
    floor = large.client.get(
        "/api/tracks/window",
        params={"floor": 0, "left": left - 2, "right": right + 2, "low": low - 2, "high": high + 2},
    )
    there = pl.read_ipc_stream(floor.content)
    assert int(floor.headers["studio-stride"]) > 1
    assert WINDOW_POINTS / 3 < len(there) <= WINDOW_POINTS + SESSIONS
    assert there["session"].n_unique() == sum(1 for session in sessions if session["key"]["floor"] == 0)
    track = large.columns(f"/api/sessions/{sessions[0]['id']}/track")
    x, y = track["x"].to_numpy()[15_000], track["y"].to_numpy()[15_000]
    box = {"left": x - 2, "right": x + 2, "low": y - 2, "high": y + 2}
    part = large.client.get("/api/tracks/window", params={"floor": 0, **box})
    assert part.headers["studio-stride"] == "1"
    own = pl.read_ipc_stream(part.content).filter(session=0)
    within = track.filter(pl.col("x").is_between(x - 2, x + 2), pl.col("y").is_between(y - 2, y + 2))
    assert own["frame"].to_list() == within["frame"].to_list()
