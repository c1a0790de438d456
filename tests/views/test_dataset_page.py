"""The page of a data set: what it says, and what a browser makes of it."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import polars as pl
import pytest
from PIL import Image
from playwright.sync_api import Page

from tests.datasets.factory import SCANS, small_dataset
from tests.views.browser import note_problems, own_part, running_browser, tags_in_figures
from vislam2tag.common.findings import Finding
from vislam2tag.datasets.model import Dataset, Storey
from vislam2tag.datasets.schema import FINGERPRINTS, READINGS, REQUIRED, SESSIONS, empty_table
from vislam2tag.datasets.splits import standard_splits
from vislam2tag.datasets.statistics import dataset_statistics
from vislam2tag.datasets.statistics_record import FieldWork
from vislam2tag.site.walkable.walked import WalkedArea, WalkedFloor, WalkToFill
from vislam2tag.views import dataset_page

EVIL = "</script><img src=x onerror=alert(1)>"


def make_dataset(folder: Path) -> Dataset:
    """Two floors, one with a plan and a gap; a title that tries to break out of the page; splits; a finding."""
    dataset = small_dataset()
    Image.new("RGB", (60, 30), "white").save(folder / "plan.png")
    ground, upper = dataset.info.floors
    finding = Finding(kind="repeated_readings", file="wifi", count=3, message="left out")
    info = dataset.info.model_copy(
        update={
            "title": EVIL,
            "floors": (ground.model_copy(update={"plan": "plan.png"}), upper),
            "findings": (finding,),
        }
    )
    readings = dataset.readings.collect()
    stray = readings.tail(1).with_columns(floor=pl.lit(0, pl.Int32), x=pl.lit(47.0), y=pl.lit(11.0))
    tables = {**dataset.tables, READINGS: pl.concat([readings, stray]).lazy()}
    whole = replace(dataset, info=info, tables=tables, files={"plan.png": folder / "plan.png"})
    return replace(whole, splits=standard_splits(whole))


@pytest.fixture(scope="module")
def text(tmp_path_factory: pytest.TempPathFactory) -> str:
    dataset = make_dataset(tmp_path_factory.mktemp("set"))
    return dataset_page.dataset_page(dataset, dataset_statistics(dataset, FieldWork(people=2, hours=1.0)))


def test_hover_labels_hold_names_as_text(tmp_path: Path) -> None:
    dataset = make_dataset(tmp_path)
    evil = (pl.lit(EVIL) + pl.col("device", "session", "building")).name.keep()
    tables = {
        name: table.with_columns(evil) if name in (FINGERPRINTS, SESSIONS) else table
        for name, table in dataset.tables.items()
    }
    named = replace(dataset, tables=tables, splits={})
    page = dataset_page.dataset_page(named, dataset_statistics(named, FieldWork(people=2, hours=1.0)))
    assert not tags_in_figures(page)


def test_rooms_of_the_plan_are_listed_by_name(text: str, tmp_path: Path) -> None:
    areas = [
        WalkedArea(name=f"room {EVIL}", room=True, area_m2=12, walked=0, scanned=0, entered=False, place_m=(1, 2)),
        WalkedArea(name="corridor", room=False, area_m2=30, walked=0.5, scanned=0.4, entered=True, place_m=(5, 2)),
    ]
    walk = WalkToFill(length_m=44.0, minutes=1.0, points_m=[(1, 2), (5, 2)], stops_m=[(1, 2)])
    floor = WalkedFloor(number=0, walkable_m2=42, walked=0.36, scanned=0.29, areas=areas, walk=walk)
    dataset = make_dataset(tmp_path)
    page = dataset_page.dataset_page(
        dataset, dataset_statistics(dataset), {Storey(dataset.info.floors[0].building, 0): floor}
    )
    words = re.sub(r"\s+", " ", re.sub(r"<[^>]+>", " ", own_part(page)))
    assert "42 m² 36 % 29 % 0 of 1 44 m, 1 min" in words
    assert "Walks entered 0 of 1 rooms, but not room &lt;/script&gt;" in words
    assert "corridor 30 m² 50 % 40 % yes" in words
    assert not tags_in_figures(page)
    assert "Walkable (plan)" not in text


def maps(page: str) -> list[dict[str, Any]]:
    drawn = re.findall(r'map"[^>]*></div>\n<script type="application/json">(.*?)</script>', page)
    return [json.loads(found) for found in drawn]


def test_totals_table_and_rates_stand_in_the_page(text: str) -> None:
    words = re.sub(r"\s+", " ", re.sub(r"<[^>]+>", " ", own_part(text)))
    assert "44 labelled Wi-Fi fingerprints (92 % of all)" in words
    assert "22 per person-hour" in words
    assert "Effort: 2 people, 2.0 person-hours on site." in words
    assert "Galaxy 2 1.20 72.00 1.00" in words
    assert "repeated readings" in words
    assert "Wi-Fi 10 0 0 0 -41 dBm" in words


def test_the_page_needs_nothing_else_and_escapes_what_people_wrote(text: str) -> None:
    assert EVIL not in own_part(text)
    assert not re.findall(r'(?:src|href)="(?!#|data:)', own_part(text))


def test_gaps_and_the_walk_that_fills_them_are_told_and_drawn(text: str) -> None:
    ground, upper = maps(text)
    names = [trace["name"] for trace in ground["data"]]
    assert names[-1] == "walk to fill the gaps, 0 m"
    assert not upper["data"][-1]["name"].startswith("walk")
    assert ground["layout"]["images"][0]["sizex"] == 60
    assert re.search(r"Floor 0</a></td><td[^>]*>22<.*?>1 stop|0\u00a0m, 1 stop", own_part(text))


def test_splits_tell_how_they_leak(text: str) -> None:
    rows = re.findall(r'<tr><td class="head">(\w+)</td><td class="num">(\d+)</td>', own_part(text))
    assert dict(rows)["device"] == "2"
    assert {"random", "device", "trajectory"} <= dict(rows).keys()


def test_many_fingerprints_are_thinned_and_the_page_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(dataset_page, "MOST_POINTS", 5)
    monkeypatch.setattr(dataset_page, "MOST_SESSIONS", 1)
    dataset = small_dataset()
    page = dataset_page.dataset_page(dataset, dataset_statistics(dataset))
    drawn = [sum(len(t["x"]) for t in figure["data"] if t.get("meta") == "fingerprints") for figure in maps(page)]
    assert drawn == [5, 5]
    assert "5 of 22 fingerprints are shown as points." in page
    assert "1 of 4 walks" in page


def test_points_without_walks_sigma_and_dates_have_a_page() -> None:
    dataset = small_dataset()
    bare = {
        FINGERPRINTS: dataset.fingerprints.with_columns(sigma=None, device=None),
        SESSIONS: dataset.sessions.with_columns(started=None, duration_s=None, distance_m=None, labelled_m=None),
    }
    tables = {name: table.cast(dataset.tables[name].collect_schema()) for name, table in bare.items()}
    points = replace(dataset, tables={**dataset.tables, **tables})
    page = own_part(dataset_page.dataset_page(points, dataset_statistics(points)))
    assert "Sigma of" not in page
    assert "per minute of walking" not in page
    assert '<option value="0">' not in page
    assert "Walks by device" not in page
    assert "</b> sessions</li>" in page


def test_an_empty_set_says_so() -> None:
    empty = replace(small_dataset(), tables={name: empty_table(name).lazy() for name in REQUIRED})
    assert "does not contain fingerprints" in dataset_page.dataset_page(empty, dataset_statistics(empty))


def test_more_devices_than_the_palette_has_keep_colours_of_their_own() -> None:
    colours = dataset_page._colours([f"phone {n}" for n in range(20)])
    assert len(set(colours.values())) == 20


@pytest.fixture(scope="module")
def page(text: str, tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Page, list[str]]]:
    file = tmp_path_factory.mktemp("page") / "report.html"
    file.write_text(text, encoding="utf-8")
    problems: list[str] = []
    with running_browser() as browser:
        page = browser.new_page(viewport={"width": 1280, "height": 900})
        note_problems(page, problems)
        page.goto(file.as_uri())
        page.wait_for_selector("#sessions")
        yield page, problems


@pytest.mark.slow
def test_the_browser_draws_every_map_and_chart_without_complaint(page: tuple[Page, list[str]]) -> None:
    opened, problems = page
    assert opened.locator(".map .scatterlayer .trace").count() >= 4
    drawn = opened.evaluate("[...document.querySelectorAll('.chart')].map((one) => one.querySelectorAll('svg').length)")
    assert len(drawn) >= 6
    assert all(drawn)
    assert opened.locator("#floor-0 .map image").count() >= 1
    assert problems == []


@pytest.mark.slow
def test_fingerprints_are_coloured_by_what_is_chosen_and_back(page: tuple[Page, list[str]]) -> None:
    opened, problems = page
    script = """() => document.querySelector('#floor-0 .map').data.filter((trace) => trace.meta)
        .map((trace) => [trace.meta, trace.visible, trace.marker ? trace.marker.color : null])"""
    first = opened.evaluate(script)
    opened.select_option("#floor-0 select", "1")
    coloured = {meta: colour for meta, _, colour in opened.evaluate(script)}
    assert len(coloured["fingerprints"]) == SCANS - 1
    opened.select_option("#floor-0 select", "counts")
    assert {meta: visible for meta, visible, _ in opened.evaluate(script)} == {"counts": True, "fingerprints": False}
    opened.select_option("#floor-0 select", "device")
    again = opened.evaluate(script)
    assert [colour for _, _, colour in again] == [colour for _, _, colour in first]
    assert problems == []


@pytest.mark.slow
@pytest.mark.parametrize("width", [390, 1280])
def test_the_page_is_no_wider_than_the_window(page: tuple[Page, list[str]], width: int) -> None:
    opened, _ = page
    opened.set_viewport_size({"width": width, "height": 800})
    drawings = "[...document.querySelectorAll('.main-svg')]"
    opened.wait_for_function(f"{drawings}.every((one) => one.getBoundingClientRect().width <= innerWidth)")
    assert opened.evaluate("document.documentElement.scrollWidth") <= width
