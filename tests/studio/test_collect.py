"""Walks that phones hand over while the studio runs: received over HTTP, mapped at once, and what they have covered."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest
from playwright.sync_api import expect

from tests.receiving.signing import signed
from tests.receiving.zips import digest, session_zip
from tests.report.browser import running_browser
from tests.studio.running import Page, running_studio
from vislam2tag.receiving.server import UPLOADS
from vislam2tag.simulation.choices import SessionLayout
from vislam2tag.simulation.scenario import regular_survey
from vislam2tag.simulation.survey import WritingOptions, simulate
from vislam2tag.studio.layers.gaps import strips

LATEST_MS = 120_000
OWN = {"truth.csv", "script.txt"}
"""Files that the simulator puts beside what a phone writes."""


@pytest.fixture
def walks(tmp_path: Path) -> tuple[Path, list[bytes]]:
    """A survey with one walk, and the zips of two more."""
    survey, away = tmp_path / "survey", tmp_path / "away"
    simulate(regular_survey(6, "none", (1,), ("LG",), 3, 60.0), survey, WritingOptions(layout=SessionLayout.PHONE))
    zips = []
    for session in sorted((survey / "floor_1" / "LG").iterdir())[1:]:
        shutil.move(session, away / session.name)
        files = {path.name: path.read_bytes() for path in (away / session.name).iterdir() if path.name not in OWN}
        zips.append(session_zip(files, session.name))
    return survey, zips


@pytest.fixture
def studio(walks: tuple[Path, list[bytes]]) -> Iterator[Page]:
    with running_studio(walks[0], "--jobs", "1") as page:
        yield page


def hand_over(collecting: dict[str, Any], data: bytes) -> httpx.Response:
    """Bring a zip as the phone app does."""
    address, _, token = collecting["url"].partition("/#")
    headers = signed(token, "PATCH", digest(data), data, 0, len(data))
    port = address.rpartition(":")[2]
    return httpx.patch(f"http://127.0.0.1:{port}{UPLOADS}/{digest(data)}", content=data, headers=headers, timeout=60)


def test_walks_appear_as_they_are_handed_over_and_show_what_is_covered(
    studio: Page, walks: tuple[Path, list[bytes]]
) -> None:
    with running_browser() as browser:
        page = browser.new_page(viewport={"width": 1200, "height": 800}, base_url=studio.url, locale="en")
        page.set_default_timeout(LATEST_MS)
        page.goto(f"{studio.url}/#{studio.token}")
        page.get_by_role("button", name="Make the labels of 1 walks").click()
        page.wait_for_function(MAPPED, arg=1)
        page.get_by_role("tab", name="Collect").click()
        floor = page.locator("li[data-floor='1']")
        expect(floor).to_contain_text("walked", timeout=LATEST_MS)
        page.get_by_role("button", name="Receive from phones").click()
        expect(page.get_by_role("img", name="Code with the address for phones")).to_be_visible(timeout=LATEST_MS)
        collecting = page.request.get("/api/collecting", timeout=LATEST_MS).json()
        assert len(collecting["code"]) == len(collecting["code"][0]) >= 21
        (first,) = page.request.get("/api/covered", timeout=LATEST_MS).json()["floors"]
        shares, places = [first["walked"]], [first["next_m"]]
        assert shares[0] > 0
        for number, data in enumerate(walks[1], start=1):
            assert hand_over(collecting, data).status_code == 200
            expect(page.get_by_role("list", name="Received").locator("li")).to_have_count(number, timeout=LATEST_MS)
            page.wait_for_function(MAPPED, arg=number + 1)
            (covered,) = page.request.get("/api/covered", timeout=LATEST_MS).json()["floors"]
            shares.append(covered["walked"])
            places.append(covered["next_m"])
            expect(floor).to_contain_text(f"{100 * covered['walked']:.1f} % of", timeout=LATEST_MS)
        assert shares == sorted(shares)
        assert shares[-1] > shares[0]
        assert len(set(map(tuple, places))) > 1
        drawn = page.request.get("/api/layers/gaps?floor=1", timeout=LATEST_MS).json()["features"]
        assert {feature["shape"] for feature in drawn} == {"area", "line", "point"}
        assert drawn[-1]["coordinates"] == [places[-1]]
        floor.get_by_role("button", name="Go here next").click()
        page.get_by_role("button", name="Receive no more").click()
        expect(page.get_by_role("button", name="Receive from phones")).to_be_visible()
        with pytest.raises(httpx.ConnectError):
            hand_over(collecting, walks[1][0])


MAPPED = """async (count) => {
  const { sessions } = await (await fetch('/api/sessions')).json();
  return sessions.length === count && sessions.every(({ labelled, stale }) => labelled && !stale);
}"""


def test_places_beside_each_other_are_drawn_as_one_strip() -> None:
    places = np.array([(1.0, 2.0), (1.5, 2.0), (3.0, 2.0), (1.0, 2.5)])
    found = strips(places, 0.5)
    assert found[0] == [(0.75, 1.75), (1.75, 1.75), (1.75, 2.25), (0.75, 2.25)]
    assert [corner[0] for corner in found[1:]] == [(2.75, 1.75), (0.75, 2.25)]
    assert strips(np.empty((0, 2)), 0.5) == []
