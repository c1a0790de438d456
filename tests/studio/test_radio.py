"""Radio maps for the page: of each access point and of all, and what changed between two outputs."""

from __future__ import annotations

import itertools
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest
from playwright.sync_api import expect

from tests.studio.faulty_survey import write_faulty_survey
from tests.studio.running import Page, running_studio
from tests.studio.test_page import LATEST_MS, open_view, picture
from tests.views.browser import running_browser
from vislam2tag.pipeline.labels.process import process


@pytest.fixture(scope="module")
def faulty(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A survey of its own: others' tests correct theirs meanwhile."""
    folder = tmp_path_factory.mktemp("radio-survey")
    process(write_faulty_survey(folder), folder / "labels")
    return folder


@pytest.fixture(scope="module")
def mapped(faulty: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Page]:
    """A studio on the labels and on a second output, in which one access point is 20 dB fainter."""
    other = tmp_path_factory.mktemp("radio") / "other"
    shutil.copytree(faulty / "labels", other)
    loudest = loudest_of(pl.read_parquet(sorted((other / "wifi").glob("*.parquet"))))
    for path in (other / "wifi").glob("*.parquet"):
        table = pl.read_parquet(path)
        fainter = pl.when(pl.col("bssid") == loudest).then(pl.col("rssi_dbm") - 20).otherwise("rssi_dbm")
        table.with_columns(rssi_dbm=fainter.cast(pl.Float32)).write_parquet(path)
    options = ("--labels", str(faulty / "labels"), "--compare", str(other), "--jobs", "1")
    with running_studio(faulty / "survey", *options) as page:
        page.enter()
        assert page.get("/api/radio")["state"] == "none"
        assert page.client.get("/api/radio/map", params=query(1, "strongest")).status_code == 404
        job = page.do("radio")
        assert (job["state"], job["error"]) == ("done", None)
        yield page


def loudest_of(readings: pl.DataFrame) -> str:
    return str(readings.group_by("bssid").agg(pl.col("rssi_dbm").mean()).sort("rssi_dbm", "bssid")["bssid"][-1])


def query(floor: int, layer: str, bssid: str = "") -> dict[str, Any]:
    return {"floor": floor, "technology": "wifi", "layer": layer, "bssid": bssid}


def cells(page: Page, *asked: Any) -> np.ndarray[Any, Any]:
    return page.columns("/api/radio/map", **query(*asked))["v"].to_numpy()


def test_maps_of_all_access_points_are_made_of_those_of_each(mapped: Page) -> None:
    found = mapped.get("/api/radio")
    assert found["state"] == "ready"
    assert [floor["floor"] for floor in found["floors"]] == [1, 2]
    floor = found["floors"][0]
    points = floor["access_points"]
    means = np.array([cells(mapped, 1, "mean_dbm", point["bssid"]) for point in points])
    assert means.shape == (len(points), floor["rows"] * floor["columns"])
    strongest = cells(mapped, 1, "strongest")
    known = np.isfinite(means).any(axis=0)
    assert np.array_equal(np.isfinite(strongest), known)
    assert np.array_equal(strongest[known], np.nanmax(means[:, known], axis=0))
    heard = np.array([cells(mapped, 1, "heard", point["bssid"]) for point in points])
    number = cells(mapped, 1, "number")
    assert np.allclose(number[np.isfinite(number)], np.nansum(heard, axis=0)[np.isfinite(number)], atol=1e-4)
    for point, mean in zip(points, means, strict=True):
        left, right, low, high = floor["extent_m"]
        row, column = divmod(int(np.nanargmax(mean)), floor["columns"])
        x, y = (
            left + (column + 0.5) * (right - left) / floor["columns"],
            low + (row + 0.5) * (high - low) / floor["rows"],
        )
        assert point["place_m"] == pytest.approx((x, y), abs=0.01)


def test_what_changed_between_two_outputs_is_told(mapped: Page, faulty: Path) -> None:
    (changes,) = mapped.get("/api/radio")["changes"]
    loudest = loudest_of(pl.read_parquet(sorted((faulty / "labels" / "wifi").glob("*.parquet"))))
    assert (changes["output"], changes["technology"]) == ("compare-1", "wifi")
    assert [(point["bssid"], point["change"]) for point in changes["changed"]] == [(loudest, "fainter")]
    assert changes["changed"][0]["difference_db"] < -10


@pytest.mark.slow
def test_the_page_draws_them(mapped: Page) -> None:
    with running_browser() as browser:
        page = browser.new_page(viewport={"width": 1200, "height": 800}, base_url=mapped.url, locale="en")
        page.set_default_timeout(LATEST_MS)
        page.goto(mapped.post("/api/invitations", {})["url"])
        open_view(page, "Data and radio")
        points = page.locator(".list .row")
        expect(points.first).to_contain_text("dBm at", timeout=LATEST_MS)
        expect(page.get_by_text("100.0 % of the mapped cells are shown.")).to_be_visible(timeout=LATEST_MS)
        pictures = [picture(page)]
        page.get_by_label("Show cells from").fill("-60")
        expect(page.get_by_text("of the mapped cells are shown.")).not_to_contain_text("100.0 %", timeout=LATEST_MS)
        pictures.append(picture(page))
        page.get_by_label("Search access points").fill("nothing like it")
        expect(page.get_by_text("No match.")).to_be_visible()
        page.get_by_label("Search access points").fill("")
        points.first.click()
        expect(page.get_by_label("Quantity")).to_have_value("mean_dbm")
        pictures.append(picture(page))
        open_view(page, "Walks")
        pictures.append(picture(page))
        assert all((one != other).any() for one, other in itertools.pairwise(pictures))


def test_there_is_no_map_of_what_is_not_there(mapped: Page) -> None:
    for asked in (query(9, "strongest"), query(1, "heard", "nobody")):
        assert mapped.client.get("/api/radio/map", params=asked).status_code == 404
    assert mapped.client.get("/api/radio/map", params=query(1, "wrong")).status_code == 422
