"""A served model answers scans, refuses what is not, and shows its page; nobody else's page may ask it."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest
from playwright.sync_api import Route

from tests.positioning.radio_world import radio_world
from tests.views.browser import running_browser
from vislam2tag.pipeline.positioning import serve as serving_app
from vislam2tag.pipeline.positioning.serve import MOST_LATEST, MOST_SCANS, ServedAnswers, locate_app
from vislam2tag.positioning.model_files import ModelOrigin, SavedModel, save_model
from vislam2tag.positioning.registry import model_named

SCANS, PLACES = radio_world(seed=1)


@pytest.fixture(scope="module")
def saved() -> SavedModel:
    model = model_named("weighted-knn").fit(SCANS, PLACES)
    return SavedModel("weighted-knn", model, ModelOrigin(dataset="world", scans=len(SCANS)))


def asked(
    answers: ServedAnswers, method: str, path: str, host: str = "127.0.0.1:8780", **options: Any
) -> httpx.Response:
    async def ask() -> httpx.Response:
        transport = httpx.ASGITransport(app=locate_app(answers))
        async with httpx.AsyncClient(transport=transport, base_url=f"http://{host}") as client:
            return await client.request(method, path, **options)

    return asyncio.run(ask())


def scan(row: int) -> dict[str, Any]:
    one = SCANS[np.array([row])]
    readings = {
        SCANS.access_points[at].upper(): level for at, level in zip(one.column, one.rssi_dbm.tolist(), strict=True)
    }
    return {"scan_id": f"s{row}", "readings": readings}


def test_scans_are_located_and_the_page_learns_of_them(saved: SavedModel) -> None:
    answers = ServedAnswers(saved)
    deaf = {"scan_id": "deaf", "readings": {"stranger": -50}}
    answer = asked(answers, "POST", "/locate", json={"scans": [scan(5), deaf]})
    assert answer.status_code == 200
    found, unknown = answer.json()["positions"]
    expected = saved.model.predict(SCANS[np.array([5])])
    assert (found["x"], found["y"]) == pytest.approx(tuple(expected.xy[0]), abs=0.001)
    assert (found["status"], found["floor"], unknown["status"], unknown["x"]) == ("ok", 0, "unknown", None)
    assert asked(answers, "GET", "/latest").json()["positions"] == [found, unknown]
    for _ in range(2):
        asked(answers, "POST", "/locate", json={"scans": [scan(row) for row in range(MOST_LATEST)]})
    assert len(asked(answers, "GET", "/latest").json()["positions"]) == MOST_LATEST


@pytest.mark.parametrize(
    ("options", "status", "message"),
    [
        ({"content": b"{}"}, 415, "application/json"),
        ({"json": {"scans": []}}, 422, "scans"),
        ({"json": {"scans": [scan(0)] * (MOST_SCANS + 1)}}, 422, "scans"),
        ({"json": {"scans": [{"scan_id": "s", "readings": {"a": 100}}]}}, 422, "scans.0.readings.a"),
        ({"json": {"scans": [{"scan_id": "s"}]}}, 422, "readings: Field required; GET /api"),
        ({"content": b"[" * 100, "headers": {"content-type": "application/json"}}, 422, "JSON"),
        ({"content": b" " * 2000, "headers": {"content-type": "application/json"}}, 413, "send fewer scans"),
    ],
)
def test_what_cannot_be_answered_is_told(
    saved: SavedModel, monkeypatch: pytest.MonkeyPatch, options: dict[str, Any], status: int, message: str
) -> None:
    monkeypatch.setattr(serving_app, "MOST_BODY", 1000 if status == 413 else 1 << 20)
    answer = asked(ServedAnswers(saved), "POST", "/locate", **options)
    assert answer.status_code == status
    assert message in answer.json()["message"]


def test_who_sends_too_much_may_send_all_of_it_before_it_is_told(
    saved: SavedModel, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(serving_app, "MOST_BODY", 1000)
    sent = []

    async def body() -> AsyncIterator[bytes]:
        for number in range(10):
            sent.append(number)
            yield b" " * 300

    headers = {"content-type": "application/json"}
    answer = asked(ServedAnswers(saved), "POST", "/locate", content=body(), headers=headers)
    assert (answer.status_code, len(sent)) == (413, 10)


def test_the_page_its_parts_and_the_description(saved: SavedModel) -> None:
    answers = ServedAnswers(saved)
    for path, text in (("/", "Current position"), ("/page.js", '"use strict"'), ("/page.css", "svg")):
        answer = asked(answers, "GET", path)
        assert answer.status_code == 200
        assert text in answer.text
        assert "script-src 'self'" in answer.headers["content-security-policy"]
    described = asked(answers, "GET", "/openapi.json").json()
    assert described["paths"].keys() == {"/locate", "/latest", "/model", "/model.v2t"}
    names = described["components"]["schemas"]
    assert {"LocateRequest", "LocateAnswer", "ServedModel", "Refusal", "Scan", "Position"} <= names.keys()
    assert names["LocateRequest"]["properties"]["scans"]["maxItems"] == MOST_SCANS
    assert names["Scan"]["properties"]["readings"]["description"].startswith("Signal strength (dBm)")
    model = asked(answers, "GET", "/model").json()
    assert (model["dataset"], model["access_points"]) == ("world", len(SCANS.access_points))
    assert [(one["building"], one["plan"]) for one in model["floors"]] == [
        ("east", None),
        ("east", None),
        ("west", None),
    ]
    assert asked(answers, "GET", "/plans/0").status_code == 404
    assert asked(answers, "GET", "/elsewhere").json()["message"].startswith("this address or method does not exist")


def test_a_page_tells_how_programs_ask(saved: SavedModel) -> None:
    host = "http://127.0.0.1:8780"
    answers = {
        path: asked(ServedAnswers(saved), "GET", path) for path in ("/api", "/api.js", "/page.css", "/openapi.json")
    }
    problems: list[str] = []

    def answer(route: Route) -> None:
        found = answers.get(route.request.url.removeprefix(host))
        if found is None:
            problems.append(f"asked for {route.request.url}")
            route.abort()
        else:
            route.fulfill(status=found.status_code, headers=dict(found.headers), body=found.content)

    with running_browser() as browser:
        page = browser.new_page(viewport={"width": 400, "height": 800})
        page.on("pageerror", lambda error: problems.append(str(error)))
        page.route("**/*", answer)
        page.goto(f"{host}/api")
        page.wait_for_selector("#Refusal")
        text = page.inner_text("body")
        wide = page.evaluate("document.documentElement.scrollWidth")
    assert problems == []
    assert wide == 400
    assert "POST /locate Locate scans; takes LocateRequest; 200: LocateAnswer; 400: Refusal" in text
    assert f"curl -H 'Content-Type: application/json' {host}/locate" in text
    assert f"array of Scan, at least 1, at most {MOST_SCANS}" in text
    assert "GET /model.v2t The model's file for use in apps; 200: application/octet-stream" in text


def test_the_model_s_file_is_served(saved: SavedModel, tmp_path: Path) -> None:
    save_model(saved, tmp_path / "model.v2t")
    assert asked(ServedAnswers(saved), "GET", "/model.v2t").content == (tmp_path / "model.v2t").read_bytes()


def test_scans_of_a_walk_tell_together_how_large_their_circles_are() -> None:
    model = model_named("local-kriging").fit(SCANS, PLACES)
    answers = ServedAnswers(SavedModel("local-kriging", model, ModelOrigin(dataset="world", scans=len(SCANS))))
    rows = range(12)
    radii = {}
    for session in ("", "walk"):
        scans = [{**scan(row), "session": session} for row in rows]
        found = asked(answers, "POST", "/locate", json={"scans": scans}).json()["positions"]
        radii[session] = [one["radius_68_m"] for one in found]
        asked_for = replace(SCANS[np.array(rows)], session=np.full(len(rows), session))
        assert radii[session] == pytest.approx(model.predict(asked_for).radius_68_m.tolist(), abs=0.001)
    assert radii[""] != radii["walk"]


def test_another_name_that_leads_here_is_refused(saved: SavedModel) -> None:
    assert asked(ServedAnswers(saved), "GET", "/model", host="evil.example:8780").status_code == 400
    assert asked(ServedAnswers(saved), "GET", "/model", host="localhost:8780").status_code == 200
